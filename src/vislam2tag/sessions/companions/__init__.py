"""Companions: recordings of the same walk by other devices, tied to the session that has the poses.

``recording`` reads one, whatever wrote it (``table``: any CSV or Parquet), ``clocks`` finds how far its clock is ahead
of the session's, and ``tie`` is the small file that remembers it, in the folder ``companions`` of the session.
``attached`` gives a session the tables of its companions, on its own clock.
"""
