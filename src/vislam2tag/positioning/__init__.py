"""Positioning by radio scans: models that learn where scans were taken, how sure they are, and how they compare.

In the order in which data meet the modules: ``scan_file`` and ``learning_data`` read files and data sets into
``radio_scans`` and their ``places``; ``registry`` says what a model is, and each module of ``models`` registers one,
made of ``nearest_scans`` or what lies in ``cell_density`` or ``networks``. ``error_radii`` turns spreads of guesses
into radii that hold what they promise; ``sequences`` lets the scans of a walk help each other. ``model_file`` and
``onnx_export`` keep a model, ``metrics`` judge it; a benchmark follows ``benchmark_protocol`` to a ``benchmark_record``
and its ``benchmark_tables``.
"""
