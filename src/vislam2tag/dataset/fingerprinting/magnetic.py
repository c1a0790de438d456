"""Magnetic fingerprints: the field over short windows, by strength and by its vertical and horizontal part.

Strength and parts do not depend on how the phone is turned: gravity alone says what is vertical.
"""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.dataset.fingerprinting.radio_tables import mean_position
from vislam2tag.dataset.inertial.gravity_frame import LevelOrientation, filtered_orientation, logged_orientation
from vislam2tag.dataset.inertial.sensor_series import in_time_order, sensor_series
from vislam2tag.dataset.schema import MAGNETIC, in_schema

LONGEST_GAP_NS = 200_000_000
"""A reading farther than this from any of the orientation has no vertical and horizontal part."""
_ROTATIONS = ("GAME_ROT", "ROT")


def magnetic_windows(sensors: pl.DataFrame, session: str, building: str, window_s: float) -> pl.DataFrame:
    """Average a session's magnetic readings (``MAG``, else ``MAG_UN`` less its own estimate of the phone's field).

    ``sensors`` is the labelled table as ``process`` wrote it. Windows are of the clock, counted from the one that holds
    the first reading; those without a labelled reading have no position. ``norm_deviation_ut`` is the standard
    deviation of the strength within the window; ``vertical_ut`` counts upwards. Both parts are null where nothing tells
    the phone's tilt.
    """
    rows = _readings(sensors)
    vertical = _vertical(sensors, rows["time_ns"].to_numpy(), rows.select("fx", "fy", "fz").to_numpy(writable=True))
    norm = (pl.col("fx") ** 2 + pl.col("fy") ** 2 + pl.col("fz") ** 2).sqrt()
    window = pl.col("time_ns") // round(window_s * 1e9)
    measured = rows.with_columns(
        pl.Series("vertical", vertical, nan_to_null=True), norm=norm, number=window - window.min()
    ).with_columns(horizontal=(pl.col("norm") ** 2 - pl.col("vertical") ** 2).clip(lower_bound=0.0).sqrt())
    table = measured.group_by("number", maintain_order=True).agg(
        **mean_position(pl.col("x").is_not_null()),
        readings=pl.len(),
        norm_ut=pl.col("norm").mean(),
        norm_deviation_ut=pl.col("norm").std(ddof=0),
        vertical_ut=pl.col("vertical").mean(),
        horizontal_ut=pl.col("horizontal").mean(),
        device=pl.col("device").first(),
        start_ns=pl.col("time_ns").min(),
        end_ns=pl.col("time_ns").max(),
    )
    name = pl.concat_str(pl.lit(f"{session}/magnetic/"), pl.col("number").cast(pl.String).str.zfill(6))
    return in_schema(
        MAGNETIC,
        table.with_columns(window_id=name, building=pl.lit(building), session=pl.lit(session)).drop("number"),
    )


def _readings(sensors: pl.DataFrame) -> pl.DataFrame:
    """Pick the magnetometer's readings in order, each once; ``fx``, ``fy``, ``fz``: the field in the phone."""
    columns = ("time_ns", "status", "floor", "device", "x", "y", "z", "sigma")
    rows = sensors.filter(pl.col("sensor") == "MAG").select(*columns, fx="v1", fy="v2", fz="v3")
    if not len(rows):
        rows = sensors.filter(pl.col("sensor") == "MAG_UN").select(
            *columns, fx=pl.col("v1") - pl.col("v4"), fy=pl.col("v2") - pl.col("v5"), fz=pl.col("v3") - pl.col("v6")
        )
    finite = pl.all_horizontal(pl.col("fx", "fy", "fz").is_finite())
    return in_time_order(rows.filter(finite, pl.col("status") != "duplicate"))


def _vertical(sensors: pl.DataFrame, time_ns: IntArray, field: FloatArray) -> FloatArray:
    """Vertical part (n,) of a field (n, 3) in the phone's axes; NaN where its tilt is not known."""
    found = _tilt(sensors)
    if found is None or not len(time_ns):
        return np.full(len(time_ns), np.nan)
    level, known_ns = found
    after = np.searchsorted(known_ns, time_ns)
    near = np.minimum(
        np.abs(known_ns[np.minimum(after, len(known_ns) - 1)] - time_ns),
        np.abs(known_ns[np.maximum(after - 1, 0)] - time_ns),
    )
    vertical: FloatArray = np.where(near <= LONGEST_GAP_NS, level.at(time_ns).apply(field)[:, 2], np.nan)
    return vertical


def _tilt(sensors: pl.DataFrame) -> tuple[LevelOrientation, IntArray] | None:
    """Find the phone's level orientation, and the times (n,) of its readings; None where no sensor tells it."""
    for name in _ROTATIONS:
        rotation = sensor_series(sensors, name, ("v1", "v2", "v3", "v4"))
        if len(rotation) > 1:
            return logged_orientation(rotation), rotation.time_ns
    accelerometer, gyroscope = (sensor_series(sensors, name, ("v1", "v2", "v3")) for name in ("ACC", "GYRO"))
    if len(accelerometer) > 1 and len(gyroscope) > 1:
        return filtered_orientation(accelerometer, gyroscope), gyroscope.time_ns
    return None
