"""Sessions: what one walk recorded.

``registry`` lists a survey's sessions and lets one of ``formats`` read each into the ``model``. Formats share
``session_files``, ``text_tables``, ``tracker_tables``, ``readings`` and ``clocks``; ``apps`` is part of some,
``without_poses`` is for walks without tracker, ``in_memory`` makes a session of tables.

``companions`` adds what other devices recorded on the walk, tied by ``companion_ties``, also in ``foreign_tables``.
``corrected`` applies corrections, ``session_landmarks`` chooses the landmarks that the session may use and compares
their ids. ``prepared`` does it all for every command and reports what is odd; ``inspection`` shows a whole survey.
"""
