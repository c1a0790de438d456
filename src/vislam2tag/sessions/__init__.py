"""Sessions: what one walk recorded, and one reader per raw format.

``registry`` finds the reader of a session among ``formats``, which read ``session_files`` with what they share in
``tables`` and ``phone`` into a ``model``; ``clock`` finds tables that never meet the frames. ``corrected`` applies
the survey's corrections, ``floors_walked`` chooses landmarks, ``site_findings`` compares them with the site:
``prepared`` is a session as every command sees it. ``inspection`` looks without mapping.
"""
