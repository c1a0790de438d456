"""Raw tables of a session, one file a table: text to typed columns with line numbers."""
