"""Inertial and magnetic readings: ``t; TYPE; v1; v2; v3; v4; v5; v6``."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import polars as pl

from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.context import PressureLog
from vislam2tag.core.limits import of_one_recording
from vislam2tag.sessions.tables.camera import FAR_TIMES

SENSOR_VALUES = tuple(f"v{i}" for i in range(1, 7))
SENSOR_SCHEMA = {"time_ns": pl.Int64, "sensor": pl.String, **dict.fromkeys(SENSOR_VALUES, pl.Float64)}


def sensor_table(rows: pl.DataFrame, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Make the ``sensors`` table of the parsed rows of a sensor file: ``row`` first, ``repeated`` added.

    A row is ``repeated`` where an earlier one has the same sensor and time. All rows are kept as they are.
    """
    time_ns = rows["time_ns"].to_numpy()
    repeated = np.zeros(len(time_ns), dtype=bool)
    backward = np.zeros(len(time_ns), dtype=bool)
    in_order = bool(np.all(np.diff(time_ns) > 0))
    for index in [] if in_order else _rows_by_sensor(rows["sensor"]):
        repeated[index], backward[index] = _irregular(time_ns[index])
    table = rows.select("row", "time_ns", pl.Series("repeated", repeated), "sensor", *SENSOR_VALUES)
    infinite = ~rows.select(pl.all_horizontal(pl.col(SENSOR_VALUES).is_finite())).to_series().to_numpy()
    findings = []
    far = ~of_one_recording(time_ns)
    odd: tuple[tuple[FindingKind, BoolArray, str, Severity], ...] = (
        ("far_times", far, FAR_TIMES, Severity.WARNING),
        (
            "repeated_rows",
            repeated,
            "readings have the sensor and time of an earlier one; the first counts",
            Severity.INFO,
        ),
        (
            "backward_times",
            backward,
            "readings are earlier than one before them of the same sensor; kept",
            Severity.WARNING,
        ),
        ("non_finite_values", infinite, "values are not finite; kept as they are", Severity.WARNING),
    )
    for kind, mask, message, severity in odd:
        if mask.any():
            lines = rows["row"].to_numpy()[mask].tolist()
            findings.append(Finding.at_lines(kind, file, lines, message, severity))
    return table, findings


def _rows_by_sensor(sensor: pl.Series) -> list[IntArray]:
    """Row indices (k,) of each sensor, in file order."""
    names = sensor.unique().to_list()
    code = sensor.cast(pl.Enum(names)).to_physical().to_numpy()
    order = np.argsort(code, kind="stable")
    starts = np.searchsorted(code[order], np.arange(len(names) + 1))
    return [order[start:stop] for start, stop in itertools.pairwise(starts.tolist())]


def _irregular(time_ns: IntArray) -> tuple[BoolArray, BoolArray]:
    """Masks (k,) of one sensor's readings at times (k,), ns, that were there before, and of those that go back."""
    n = len(time_ns)
    repeated = np.zeros(n, dtype=bool)
    step = np.diff(time_ns)
    if np.all(step > 0):
        return repeated, repeated
    backward = np.zeros(n, dtype=bool)
    backward[1:] = time_ns[1:] < np.maximum.accumulate(time_ns)[:-1]
    repeated[:] = True
    repeated[np.unique(time_ns, return_index=True)[1]] = False
    return repeated, backward & ~repeated


def readings_of(sensors: pl.DataFrame, sensor: str, values: Sequence[str]) -> tuple[IntArray, FloatArray]:
    """Times (k,), increasing strictly, ns, and values (k, v) of a sensor's readings in a ``sensors`` table.

    Repeated readings are left out, and those whose times cannot be of one recording.
    """
    rows = np.flatnonzero(((sensors["sensor"] == sensor) & ~sensors["repeated"]).to_numpy())
    all_ns = sensors["time_ns"].to_numpy()
    rows = rows[of_one_recording(all_ns[rows])]
    if np.any(np.diff(all_ns[rows]) < 0):
        rows = rows[np.argsort(all_ns[rows], kind="stable")]
    return all_ns[rows], np.column_stack([sensors[name].to_numpy()[rows] for name in values])


PRESSURE = "PRESSURE"
"""Sensor type of the barometer; ``v1`` is in hPa."""
PLAUSIBLE_HPA = (500.0, 1200.0)
"""What the air around somebody walking may press with; other numbers are faults."""


def pressure_log(sensors: pl.DataFrame) -> PressureLog | None:
    """Take the barometer's readings out of a ``sensors`` table, in time order; None where there are not two."""
    time_ns, values = readings_of(sensors, PRESSURE, ("v1",))
    sound = (values[:, 0] >= PLAUSIBLE_HPA[0]) & (values[:, 0] <= PLAUSIBLE_HPA[1])
    return PressureLog(time_ns[sound], values[sound, 0]) if sound.sum() > 1 else None
