"""The report of `process`: totals and one page over all sessions.

``summary`` reduces results to totals; ``verdict`` is the page's first screen, ``views``, ``floor_view`` and
``uncertainty_view`` (with ``uncertainty_figures``) are what it shows below; ``html`` writes it session by session.
"""
