"""The report of `process`: totals and one page over all sessions.

``summary`` reduces results to totals; ``views``, ``floor_view`` and ``uncertainty_view`` (with
``uncertainty_figures``) are what the page shows of them, ``html`` writes it session by session.
"""
