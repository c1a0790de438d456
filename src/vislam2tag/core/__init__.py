"""The numeric core: arrays in frozen dataclasses; no files, no data frames, no plots.

Data meet it in this order: what a session logged (``tracks``, with what its tracker and building say in ``context``),
closest approaches to landmarks (``visits``), a trajectory with the cause of each gap (``tracks``, ``status``), a
position for any time (``interpolation``). The rest is algebra that many need: ``transforms``, ``robust``,
``path_length``, ``clocks``, ``cell_grid``.
"""
