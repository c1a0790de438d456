"""What a survey's owner knows better: ``corrections.toml``.

``file`` reads it. ``landmarks`` applies it to landmarks (``sessions.corrected`` to sessions). ``unknown`` reports
entries that change nothing. ``edits`` changes its text. ``conflicts`` applies a change to a file that others have
changed since, or refuses it.
"""
