"""Positioning by radio scans: models that learn where scans were taken, how sure they are, and how they compare.

In the order in which data meet the modules: ``scan_file`` and ``learning_data`` read files and data sets into
``radio_scans`` and their ``places``; ``registry`` says what a model is, and each module of ``models`` registers one,
made of ``signal_distance`` or what lies in ``cell_density`` or ``networks``. ``error_radii`` turns spreads of guesses
into radii that hold what they promise; ``sequences`` lets the scans of a walk help each other. ``model_files`` keep a
model, ``model_scores`` judge and choose one; ``benchmark`` compares all, ``benchmark_tables`` show what it finds. Walks
tell each other where they were by what they heard (``walk_traces``, ``heard_floor``, ``walk_ties``).
"""
