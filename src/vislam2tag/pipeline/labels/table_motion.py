"""A table's motion and levels against those of a labelled walk: what aligns their clocks."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.clock_alignment import ClockAlignment, align_by_motion
from vislam2tag.core.clock_by_levels import Heard, align_by_levels
from vislam2tag.dataset.fingerprinting.labelled import LabelledSession
from vislam2tag.labeling.clocks import TableTimes

MOTION, LEVELS = "motion", "levels"
_AXIS = r"[ _.]?(?:\([^)]*\)|\[[^]]*\])?[ _.]?([xyz])(?:[ _.]?[\[(].*[\])])?"
_SENSORS = {
    "GYRO": re.compile(r"(?:gyro(?:scope)?|gyr|rotation_?rate|angular_?velocity|omega|w)" + _AXIS),
    "ACC": re.compile(r"(?:acc|accel|acceleration|accelerometer|a)" + _AXIS),
}
"""Columns of three axes, by what the labels' own sensor table calls them."""
_NAMES = {"GYRO": "the turns that both felt", "ACC": "the acceleration that both felt"}
_LEVELS = ("rssi_dbm", "rssi", "rss", "level", "dbm", "signal")
Aligner = Callable[[LabelledSession], ClockAlignment]


def table_aligners(rows: pl.DataFrame, times: TableTimes, wanted: str | None) -> dict[str, Aligner]:
    """What can align a table with a walk, by what it does it, the most exact first; ``wanted``: only by that.

    Raises UsageError where a table has no columns for what is wanted, or that is not known.
    """
    if wanted not in (None, MOTION, LEVELS):
        raise UsageError(f"--align {wanted}: there are {MOTION}, {LEVELS}")
    found: dict[str, Aligner] = {}
    for sensor, pattern in _SENSORS.items() if wanted != LEVELS else ():
        axes = _three_axes(rows.columns, pattern)
        if axes:
            norm = np.linalg.norm(rows.select(_numbers(name) for name in axes).to_numpy(), axis=1)
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


def _three_axes(columns: Sequence[str], pattern: re.Pattern[str]) -> list[str]:
    axes = {match.group(1): name for name in reversed(columns) if (match := pattern.fullmatch(name.strip().lower()))}
    return [axes[axis] for axis in "xyz"] if len(axes) == 3 else []


def _numbers(name: str) -> pl.Expr:
    return pl.col(name).cast(pl.String).str.replace(",", ".", literal=True).cast(pl.Float64, strict=False)


def _by_motion(their_ns: IntArray, theirs: FloatArray, sensor: str, session: LabelledSession) -> ClockAlignment:
    own = session.table("sensors", ("time_ns", "sensor", "v1", "v2", "v3"), pl.col("sensor") == sensor)
    norm = np.linalg.norm(own.select("v1", "v2", "v3").to_numpy(), axis=1)
    return align_by_motion(their_ns, theirs, own["time_ns"].to_numpy(), norm)


def _heard(rows: pl.DataFrame, times: TableTimes) -> Heard:
    """Times and levels of each access point in a table; empty where it has no such columns."""
    plain = {name.strip().lower(): name for name in rows.columns}
    level = next((plain[name] for name in _LEVELS if name in plain), None)
    if "bssid" not in plain or level is None:
        return {}
    bssid = rows[plain["bssid"]].cast(pl.String).str.to_lowercase()
    dbm = rows.select(_numbers(level)).to_series()
    return _by_bssid(pl.DataFrame({"bssid": bssid, "ns": times.time_ns, "dbm": dbm}).filter(pl.Series(times.usable)))


def _wifi_of(session: LabelledSession) -> Heard:
    table = session.table("wifi", ("bssid", "time_ns", "rssi_dbm"))
    return _by_bssid(
        table.select(pl.col("bssid").str.to_lowercase(), pl.col("time_ns").alias("ns"), pl.col("rssi_dbm").alias("dbm"))
    )


def _by_bssid(table: pl.DataFrame) -> Heard:
    parts = table.drop_nulls().sort("ns").partition_by("bssid", as_dict=True)
    return {
        str(key[0]): (part["ns"].to_numpy(), part["dbm"].cast(pl.Float64).to_numpy()) for key, part in parts.items()
    }
