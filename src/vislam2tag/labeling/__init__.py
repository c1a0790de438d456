"""Time-based annotation: a position for every time-stamped reading.

``readings`` labels a session's readings by its trajectory, ``tables`` makes the tables of ``schemas``, ``results`` is
what is kept besides them; ``tables_in_new_frame`` and ``results_in_new_frame`` carry both over to another frame.
"""
