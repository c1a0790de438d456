"""``evaluate``: labels against truth, a session's part (``evaluate_session``), and total stations
(``evaluate_station``).
"""
