"""Walks that other apps recorded: poses of another tracker, pictures in place of landmark poses.

``text`` and ``axes`` turn an app's rows into poses in the ACS, ``units`` tells what its accelerometer counts in,
``plausible`` whether somebody can have walked so, and
``format`` makes a session of them, with the landmarks that were found in its ``pictures``. Each app is a format of
``sessions.formats``.
"""
