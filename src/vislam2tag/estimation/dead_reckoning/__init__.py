"""Walks without a tracker: a path from inertial sensors and a few known positions (docs/explanation/dead_reckoning.md).

In reading order: ``signals`` (one clock, and headings), ``gait`` (speed and direction of walking), ``maps`` (walls and
other walks), ``factors`` (the least-squares problem), ``smoothing`` (its solution), and ``walk`` (the whole process,
events, and contradicting fixes). ``bridging`` puts such a path into a tracker's outages.
"""
