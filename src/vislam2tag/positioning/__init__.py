"""Positioning by radio scans: models that learn where scans were taken, how sure they are, and how they compare.

In the order in which data meet the modules: ``scans`` reads what was heard and where; ``registry`` says what a model
is, and each module of ``models`` registers one, made of what lies in ``baselines``, ``cell_density`` or ``networks``.
``error_radii`` turns spreads of guesses into radii that hold what they promise; ``sequences`` lets the scans of a walk
help each other. ``model_file`` and ``onnx_export`` keep a model, ``metrics`` and ``benchmark`` judge it.
"""
