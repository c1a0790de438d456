"""A mapped walk, thinned to what others are told of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.similarity import as_complex
from vislam2tag.core.tracks import Trajectory
from vislam2tag.smoother.landmark_priors import LandmarkPriors

EVERY_M = 1.0
"""Others are told of a place once in so much of the way."""
LEAST_M = 0.05
"""No walk knows the way between landmarks better than this."""


@dataclass(frozen=True)
class WalkTrace:
    """Where a walk led, at ``n`` moments about a metre of way apart.

    ``time_ns`` (n,) boot clock, in time order; ``position_bcs`` (n, 2) metres; ``covariance_bcs`` (n, 2, 2), m^2, of
    the walk's own errors: what it shares with the others, as the landmarks are off that all pass, is not in it;
    ``course_rad`` (n,) of the way from the BCS x axis; ``way_m`` (n,) walked until then, metres.
    """

    time_ns: IntArray
    position_bcs: FloatArray
    covariance_bcs: FloatArray
    course_rad: FloatArray
    way_m: FloatArray

    @classmethod
    def of(cls, mapped: Trajectory, floor: int, landmarks: LandmarkPriors) -> Self | None:
        """Thin the frames on a floor of a walk mapped past ``landmarks``; None where it led nowhere there."""
        here = np.isfinite(mapped.sigma_m)
        if len(mapped.floor):
            here &= mapped.floor == floor
        rows = np.flatnonzero(here)
        place = mapped.position_bcs[rows, :2]
        way_m = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(place, axis=0).T))))[: len(rows)]
        kept = np.flatnonzero(np.diff(np.floor(way_m / EVERY_M), prepend=-1.0) > 0)
        if len(kept) < 2:
            return None
        ahead = np.gradient(place[kept], axis=0)
        return cls(
            time_ns=mapped.time_ns[rows[kept]],
            position_bcs=place[kept],
            covariance_bcs=_own(mapped.covariance_bcs[rows[kept]], as_complex(place[kept]), landmarks),
            course_rad=np.arctan2(ahead[:, 1], ahead[:, 0]),
            way_m=way_m[kept],
        )


def _own(covariance: FloatArray, position: ComplexArray, landmarks: LandmarkPriors) -> FloatArray:
    """Covariances (n, 2, 2) of places (n,) without what landmarks share with them."""
    values, vectors = np.linalg.eigh(covariance - landmarks.shared_covariance(position))
    return np.asarray(np.einsum("nij,nj,nkj->nik", vectors, np.maximum(values, LEAST_M**2), vectors))
