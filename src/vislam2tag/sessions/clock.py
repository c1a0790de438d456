"""All files of a session should run on one clock: tables that never meet the frames are found here."""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.pose_lag import estimate_pose_lag
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.sessions.tables.sensor_table import readings_of


def clock_mismatch(times_ns: IntArray, file: str, camera: CameraTrack) -> list[Finding]:
    """Report a table whose times (any order, nanoseconds) do not overlap those of the usable frames at all."""
    frames_ns = camera.time_ns[camera.usable]
    if len(times_ns) == 0 or len(frames_ns) == 0:
        return []
    first, last = int(times_ns.min()), int(times_ns.max())
    before_s = (int(frames_ns[0]) - last) / 1e9
    after_s = (first - int(frames_ns[-1])) / 1e9
    if before_s <= 0 and after_s <= 0:
        return []
    where = f"end {before_s:.3f} s before the first" if before_s > 0 else f"begin {after_s:.3f} s after the last"
    message = (
        f"the times {where} camera frame: another clock; nothing of this file can be labelled unless "
        "corrections.toml shifts it ([[shift_clock]])"
    )
    return [Finding(kind="clock_mismatch", file=file, count=len(times_ns), message=message)]


FASTEST_RAD_PER_S = 100.0
"""No gyroscope of a phone measures faster turns; greater values are faults."""


def pose_lag_of(camera: CameraTrack, sensors: pl.DataFrame) -> float | None:
    """Lag of the pose stamps in seconds (positive: stamped late), by a ``sensors`` table; None where nothing tells.

    It is 0 where the stamps are known to be those of the exposure.
    """
    if camera.exposure_known:
        return 0.0
    time_ns, turning = readings_of(sensors, "GYRO", ("v1", "v2", "v3"))
    possible = (np.abs(turning) < FASTEST_RAD_PER_S).all(axis=1)
    usable = camera.usable
    lag_s = estimate_pose_lag(
        camera.time_ns[usable],
        camera.orientation_acs[usable],
        time_ns[possible],
        turning[possible],
    )
    return None if lag_s is None else round(lag_s, 4)
