"""Walks without a tracker: a path from inertial sensors and a few known positions (docs/explanation/dead_reckoning.md).

A session's log goes through these in order: ``signals`` (one clock), ``heading`` (turned since the start, and roughly
against north), ``features`` and ``speed`` (how fast), ``nodes`` (where the unknowns are), ``walls`` (what a
plan says), ``equations`` and ``smoothing`` (the path and its covariances), ``walk`` (all of it), ``events``.
``training`` makes the speed model.
"""
