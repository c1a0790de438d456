"""A table's motion and levels against those of a labelled walk: what aligns their clocks."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.clock_alignment import ClockAlignment, align_by_motion
from vislam2tag.core.clock_by_levels import Heard, align_by_levels
from vislam2tag.datasets.labelled import LabelledSession
from vislam2tag.intake.readings import level_findings, with_addresses
from vislam2tag.sessions.clocks import LEVELS, MOTION, heard_in
from vislam2tag.sessions.foreign_tables import MOTION_COLUMNS, TableTimes, level_columns, numbers, three_axes

_NAMES = {"GYRO": "the turns that both felt", "ACC": "the acceleration that both felt"}
Aligner = Callable[[LabelledSession], ClockAlignment]


def table_aligners(rows: pl.DataFrame, times: TableTimes, wanted: str | None) -> dict[str, Aligner]:
    """What can align a table with a walk, by what it does it, the most exact first; ``wanted``: only by that.

    Raises UsageError where a table has no columns for what is wanted, or that is not known.
    """
    if wanted not in (None, MOTION, LEVELS):
        raise UsageError(f"--align {wanted}: there are {MOTION}, {LEVELS}")
    found: dict[str, Aligner] = {}
    for sensor in MOTION_COLUMNS if wanted != LEVELS else ():
        axes = three_axes(rows.columns, sensor)
        if axes:
            norm = np.linalg.norm(rows.select(numbers(name) for name in axes).to_numpy(), axis=1)
            found[_NAMES[sensor]] = partial(_by_motion, times.time_ns[times.usable], norm[times.usable], sensor)
    heard = _heard(rows, times) if wanted != MOTION else {}
    if heard:
        found["access points that both heard"] = lambda session: align_by_levels(heard, _wifi_of(session))
    if wanted is not None and not found:
        needed = (
            "columns such as gyro_x, gyro_y, gyro_z or acc_x, acc_y, acc_z"
            if wanted == MOTION
            else ("a column bssid and one of levels, such as rssi")
        )
        raise UsageError(f"--align {wanted}: the table lacks {needed}; there are: {', '.join(rows.columns)}")
    return found


def _by_motion(their_ns: IntArray, theirs: FloatArray, sensor: str, session: LabelledSession) -> ClockAlignment:
    own = session.table("sensors", ("time_ns", "sensor", "v1", "v2", "v3"), pl.col("sensor") == sensor)
    norm = np.linalg.norm(own.select("v1", "v2", "v3").to_numpy(), axis=1)
    return align_by_motion(their_ns, theirs, own["time_ns"].to_numpy(), norm)


def _heard(rows: pl.DataFrame, times: TableTimes) -> Heard:
    """Times and levels of each access point in a table; empty where it has no such columns."""
    columns = level_columns(rows.columns)
    if columns is None:
        return {}
    bssid, level = columns
    wifi = rows.select(
        pl.Series("time_ns", times.time_ns),
        pl.col(bssid).cast(pl.String).alias("bssid"),
        numbers(level).alias("rssi_dbm"),
    )
    return heard_in(wifi.filter(pl.Series(times.usable)))


def level_notes(rows: pl.DataFrame) -> list[str]:
    """What is odd about a table's addresses and levels, a sentence each; its rows keep them."""
    columns = level_columns(rows.columns)
    if columns is None:
        return []
    bssid, level = columns
    wifi = rows.select(
        pl.int_range(2, pl.len() + 2, dtype=pl.Int64).alias("row"),
        pl.col(bssid).cast(pl.String).alias("bssid"),
        numbers(level).alias("rssi_dbm"),
    )
    named, masked = with_addresses(wifi, "bssid", "")
    done = "these readings align no clock"
    odd = [*masked, *level_findings(named, "", done)]
    return [f"{each.kind} {each.count} (lines {', '.join(map(str, each.lines))}): {each.message}" for each in odd]


def _wifi_of(session: LabelledSession) -> Heard:
    return heard_in(session.table("wifi", ("bssid", "time_ns", "rssi_dbm")))
