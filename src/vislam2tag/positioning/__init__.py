"""Positioning by radio scans: models that learn from labelled scans, their uncertainty, and their comparison.

- ``scan_file`` and ``learning_data`` read files and data sets into ``radio_scans`` and their ``places``;
  ``tracks`` reads what connects the scans of a walk.
- ``registry`` defines the interface of a model. Each module of ``models`` registers one; ``signal_distance``,
  ``cell_density`` and ``networks`` contain their parts.
- ``error_radii`` turns spreads of guesses into calibrated radii; ``sequences`` combines the scans of a walk.
- ``model_files`` saves a model, ``model_scores`` scores and chooses models, ``benchmark`` compares them, and
  ``benchmark_tables`` shows the results.
- ``walk_traces``, ``heard_floor`` and ``walk_ties`` make radio constraints between sessions.
"""
