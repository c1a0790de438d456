"""Methods to align the clock of a table with a walk: by motion, or by levels of access points."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.clocks import ClockAlignment, Heard, align_by_levels, align_by_motion
from vislam2tag.datasets.labelled import LabelledSession
from vislam2tag.intake.readings import level_findings, with_addresses, with_columns_in_place
from vislam2tag.intake.time_units import ROUNDED, shared_times
from vislam2tag.sessions.clocks import LEVELS, MOTION, heard_in
from vislam2tag.sessions.foreign_tables import (
    MOTION_COLUMNS,
    TableTimes,
    readings_in,
    sensor_columns,
)

MEASURED = {"GYRO": "turn rates", "ACC": "accelerations"}
"""Words for what a sensor of motion measures."""
Aligner = Callable[[LabelledSession], ClockAlignment]


def table_aligners(rows: pl.DataFrame, times: TableTimes, wanted: str | None) -> dict[str, Aligner]:
    """Methods to align a table with a walk by name, the most exact first; ``wanted``: only this one.

    Readings in ``rows`` are numbers. Raises UsageError if the wanted method is unknown, the table has no columns for
    it, or times are rounded.
    """
    if wanted not in (None, MOTION, LEVELS):
        raise UsageError(f"--by {wanted}: unknown method; choose one of {MOTION}, {LEVELS}")
    found: dict[str, Aligner] = {}
    for sensor, (their_ns, norm) in motion_in(rows, times).items() if wanted != LEVELS else ():
        if shared_times(their_ns[np.isfinite(norm)]):
            raise UsageError(f"most readings share their time with others, so times are rounded; {ROUNDED}")
        found[f"common {MEASURED[sensor]}"] = partial(_by_motion, their_ns, norm, sensor)
    heard = _heard(rows, times) if wanted != MOTION else {}
    if heard:
        found["common access points"] = partial(_by_levels, heard)
    if wanted is not None and not found:
        needed = (
            "columns such as gyro_x, gyro_y, gyro_z or acc_x, acc_y, acc_z"
            if wanted == MOTION
            else ("a column bssid and one of levels, such as rssi")
        )
        missing = f"--by {wanted}: the table needs {needed}; it has: {', '.join(rows.columns)}"
        raise UsageError(with_findings(missing, rows))
    return found


def motion_in(rows: pl.DataFrame, times: TableTimes) -> dict[str, tuple[IntArray, FloatArray]]:
    """Times (k,), ns, and norms (k,) of the sensors of motion that a table has."""
    axes = {sensor: sensor_columns(rows.columns, sensor)[0] for sensor in MOTION_COLUMNS}
    norms = {sensor: np.linalg.norm(rows.select(names).to_numpy(), axis=1) for sensor, names in axes.items() if names}
    return {sensor: (times.time_ns[times.usable], norm[times.usable]) for sensor, norm in norms.items()}


def motion_of(session: LabelledSession, sensor: str) -> tuple[IntArray, FloatArray]:
    """Times (k,), ns, and norms (k,) of a sensor of motion in a labelled walk."""
    own = session.table("sensors", ("time_ns", "sensor", "v1", "v2", "v3"), pl.col("sensor") == sensor)
    return own["time_ns"].to_numpy(), np.linalg.norm(own.select("v1", "v2", "v3").to_numpy(), axis=1)


def _by_motion(their_ns: IntArray, theirs: FloatArray, sensor: str, session: LabelledSession) -> ClockAlignment:
    return align_by_motion(their_ns, theirs, *motion_of(session, sensor))


def _heard(rows: pl.DataFrame, times: TableTimes) -> Heard:
    """Times and levels of each access point in a table; empty if it has no such columns."""
    wifi = readings_in(rows)
    if wifi is None:
        return {}
    in_place, _ = with_columns_in_place(wifi, "")
    return heard_in(in_place.with_columns(pl.Series("time_ns", times.time_ns)).filter(pl.Series(times.usable)))


def level_findings_of(rows: pl.DataFrame) -> list[Finding]:
    """Findings about a table's addresses and levels; the rows (with ``row``, the line) keep them."""
    wifi = readings_in(rows)
    if wifi is None:
        return []
    in_place, exchanged = with_columns_in_place(wifi.with_columns(rows["row"]), "")
    named, masked = with_addresses(in_place, "bssid", "")
    done = "these readings are not used to align clocks"
    return [*exchanged, *masked, *level_findings(named, "", done)]


def sentence_of(finding: Finding) -> str:
    """A finding with its kind, number and lines, for people."""
    lines = f" (lines {', '.join(map(str, finding.lines))})" if finding.lines else ""
    return f"{finding.kind} {finding.count}{lines}: {finding.message}"


def with_findings(problem: str, rows: pl.DataFrame) -> str:
    """A problem, and the findings about addresses and levels that may be its cause."""
    return ". ".join([problem, *(sentence_of(one).rstrip(".") for one in level_findings_of(rows))])


def _by_levels(heard: Heard, session: LabelledSession) -> ClockAlignment:
    return align_by_levels(heard, heard_in(session.table("wifi", ("bssid", "time_ns", "rssi_dbm"))))
