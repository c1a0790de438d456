"""``check``: a survey against itself, a session's part (``check_session``; without poses ``check_fixes``), and what of
the plans was walked (``walked_floors``).
"""
