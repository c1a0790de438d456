"""The storey on which each frame of a walk lies, without flicker."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, runs_of

UNDECIDED_M = 0.5
"""This near the middle between two storeys the floor is the one before or after: who stands on a landing stays put."""


def floor_of_heights(height_m: FloatArray, elevation_m: FloatArray, carried_m: float, start: int) -> IntArray:
    """Index (f,) into the storeys of the one below the phone, ``carried_m`` above its floor, at each height (f,).

    ``elevation_m`` (s,) in any order. Near the middle between two storeys the floor changes once at most; ``start`` is
    the storey before the first frame.
    """
    order = np.argsort(elevation_m, kind="stable")
    level = elevation_m[order]
    middle = (level[1:] + level[:-1]) / 2
    margin = np.minimum(UNDECIDED_M, np.diff(level) / 4)
    foot = height_m - carried_m
    nearest = np.searchsorted(middle, foot)
    undecided = (np.searchsorted(middle - margin, foot) != nearest) | (
        np.searchsorted(middle + margin, foot) != nearest
    )
    rank = np.where(undecided, -1, nearest)
    before = int(np.flatnonzero(order == start)[0])
    return order[_settled(rank, nearest, before)]


def _settled(rank: IntArray, nearest: IntArray, before: int) -> IntArray:
    """Decide each undecided run (-1) of ranks (f,): the neighbours' floor, or one change where the two differ."""
    settled = rank.copy()
    for start, stop in runs_of(rank < 0):
        earlier = int(rank[start - 1]) if start else before
        later = int(rank[stop]) if stop < len(rank) else earlier
        settled[start:stop] = earlier
        if later != earlier:
            settled[
                start + _change(np.abs(nearest[start:stop] - earlier) < np.abs(nearest[start:stop] - later)) : stop
            ] = later
    return settled


def _change(early: BoolArray) -> int:
    """Index at which to change so that the fewest entries of the mask (k,) lie on the wrong side."""
    return int(np.argmax(np.concatenate(([0], np.cumsum(np.where(early, 1, -1))))))
