"""Files and folders, here and in object stores: read where nothing waits, written whole or not at all.

``given_files`` and ``archives`` read what others gave; ``table_files`` (with ``parquet_layout``) and ``toml_file``
tables and settings. ``whole_output`` and ``atomic`` let nothing be half written; ``own_files`` is the record of which
files of an output folder are ours. ``store`` is a folder in an object store, ``stored_folder`` one that may lie there
or here.
"""
