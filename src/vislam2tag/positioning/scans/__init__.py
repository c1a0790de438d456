"""What models learn from and answer.

``scan_file``, ``track_file`` and ``learning_data`` read files and data sets into ``radio_scans`` and their
``places``; ``representation`` makes numbers of levels that can be compared, ``held_out`` says which scans may speak
for others.
"""
