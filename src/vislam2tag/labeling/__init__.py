"""Time-based annotation: a position for every time-stamped reading."""
