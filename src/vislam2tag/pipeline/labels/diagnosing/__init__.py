"""``diagnose``: a session's part (``diagnose_session``), all walks put together (``survey_evidence``), and the answer."""
