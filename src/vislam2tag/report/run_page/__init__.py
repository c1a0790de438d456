"""The report of `process`: totals and one page over all sessions."""
