"""How late a session's poses are stamped, by its gyroscope."""

from __future__ import annotations

import polars as pl

from vislam2tag.core.pose_lag import estimate_pose_lag
from vislam2tag.sessions.model import Session

FASTEST_RAD_PER_S = 100.0
"""No gyroscope of a phone measures faster turns; greater values are faults."""


def pose_lag_of(session: Session) -> float | None:
    """Lag of the pose stamps in seconds (positive: stamped late); None where it cannot be estimated."""
    possible = pl.all_horizontal(pl.col("v1", "v2", "v3").abs() < FASTEST_RAD_PER_S)
    wanted = (pl.col("sensor") == "GYRO") & ~pl.col("repeated") & possible
    gyro = session.tables["sensors"].filter(wanted).sort("time_ns")
    usable = session.camera.usable
    lag_s = estimate_pose_lag(
        session.camera.time_ns[usable],
        session.camera.orientation_acs[usable],
        gyro["time_ns"].to_numpy(),
        gyro.select("v1", "v2", "v3").to_numpy(),
    )
    return None if lag_s is None else round(lag_s, 4)
