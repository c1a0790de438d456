"""Sessions: what one walk recorded.

``registry`` lists a survey's sessions and lets one of ``formats`` read each to the ``model``, with what formats share
in ``tables``, ``phone``, ``session_files`` and ``clock``. ``corrected`` applies corrections, ``session_landmarks``
chooses the landmarks that the session may use, ``drawn_floor`` tells where there are walls:
``companions`` adds what other devices recorded on the walk;
``prepared`` does it all for every command and tells what is odd then. ``inspection`` shows a whole survey.
``in_memory`` makes a session of tables instead of files.
"""
