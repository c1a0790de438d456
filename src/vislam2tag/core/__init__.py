"""The numeric core: arrays in frozen dataclasses; no files, no data frames, no plots.

Data pass through these modules in order. ``tracks`` has the log of a session, ``context`` its tracker and building.
``visits`` finds closest approaches to landmarks. ``tracks`` and ``status`` have the trajectory, with the cause of each
gap, and ``interpolation`` a position for any time. The rest is shared algebra: ``transforms``, ``robust``,
``path_length``, ``clocks``, ``cell_grid``.
"""
