"""Tables of other programs, CSV or Parquet: which columns are times, on which clock, which are motion and levels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from pathlib import Path
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError, first_line
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.common.files.table_files import read_csv, read_parquet
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.intake.readings import level_number
from vislam2tag.sessions.readings import mark_repeated, sensor_rows, sensor_table
from vislam2tag.site.site_table import decoded

TIME_COLUMNS = (
    *("time_ns", "timestamp", "time", "datetime", "date_time", "t", "unix_time", "unixtime", "epoch", "zeit"),
    "seconds_elapsed",
)
"""Names of a column of times, those looked for first first; a unit may follow: ``timestamp_ms``."""
_UNITS_NS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1000, "ns": 1}
_UNIT = re.compile(r"(.+?)[ _]?[\[(]?(s|ms|us|ns|sec|seconds)[\])]?", re.IGNORECASE)
MOST_NS = 2**62
"""146 years: sums and differences of less than this before and after a clock's zero have a place in 64 bits."""
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
FIRST_UNIX_S, _LAST_UNIX_S = 1.26e9, 4.1e9
"""2010 to 2099: times between are taken for Unix times, in whichever unit they are so."""
_ENOUGH_INSIDE = 0.5
"""Share of rows within walks from which times that could be either are those of the boot clock."""


_LONGEST_NAME = 200
"""No column of times has a longer name; a damaged file's may have millions of characters, each a place to look at."""


class Clock(StrEnum):
    """What a time counts from."""

    BOOT = "boot"
    UNIX = "unix"


@dataclass(frozen=True)
class TableTimes:
    """Times of a table's rows; ``usable`` (n,) is false where there is none that can be read."""

    time_ns: IntArray
    usable: BoolArray
    clock: Clock
    interpretation: str
    """Column, clock and unit, in words."""


def time_column(columns: Sequence[str], wanted: str | None) -> str:
    """The column of times; raises UsageError where there is none."""
    if wanted is not None:
        if wanted not in columns:
            raise UsageError(f"--time-column {wanted}: there is no such column; the table has: {', '.join(columns)}")
        return wanted
    plain = {name.strip().lower(): name for name in reversed(columns) if len(name) <= _LONGEST_NAME}
    for known in TIME_COLUMNS:
        for name, written in plain.items():
            with_unit = _UNIT.fullmatch(name)
            if name == known or (with_unit and with_unit.group(1) == known):
                return written
    raise UsageError(f"no column has a known name of times ({', '.join(TIME_COLUMNS)}); name it with --time-column")


def table_times(
    values: pl.Series,
    spans_ns: IntArray,
    *,
    clock: Clock | None,
    unit: str | None,
    zone: str | None,
    aligned: bool = False,
) -> TableTimes:
    """Read times; ``spans_ns`` (s, 2) are the walks', boot clock.

    Clock and unit follow from the name's unit and by magnitude, unless given. Raises UsageError where nothing can be
    read, or ISO 8601 times have no zone and ``zone`` is not given. Times that are to be ``aligned`` need not lie in any
    walk; such numbers that name no unit are seconds.
    """
    if not values.dtype.is_numeric():
        texts = values.cast(pl.String).str.strip_chars()
        if clock is None and (texts.str.contains(r"^\d{4}-\d\d-\d\d[T ]").sum() or 0) > len(texts) / 2:
            return _iso_times(values.name, texts, zone)
        values = texts.str.replace(",", ".", literal=True).cast(pl.Float64, strict=False).alias(values.name)
        exact = texts.cast(pl.Int64, strict=False).alias(values.name)
        values = exact if exact.null_count() <= values.null_count() else values
    numbers = values.cast(pl.Float64).fill_null(float("nan")).to_numpy()
    usable = np.abs(numbers) < MOST_NS
    if not usable.any():
        raise UsageError(
            f"column {values.name}: contains no readable time: expected numbers, or ISO 8601 such as "
            "2021-12-20T09:14:05+01:00"
        )
    if aligned and clock is None and unit is None and _UNIT.fullmatch(values.name.strip().lower()) is None:
        clock, unit = (None, None) if _unix_unit(numbers[usable], list(_UNITS_NS)) else (Clock.BOOT, "s")
    found_clock, found_unit = _clock_and_unit(values.name, numbers[usable], spans_ns, clock, unit)
    factor = _UNITS_NS[found_unit]
    usable &= np.abs(numbers) < MOST_NS / factor
    if values.dtype.is_integer():
        time_ns = values.cast(pl.Int64, strict=False).fill_null(0).to_numpy() * np.where(usable, factor, 0)
    else:
        time_ns = np.round(np.where(usable, numbers, 0.0) * factor).astype(np.int64)
    named = "since boot" if found_clock is Clock.BOOT else "Unix time"
    return TableTimes(time_ns, usable, found_clock, f"column {values.name}: {named} in {found_unit}")


