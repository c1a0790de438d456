"""Labels checked without truth (docs/explanation/self-check.md).

Each landmark is left out in turn (``left_out``), which tells a session's ``accuracy`` and, over all sessions, the
``bad_landmarks``; ``landmark_gain`` is what one more landmark would help a session, ``gain_map`` a floor. ``record`` is
what is kept of it.
"""
