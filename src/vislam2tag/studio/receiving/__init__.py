"""Receives sessions from phones: checks zips and saves them in the survey (docs/how-to/receive.md)."""
