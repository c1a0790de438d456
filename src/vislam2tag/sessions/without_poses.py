"""Sessions that no tracker took part in: their inertial readings, and frames that stand for their moments."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import FixLog, InertialLog
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.sessions.tables.sensor_table import pressure_log

FRAME_NS = 200_000_000
"""Frames without poses are this far apart: a walk is straight for so long."""
FEWEST_READINGS = 20


def inertial_log(sensors: pl.DataFrame) -> InertialLog | None:
    """Take the inertial readings out of a ``sensors`` table; None where accelerometer or gyroscope lacks."""
    force_ns, force = _readings(sensors, "ACC")
    rate_ns, rate = _readings(sensors, "GYRO")
    if min(len(force_ns), len(rate_ns)) < FEWEST_READINGS:
        return None
    orientation_ns, vector = _readings(sensors, "ROT")
    # A rotation vector is a unit quaternion whose fourth part need not be written, nor is it by the competition's app.
    real = np.sqrt(np.clip(1 - np.einsum("ni,ni->n", vector, vector), 0, 1))
    return InertialLog(force_ns, force, rate_ns, rate, orientation_ns, np.column_stack((vector, real)))


def track_without_poses(inertial: InertialLog, sensors: pl.DataFrame, fixes: FixLog | None) -> CameraTrack:
    """Make frames, five a second, none of which has a pose, over the time of the inertial readings."""
    first = max(int(inertial.force_ns[0]), int(inertial.rate_ns[0]))
    last = min(int(inertial.force_ns[-1]), int(inertial.rate_ns[-1]))
    time_ns = np.unique(np.append(np.arange(first, last, FRAME_NS), max(first, last)))
    n = len(time_ns)
    return CameraTrack(
        time_ns,
        np.full((n, 3), np.nan),
        np.tile((0.0, 0.0, 0.0, 1.0), (n, 1)),
        np.full(n, Status.OK, dtype=np.int8),
        pressure=pressure_log(sensors),
        inertial=inertial,
        fixes=fixes,
    )


def no_landmarks() -> LandmarkLog:
    """A log in which no landmark was ever seen."""
    none, empty = np.empty(0, dtype=np.int64), np.empty((0, 3))
    return LandmarkLog((), none, none, empty, np.empty((0, 4)), np.empty(0, dtype=bool))


def _readings(sensors: pl.DataFrame, sensor: str) -> tuple[IntArray, FloatArray]:
    """Times (k,), increasing strictly, and the first three values (k, 3) of a sensor's sound readings."""
    values = ("v1", "v2", "v3")
    sound = pl.all_horizontal(pl.col(values).is_finite()) & (pl.col("sensor") == sensor) & ~pl.col("repeated")
    rows = sensors.filter(sound).unique("time_ns", keep="first").sort("time_ns")
    return rows["time_ns"].to_numpy(), rows.select(values).to_numpy()
