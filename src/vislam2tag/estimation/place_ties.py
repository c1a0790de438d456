"""A walk smoothed again with what other walks say of where it was.

Such a moment is taken for a pass of a landmark that hangs at the camera, whose place is known as well as the others
tell. Like any surveyed place each may be wrong (Student's t). The others were mapped past the same landmarks: where
these are off, places between them are so, too, and agreeing with the others makes no walk surer of that.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.arrays import IntArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.core.similarity import as_complex
from vislam2tag.estimation.landmark_priors import LandmarkPriors, ToldPlaces, landmark_shares
from vislam2tag.estimation.observations import Passes, WalkObservations
from vislam2tag.estimation.smoothing import Smoothed, refined

AWAY_S = 0.5
"""A moment farther than this from every frame ties nothing."""


def smooth_with_ties(smoothed: Smoothed, time_ns: IntArray, ties: PlaceTies) -> Smoothed:
    """Solve a walk again, about its path by landmarks alone, with the places that others tell.

    ``time_ns`` (n,) are the times of the odometry's frames.
    """
    at, rows = _frames(time_ns, ties.time_ns)
    if not len(rows):
        return smoothed
    observations = _with_passes(smoothed.model.observations, at)
    priors = _with_places(smoothed.priors, ties, rows)
    return refined(replace(smoothed.model, observations=observations), priors, smoothed.weights.told)


def _frames(time_ns: IntArray, moments_ns: IntArray) -> tuple[IntArray, IntArray]:
    """Frames (k,) nearest to those of the moments (m,) that have one nearby, and which moments (k,) these are."""
    after = np.searchsorted(time_ns, moments_ns).clip(1, len(time_ns) - 1)
    nearer = moments_ns - time_ns[after - 1] < time_ns[after] - moments_ns
    at = (after - nearer).astype(np.int64)
    rows = np.flatnonzero(np.abs(time_ns[at] - moments_ns) < AWAY_S * 1e9)
    return at[rows], rows


def _with_passes(observations: WalkObservations, at: IntArray) -> WalkObservations:
    """Observations with a pass at each of some frames (k,) of a landmark of its own, at the camera."""
    passes, count = observations.passes, len(at)
    zeros = np.zeros(count)
    nowhere = np.zeros(count, dtype=np.complex128)
    order = np.argsort(np.concatenate((passes.at, at)), kind="stable")
    own = len(observations.ids) + np.arange(count)
    merged = Passes(
        at=np.concatenate((passes.at, at))[order],
        landmark=np.concatenate((passes.landmark, own))[order],
        offset=np.concatenate((passes.offset, nowhere))[order],
        heading=np.concatenate((passes.heading, nowhere))[order],
        distance_m=np.concatenate((passes.distance_m, zeros))[order],
        spread_m=np.concatenate((passes.spread_m, zeros))[order],
        count=np.concatenate((passes.count, np.ones(count, dtype=np.int64)))[order],
    )
    return replace(observations, ids=(*observations.ids, *("" for _ in at)), passes=merged)


def _with_places(priors: LandmarkPriors, ties: PlaceTies, rows: IntArray) -> LandmarkPriors:
    """Priors with a place for each of some ties (k,), after the landmarks."""
    column = (2 * rows[:, None] + (0, 1)).ravel()
    position, unknown = as_complex(ties.position_bcs[rows]), np.full(len(rows), np.nan)
    told = ToldPlaces(landmark_shares(priors, position), ties.covariance_m2[np.ix_(column, column)])
    each = np.arange(2 * len(rows)).reshape(-1, 2)
    return LandmarkPriors(
        position=np.concatenate((priors.position, position)),
        covariance=np.concatenate((priors.covariance, told.own[each[:, :, None], each[:, None, :]])),
        heading_rad=np.concatenate((priors.heading_rad, unknown)),
        heading_sigma_rad=np.concatenate((priors.heading_sigma_rad, unknown)),
        joint=priors.joint,
        told=told,
    )
