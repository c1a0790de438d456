"""Time-based annotation: a position for every time-stamped reading.

``tables`` are made of a trajectory and readings; where floors have frames of their own, each row goes to that of its
floor (``new_frame``). What is kept of a session besides is its result (``results``). A walk that was mapped in memory
is a ``mapped_walk``.
"""
