"""A mapped walk, thinned to what other walks need of it, and the constraints that it gets from them, rounded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.core.tracks import Trajectory
from vislam2tag.core.transforms import as_complex
from vislam2tag.estimation.landmark_priors import LandmarkPriors

EVERY_M, EVERY_S = 1.0, 2.0
"""Others are told of a place once in so much of the way, and where a walker stands once in so many seconds."""
HOLE_S = 1.0
"""Between frames farther apart than this no one knows where a walk led."""
LEAST_M = 0.05
"""No walk knows the way between landmarks better than this."""


@dataclass(frozen=True)
class WalkTrace:
    """Where a walk led on a floor, at ``n`` moments about a metre of way apart.

    ``time_ns`` (n,) boot clock, in time order; ``position_bcs`` (n, 2) metres; ``covariance_bcs`` (n, 2, 2), m^2, of
    the walk's own errors: what it shares with the others, as the landmarks are off that all pass, is not in it;
    ``way_m`` (n,) walked until then, metres; ``whole`` (n,) whether it is known all the way since the moment before.
    """

    time_ns: IntArray
    position_bcs: FloatArray
    covariance_bcs: FloatArray
    way_m: FloatArray
    whole: BoolArray

    @classmethod
    def of(cls, mapped: Trajectory, floor: int, landmarks: LandmarkPriors) -> Self | None:
        """Thin the frames on a floor of a walk mapped past ``landmarks``; None if it led nowhere there."""
        here = np.isfinite(mapped.sigma_m)
        if len(mapped.floor):
            here &= mapped.floor == floor
        rows = np.flatnonzero(here)
        if len(rows) < 2:
            return None
        place, time_ns = mapped.position_bcs[rows, :2], mapped.time_ns[rows]
        way_m = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(place, axis=0).T))))
        apart_s = np.diff(time_ns, prepend=time_ns[0]) * 1e-9
        steps = way_m // EVERY_M, (time_ns - time_ns[0]) * 1e-9 // EVERY_S
        new = np.logical_or.reduce([np.diff(step, prepend=-1) > 0 for step in steps])
        new[-1] = True
        kept = np.flatnonzero(new)
        return cls(
            time_ns=time_ns[kept],
            position_bcs=place[kept],
            covariance_bcs=_own(mapped.covariance_bcs[rows[kept]], as_complex(place[kept]), landmarks),
            way_m=way_m[kept],
            whole=np.maximum.reduceat(apart_s, np.append(0, kept[:-1] + 1)) <= HOLE_S,
        )

    def knows(self, time_ns: IntArray) -> BoolArray:
        """At which moments (k,) it is known where the walk led."""
        after = np.searchsorted(self.time_ns, time_ns).clip(0, len(self.time_ns) - 1)
        within = (time_ns >= self.time_ns[0]) & (time_ns <= self.time_ns[-1])
        return np.asarray(within & self.whole[after])

    def along(self, time_ns: IntArray) -> FloatArray:
        """(k, 4) x, y, their sigma per axis and the way until then at moments (k,), metres; beyond its ends, these."""
        variance = np.trace(self.covariance_bcs, axis1=1, axis2=2) / 2
        columns = np.column_stack((self.position_bcs, np.sqrt(variance), self.way_m))
        known_s, at_s = (self.time_ns - self.time_ns[0]) * 1e-9, (time_ns - self.time_ns[0]) * 1e-9
        return np.column_stack([np.interp(at_s, known_s, column) for column in columns.T])


def _own(covariance: FloatArray, position: ComplexArray, landmarks: LandmarkPriors) -> FloatArray:
    """Covariances (n, 2, 2) of places (n,) without what landmarks share with them."""
    values, vectors = np.linalg.eigh(covariance - landmarks.shared_covariance(position))
    return np.asarray(np.einsum("nij,nj,nkj->nik", vectors, np.maximum(values, LEAST_M**2), vectors))


ROUNDED_M, ROUNDED_SIGMA_M = 0.01, 0.05
"""Places are rounded to this, and their covariance to the square of this; no direction is known better."""


def rounded(ties: PlaceTies) -> PlaceTies:
    """The same in numbers that change only where others tell something new."""
    return PlaceTies(
        ties.time_ns,
        ROUNDED_M * np.round(ties.position_bcs / ROUNDED_M),
        rounded_covariance(ties.covariance_m2, np.full(len(ties.covariance_m2), ROUNDED_SIGMA_M)),
    )


def rounded_covariance(covariance: FloatArray, unit: FloatArray) -> FloatArray:
    """Round a covariance (n, n) to squares and products of units (n,); positive definite again.

    Rounded entry by entry alone, what hardly varies in one direction could vary by less than nothing.
    """
    squared = np.outer(unit, unit)
    rounded = np.round(covariance / squared)
    values, vectors = np.linalg.eigh(rounded)
    if values.size and values[0] < 1:
        rounded = (vectors * np.maximum(values, 1.0)) @ vectors.T
        rounded = (rounded + rounded.T) / 2
    return np.asarray(squared * rounded)
