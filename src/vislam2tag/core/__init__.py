"""The numeric core: arrays in frozen dataclasses; no files, no data frames, no plots.

``tracks`` is what one session gives to a mapping strategy and what it gets back; ``context`` is what its tracker says
of itself, ``status`` why a frame has a position or none, ``faults`` what went wrong. The rest is algebra on these:
``pose_lag`` and ``tracker_sections`` before mapping, ``visits``, ``similarity``, ``orientation`` and ``robust`` for
it, ``uncertainty`` and ``interpolation`` after it; ``path_length`` and ``cell_grid`` for whoever counts.
"""
