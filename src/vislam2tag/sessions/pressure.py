"""The air pressure of a session, out of its sensor readings."""

from __future__ import annotations

import polars as pl

from vislam2tag.core.storeys import PressureLog

PRESSURE = "PRESSURE"
"""Sensor type of the barometer; ``v1`` is in hPa."""
PLAUSIBLE_HPA = (500.0, 1200.0)
"""What the air around somebody walking may press with; other numbers are faults."""


def pressure_log(sensors: pl.DataFrame) -> PressureLog | None:
    """Take the barometer's readings out of a ``sensors`` table, in time order; None where there are not two."""
    sound = (pl.col("sensor") == PRESSURE) & ~pl.col("repeated") & pl.col("v1").is_between(*PLAUSIBLE_HPA)
    rows = sensors.filter(sound).unique("time_ns").sort("time_ns")
    return PressureLog(rows["time_ns"].to_numpy(), rows["v1"].to_numpy()) if len(rows) > 1 else None
