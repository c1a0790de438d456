"""``diagnose``: a session's part (``diagnose_session``), all walks together (``survey_evidence``), and the answer."""
