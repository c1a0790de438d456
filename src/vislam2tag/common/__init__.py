"""What every package may use, whatever it is about.

``errors`` end a command, ``findings`` do not; ``records`` are the base of what is kept or set. ``files`` reads files
and writes them whole, ``text_tables`` writes tables as text; ``plugins`` finds what is installed.
``error_statistics`` and ``palette``: counts of errors and their scatter, colours.
"""
