"""Time-based annotation: a position for every time-stamped reading.

``readings`` are labelled by a trajectory, ``tables`` are made of both, by their ``schemas``, and, where floors have
frames of their own, each row goes to that of its floor (``tables_in_new_frame``). What is kept of a session besides is
its result (``results``, ``results_in_new_frame``). A walk that was mapped in memory is a ``mapped_walk``.
"""
