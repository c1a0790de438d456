"""What a survey's owner knows better: ``corrections.toml``.

``file`` reads it, ``landmarks`` applies it to landmarks (``sessions.corrected`` to sessions); ``lines`` adds entries to
its text, ``edits`` changes and removes single ones, ``unused`` tells which change nothing.
"""