def _clock_and_unit(
    name: str, numbers: FloatArray, spans_ns: IntArray, clock: Clock | None, unit: str | None
) -> tuple[Clock, str]:
    """Clock and unit: as given, by the column's name, by rows within walks, by magnitude."""
    named = _UNIT.fullmatch(name.strip().lower())
    if unit is None and named is not None:
        unit = "s" if named.group(2).startswith("s") else named.group(2)
    units = list(_UNITS_NS) if unit is None else [unit]
    unix = _unix_unit(numbers, units)
    inside = {each: _share_inside(numbers * _UNITS_NS[each], spans_ns) for each in units}
    boot = max(inside, key=lambda each: inside[each])
    if clock is None:
        clock = Clock.BOOT if unix is None or inside[boot] >= _ENOUGH_INSIDE else Clock.UNIX
    if clock is Clock.UNIX and unix is None:
        middle = np.median(np.abs(numbers))
        raise UsageError(
            f"column {name}: {middle:g} is not a Unix time in {' or '.join(units)}; correct --unit, or omit "
            "--clock unix"
        )
    if clock is Clock.BOOT and unit is None and not inside[boot]:
        raise UsageError(
            f"column {name}: its times are outside every walk in any unit; pass the clock with --clock, the unit "
            "with --unit, and how far the clock is ahead with --offset-s"
        )
    return clock, boot if clock is Clock.BOOT else str(unix)


def _unix_unit(numbers: FloatArray, units: Sequence[str]) -> str | None:
    """The unit in which numbers are Unix times of this century; None where there is none."""
    middle = float(np.median(np.abs(numbers)))
    return next((each for each in units if FIRST_UNIX_S <= middle * _UNITS_NS[each] / 1e9 <= _LAST_UNIX_S), None)


def _share_inside(time_ns: FloatArray, spans_ns: IntArray) -> float:
    inside = np.zeros(len(time_ns), dtype=bool)
    for start_ns, end_ns in spans_ns:
        inside |= (time_ns >= start_ns) & (time_ns <= end_ns)
    return float(inside.mean())


def _iso_times(name: str, texts: pl.Series, zone: str | None) -> TableTimes:
    try:
        missing_zone = None if zone is None else ZoneInfo(zone)
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:  # a folder of zones is none
        raise UsageError(f"--zone {zone}: is not a time zone; pass one such as Europe/Berlin or UTC") from error
    time_ns, usable = np.zeros(len(texts), dtype=np.int64), np.zeros(len(texts), dtype=bool)
    for i, text in enumerate(texts.to_list()):
        try:
            moment = datetime.fromisoformat(text)
        except (TypeError, ValueError):
            continue
        if moment.tzinfo is None and missing_zone is None:
            raise UsageError(
                f"column {name}, row {i + 1}: '{text}' has no time zone; pass it with --zone, such as Europe/Berlin"
            )
        moment = moment if moment.tzinfo is not None else moment.replace(tzinfo=missing_zone)
        whole_s = (moment.replace(microsecond=0) - _EPOCH) // timedelta(seconds=1)
        if abs(whole_s) < MOST_NS // 10**9:
            time_ns[i], usable[i] = whole_s * 1_000_000_000 + moment.microsecond * 1000, True
    return TableTimes(time_ns, usable, Clock.UNIX, f"column {name}: date and time (ISO 8601)")


PARQUET = (".parquet", ".pq")
_SEPARATORS = (";", "\t", ",")
_AXIS = r"[ _.]?(?:\([^)]*\)|\[[^]]*\])?[ _.]?([xyz])(?:[ _.]?[\[(].*[\])])?"
MOTION_COLUMNS = {
    "GYRO": re.compile(r"(?:gyro(?:scope)?|gyr|rotation_?rate|angular_?velocity|omega|w)" + _AXIS),
    "ACC": re.compile(r"(?:acc|accel|acceleration|accelerometer|a)" + _AXIS),
}
"""Columns of three axes, by what the table ``sensors`` calls them."""
_LEVELS = ("rssi_dbm", "rssi", "rss", "level", "dbm", "signal")
_OF_LABELS = frozenset(("row", "time_ns", "repeated", "floor", "device", "session", "x", "y", "z", "sigma", "status"))


