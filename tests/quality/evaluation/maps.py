"""Hand-made trajectories for the evaluation's tests."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.quality.evaluation.truth import PointErrors, TruthKind
from vislam2tag.site.model import ControlPoints, Floor


def straight_walk(frames: int = 101, start_ns: int = 1_000_000_000, shift: tuple[float, float] = (0, 0)) -> Trajectory:
    """One metre a second along x from (0, 0), ten frames a second."""
    time_ns = start_ns + np.arange(frames, dtype=np.int64) * 100_000_000
    x = np.arange(frames) / 10 + shift[0]
    return trajectory_of(time_ns, np.column_stack((x, np.full(frames, float(shift[1])))))


def trajectory_of(time_ns: IntArray, plane: FloatArray) -> Trajectory:
    unknown = np.full(len(plane), np.nan)
    return Trajectory(
        time_ns=time_ns,
        position_bcs=np.column_stack((plane, unknown)),
        orientation_bcs=np.full((len(plane), 4), np.nan),
        covariance_bcs=np.full((len(plane), 2, 2), np.nan),
        status=np.zeros(len(plane), dtype=np.int8),
    )


def without(trajectory: Trajectory, span: slice, cause: Status) -> Trajectory:
    """Discard a stretch."""
    status, position = trajectory.status.copy(), trajectory.position_bcs.copy()
    status[span], position[span] = cause, np.nan
    return replace(trajectory, position_bcs=position, status=status)


def floor_with(points: FloatArray, number: int = 1) -> Floor:
    """A floor with these control points (p, 2)."""
    ids = tuple(str(i) for i in range(len(points)))
    return Floor(number, "", None, None, None, None, ControlPoints(ids, points))


def errors_at_origin(
    label: FloatArray, sigma_m: FloatArray | float = 0.0, heading_rad: FloatArray | float = 0.0, truth_m: float = 0.0
) -> PointErrors:
    """Labels (n, 2) of true points that all lie at the origin, a second apart."""
    count = len(label)
    columns = [np.broadcast_to(np.asarray(value, dtype=np.float64), count) for value in (sigma_m, heading_rad, truth_m)]
    time_ns = np.arange(count) * 1_000_000_000
    return PointErrors(TruthKind.CONTROL_POINTS, time_ns, np.zeros((count, 2)), label, *columns)
