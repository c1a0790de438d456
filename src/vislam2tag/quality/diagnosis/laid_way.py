"""The way of a walk laid onto the plan, bent so that it leads past each landmark where that hangs."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.similarity import Similarity2, as_points
from vislam2tag.quality.diagnosis.alignment import Alignment


class Way(NamedTuple):
    """Where a walk went: ``time_s`` (n,) increasing, from its first frame; ``place`` (n,) complex, metres, in the frame
    of its passes.
    """

    time_s: FloatArray
    place: ComplexArray


def laid_way(found: Alignment, way: Way) -> ComplexArray:
    """A way (n,) on the plan, complex metres; NaN from cut to cut where less than two landmarks say how it lies.

    Between passes it is shifted by what theirs are off, in proportion to the time from either.
    """
    walk = found.walk
    laid = np.full(len(way.place), np.nan + 0j)
    for first, end in pairwise((0, *sorted(found.cuts), len(walk.camera))):
        rows = first + np.flatnonzero(found.fits[first:end])
        if len(np.unique(walk.landmark_number[rows])) < min(2, len(found.cuts) + 1):
            continue
        turn, origin = _rigid(walk.place[rows], found.target[rows]) if found.cuts else (found.turn, found.origin)
        off = found.target[rows] - (origin + turn * walk.place[rows])
        after = first == 0 or way.time_s >= walk.time_s[first]
        before = end == len(walk.camera) or way.time_s <= walk.time_s[end - 1]
        own = np.broadcast_to(after & before, laid.shape)
        laid[own] = origin + turn * way.place[own] + np.interp(way.time_s[own], walk.time_s[rows], off)
    return laid


def _rigid(place: ComplexArray, target: ComplexArray) -> tuple[complex, complex]:
    """Turn and origin that bring places (k,) onto their targets, by least squares."""
    fitted = Similarity2.fit(as_points(place), as_points(target)).a
    turn = fitted / abs(fitted)
    return turn, complex(target.mean() - turn * place.mean())
