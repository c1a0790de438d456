"""What every package may use, whatever it is about.

``errors`` end a command, ``findings`` do not; ``records`` are the base of what is kept or set. ``table_files``,
``text_tables`` and ``toml_file`` read and write formats, ``whole_file``, ``whole_folder`` and ``lock`` let nothing be
half written; ``plugins`` and ``extras`` find what is installed. ``log_bins``, ``bootstrap`` and ``palette``: counts
of errors, their scatter, colours.
"""
