"""A mapped walk, thinned for use by other walks, and the rounded constraints that it gets from them."""

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
"""Intervals of the trace, in distance walked and in time while the walker stands."""
HOLE_S = 1.0
"""In longer gaps between frames the path is unknown."""
LEAST_M = 0.05
"""Smallest standard deviation of a path between landmarks."""


@dataclass(frozen=True)
class WalkTrace:
    """Path of a walk on a floor, at ``n`` moments about a metre apart.

    ``time_ns`` (n,) boot clock, in time order; ``position_bcs`` (n, 2) metres. ``covariance_bcs`` (n, 2, 2), m^2, is
    that of the walk's own errors, without common errors such as those of landmarks. ``way_m`` (n,) is the distance
    walked until then, metres; ``whole`` (n,) is whether the path since the previous moment is known.
    """

    time_ns: IntArray
    position_bcs: FloatArray
    covariance_bcs: FloatArray
    way_m: FloatArray
    whole: BoolArray

    @classmethod
    def of(cls, mapped: Trajectory, floor: int, landmarks: LandmarkPriors) -> Self | None:
        """Thin the frames on a floor of a walk mapped with ``landmarks``; None if it has none there."""
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
        """Return at which moments (k,) the path is known."""
        after = np.searchsorted(self.time_ns, time_ns).clip(0, len(self.time_ns) - 1)
        within = (time_ns >= self.time_ns[0]) & (time_ns <= self.time_ns[-1])
        return np.asarray(within & self.whole[after])

    def along(self, time_ns: IntArray) -> FloatArray:
        """(k, 4) x, y, their sigma per axis and the distance walked at moments (k,), metres; constant beyond its
        ends."""
        variance = np.trace(self.covariance_bcs, axis1=1, axis2=2) / 2
        columns = np.column_stack((self.position_bcs, np.sqrt(variance), self.way_m))
        known_s, at_s = (self.time_ns - self.time_ns[0]) * 1e-9, (time_ns - self.time_ns[0]) * 1e-9
        return np.column_stack([np.interp(at_s, known_s, column) for column in columns.T])


def _own(covariance: FloatArray, position: ComplexArray, landmarks: LandmarkPriors) -> FloatArray:
    """Covariances (n, 2, 2) of places (n,) without the part that comes from landmarks."""
    values, vectors = np.linalg.eigh(covariance - landmarks.shared_covariance(position))
    return np.asarray(np.einsum("nij,nj,nkj->nik", vectors, np.maximum(values, LEAST_M**2), vectors))


ROUNDED_M, ROUNDED_SIGMA_M = 0.01, 0.05
"""Places are rounded to this, and their covariance to the square of this; smaller sigmas are raised to it."""


def rounded(ties: PlaceTies) -> PlaceTies:
    """Return the constraints in rounded numbers, which change only with new information from other walks."""
    return PlaceTies(
        ties.time_ns,
        ROUNDED_M * np.round(ties.position_bcs / ROUNDED_M),
        rounded_covariance(ties.covariance_m2, np.full(len(ties.covariance_m2), ROUNDED_SIGMA_M)),
    )


def rounded_covariance(covariance: FloatArray, unit: FloatArray) -> FloatArray:
    """Round a covariance (n, n) to squares and products of units (n,); positive definite again.

    Rounding each entry alone could make a small variance negative.
    """
    squared = np.outer(unit, unit)
    rounded = np.round(covariance / squared)
    values, vectors = np.linalg.eigh(rounded)
    if values.size and values[0] < 1:
        rounded = (vectors * np.maximum(values, 1.0)) @ vectors.T
        rounded = (rounded + rounded.T) / 2
    return np.asarray(squared * rounded)