def read_table(path: Path) -> pl.DataFrame:
    """Read a CSV file, all columns as text, or a Parquet file; raises UsageError where it cannot be read."""
    try:
        if path.suffix.lower() in PARQUET:
            return read_parquet(path)
        raw = read_bytes(path)
        if raw.startswith(b"PK"):
            raise UsageError(f"{path}: is a spreadsheet (XLSX) or a zip; save the table as CSV and pass that")
        text, _ = decoded(raw)
        head = text.partition("\n")[0]
        separator = max(_SEPARATORS, key=head.count)
        return read_csv(text.encode(), separator=separator, infer_schema=False)
    except (OSError, pl.exceptions.PolarsError) as error:
        why = error.strerror if isinstance(error, OSError) and error.strerror else first_line(error)
        raise UsageError(f"{path}: cannot be read as CSV or Parquet ({why})") from error


def three_axes(columns: Sequence[str], sensor: str) -> list[str]:
    """The columns of a sensor's x, y and z; none where the table has none."""
    pattern = MOTION_COLUMNS[sensor]
    axes = {match.group(1): name for name in reversed(columns) if (match := pattern.fullmatch(name.strip().lower()))}
    return [axes[axis] for axis in "xyz"] if len(axes) == 3 else []


def readings_in(rows: pl.DataFrame) -> pl.DataFrame | None:
    """``bssid``, ``ssid`` and ``rssi_dbm`` (null if it is not a number) of a table; None if it has no such columns."""
    plain = {name.strip().lower(): name for name in rows.columns}
    level = next((plain[name] for name in _LEVELS if name in plain), None)
    if level is None or "bssid" not in plain:
        return None
    ssid = pl.col(plain["ssid"]) if "ssid" in plain else pl.lit("")
    return rows.select(
        bssid=pl.col(plain["bssid"]).cast(pl.String).str.strip_chars(),
        ssid=ssid.cast(pl.String).fill_null(""),
        rssi_dbm=level_number(pl.col(level)),
    )


def numbers(name: str) -> pl.Expr:
    """A column as numbers, with either decimal mark; null where it contains none."""
    return pl.col(name).cast(pl.String).str.replace(",", ".", literal=True).cast(pl.Float64, strict=False)


def session_tables(rows: pl.DataFrame, name: str) -> dict[str, pl.DataFrame]:
    """Turn a table with ``row`` and ``time_ns`` into those of a session: ``wifi``, ``sensors``, or one called ``name``.

    Raises UsageError where a column of the last has a name that labels take.
    """
    columns = [column for column in rows.columns if column not in ("row", "time_ns")]
    readings = readings_in(rows)
    if readings is not None:
        return {"wifi": _wifi(rows, readings)}
    sensors = {sensor: axes for sensor in MOTION_COLUMNS if (axes := three_axes(columns, sensor))}
    if sensors:
        return {"sensors": _sensors(rows, sensors)}
    if taken := sorted(_OF_LABELS & set(columns)):
        raise UsageError(f"the table has a column {' and '.join(taken)}, which is reserved for labels; rename it")
    first = pl.struct("time_ns", *columns).is_first_distinct()
    return {name: rows.select("row", "time_ns", first.not_().alias("repeated"), *columns)}


def _wifi(rows: pl.DataFrame, readings: pl.DataFrame) -> pl.DataFrame:
    """Readings of access points (:func:`readings_in`); those of one time are a scan."""
    table = rows.select(
        "row",
        "time_ns",
        pl.col("time_ns").rank("dense").cast(pl.Int32).alias("scan"),
        readings["bssid"],
        readings["ssid"],
        readings["rssi_dbm"].cast(pl.Float32),
        pl.lit(None, dtype=pl.Float32).alias("frequency_mhz"),
    )
    return mark_repeated(table.drop_nulls("rssi_dbm"), "bssid")


def _sensors(rows: pl.DataFrame, sensors: dict[str, list[str]]) -> pl.DataFrame:
    parts = [
        sensor_rows(rows, sensor, [numbers(axis).fill_null(float("nan")) for axis in axes])
        for sensor, axes in sensors.items()
    ]
    return sensor_table(pl.concat(parts), "")[0]
