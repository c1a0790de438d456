"""How late a session's poses are stamped, by its gyroscope."""

from __future__ import annotations

import polars as pl

from vislam2tag.core.pose_lag import estimate_pose_lag
from vislam2tag.core.tracks import CameraTrack

FASTEST_RAD_PER_S = 100.0
"""No gyroscope of a phone measures faster turns; greater values are faults."""


def pose_lag_of(camera: CameraTrack, sensors: pl.DataFrame) -> float | None:
    """Lag of the pose stamps in seconds (positive: stamped late), by a ``sensors`` table; None where nothing tells.

    It is 0 where the stamps are known to be those of the exposure.
    """
    if camera.exposure_known:
        return 0.0
    possible = pl.all_horizontal(pl.col("v1", "v2", "v3").abs() < FASTEST_RAD_PER_S)
    wanted = (pl.col("sensor") == "GYRO") & ~pl.col("repeated") & possible
    gyro = sensors.filter(wanted).sort("time_ns")
    usable = camera.usable
    lag_s = estimate_pose_lag(
        camera.time_ns[usable],
        camera.orientation_acs[usable],
        gyro["time_ns"].to_numpy(),
        gyro.select("v1", "v2", "v3").to_numpy(),
    )
    return None if lag_s is None else round(lag_s, 4)
