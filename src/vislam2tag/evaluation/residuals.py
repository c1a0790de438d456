"""Errors of labels as vectors, with the covariances that the labels state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.evaluation.truth import MAX_GAP_S, Truth

CONTROL_POINTS = "presses at control points"
"""What results call the truth of :func:`residuals_at_presses`."""


@dataclass(frozen=True)
class Residuals:
    """Label minus truth ``error_m`` (k, 2), NaN without a label; ``covariance_m2`` (k, 2, 2), NaN where not stated."""

    error_m: FloatArray
    covariance_m2: FloatArray


def residuals_at_truth(trajectory: Trajectory, truth: Truth) -> Residuals:
    """Compare the label at each true point's time with it, in the plane."""
    labels = label_by_interpolation(truth.time_ns, trajectory, MAX_GAP_S).position_bcs[:, :2]
    return Residuals(labels - truth.position_bcs, covariances_at(truth.time_ns, trajectory))


def residuals_at_presses(trajectory: Trajectory, presses_ns: IntArray, control_points: FloatArray) -> Residuals:
    """Compare the label at each press (k,) with the *nearest* control point (p, 2), p at least 1, as the paper does.

    The nearest point need not be the one pressed at: large errors come out too small where points stand close together.
    """
    labels = label_by_interpolation(presses_ns, trajectory, MAX_GAP_S).position_bcs[:, :2]
    return Residuals(labels - nearest_points(labels, control_points), covariances_at(presses_ns, trajectory))


def nearest_points(places: FloatArray, points: FloatArray) -> FloatArray:
    """Of the points (p, 2) the one (k, 2) nearest to each place (k, 2); the first one where the place is not known."""
    distance = np.nan_to_num(np.linalg.norm(places[:, None] - points, axis=2))
    return np.asarray(points[distance.argmin(axis=1)])


def covariances_at(time_ns: IntArray, trajectory: Trajectory) -> FloatArray:
    """Covariance (k, 2, 2), m^2, at each time (k,), linear between the usable frames; NaN where one of them has none.

    Beyond the frames that of the first or last one: there is no label there anyway.
    """
    usable = (trajectory.status != Status.DUPLICATE) & (trajectory.status != Status.INVALID)
    if not usable.any():
        return np.full((len(time_ns), 2, 2), np.nan)
    start = trajectory.time_ns[usable][0]
    at, frames = time_ns - start, trajectory.time_ns[usable] - start
    covariance = trajectory.covariance_bcs[usable]
    xx, xy, yy = (np.interp(at, frames, covariance[:, i, j]) for i, j in ((0, 0), (0, 1), (1, 1)))
    return np.stack((xx, xy, xy, yy), axis=-1).reshape(-1, 2, 2)
