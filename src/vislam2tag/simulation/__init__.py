"""Walks, tracker, radio and inertial sensors with known truth.

``scenario`` plans a survey: a building (``building``) and each session's walk. ``walking`` makes the true walk,
``tracking`` what an AR tracker logs of it, ``sensors`` everything else that is measured, ``writing`` the files, with
the traps that real ones hold; ``survey`` takes all these steps. ``choices`` holds what users choose from.
"""
