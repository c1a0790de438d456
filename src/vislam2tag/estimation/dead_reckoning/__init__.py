"""Walks without a tracker: a path from inertial sensors and a few known positions (docs/explanation/dead_reckoning.md).

In reading order: ``signals`` (one clock, and headings), ``gait`` (how fast someone walks, and which way), ``maps``
(what walls and other walks say), ``factors`` (the least-squares problem), ``smoothing`` (its solution), ``walk`` (all
of it, what happened, and which fixes contradict the others). ``bridging`` lays such a path into a tracker's outages.
"""
