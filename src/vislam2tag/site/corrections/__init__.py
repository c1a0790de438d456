"""What a survey's owner knows better: ``corrections.toml``.

``file`` reads it, ``landmarks`` applies it to landmarks (``sessions.corrected`` to sessions) and reports entries that
change nothing; ``edits`` changes its text, ``merging`` joins two files.
"""
