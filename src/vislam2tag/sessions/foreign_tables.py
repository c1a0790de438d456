"""Tables of other programs, CSV or Parquet: which columns are times, on which clock, which are motion and levels."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from enum import StrEnum
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.intake.cells import unreadable_cells, with_numbers
from vislam2tag.intake.columns import KNOWN_NAMES, TIME, find_columns, time_unit
from vislam2tag.intake.sensor_units import UNIT_IN_NAME, in_sensor_unit, stated_unit, with_axes_in_place
from vislam2tag.intake.time_units import MAX_STEP_S, NS_IN, ROUNDED, clock_change, rounded_step, shared_times
from vislam2tag.sessions.readings import mark_repeated, scan_numbers, sensor_rows, sensor_table

MOST_NS = 2**62
"""146 years: sums and differences of less than this before and after a clock's zero have a place in 64 bits."""
_LONGEST_NS = 6 * 3600 * 10**9
"""Six hours: recordings are shorter, and in the next larger unit those of more than 22 s are longer."""
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
FIRST_UNIX_S, _LAST_UNIX_S = 1.26e9, 4.1e9
"""2010 to 2099: times between are taken for Unix times, in whichever unit they are so."""
_ENOUGH_INSIDE = 0.5
"""Share of rows within walks from which times that could be either are those of the boot clock."""


_LONGEST_NAME = 200
"""No column has a longer name; a damaged file's may have millions of characters, each a place to look at."""


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
    found = find_columns(columns, (TIME,)).get(TIME)
    if found is None:
        raise UsageError(
            f"no column has a known name of times ({', '.join(KNOWN_NAMES[TIME])}); name it with --time-column. The "
            f"header was read as: {', '.join(columns)[:_SHOWN]}"
        )
    return found.name


def table_times(
    values: pl.Series,
    spans_ns: IntArray,
    *,
    clock: Clock | None,
    unit: str | None,
    zone: str | None,
    aligned: bool = False,
    lines: pl.Series | None = None,
) -> TableTimes:
    """Read times; ``spans_ns`` (s, 2) are the walks', boot clock.

    Clock and unit follow from the name's unit and by magnitude, unless given. ``lines`` (n,) are those of the values in
    the file. Times that can be ``aligned`` need not be in any walk; such numbers that name no unit are seconds then.
    Raises UsageError if nothing can be read, times are rounded, the clock was changed by an hour, or ISO 8601 times
    have no zone and ``zone`` is not given.
    """
    texts = values.cast(pl.String).str.strip_chars()
    texts = texts.str.replace(r"^(\d{4})[/-](\d\d)[/-](\d\d)[T _-]", "${1}-${2}-${3} ")
    if clock is None and (texts.str.contains(r"^\d{4}-\d\d-\d\d[T ]").sum() or 0) > len(texts) / 2:
        times = _iso_times(values.name, texts, zone, _lines(values, lines))
    else:
        times = _numeric_times(values, spans_ns, clock, unit, aligned=aligned)
    rows = np.flatnonzero(times.usable)
    changed = clock_change(times.time_ns[rows])
    if changed is not None:
        line = _lines(values, lines)[int(rows[changed])]
        raise UsageError(
            f"column {values.name}: the clock was changed by an hour at line {line}, as for "
            "daylight saving; write the times in UTC, or pass the rows before and after it as two tables"
        )
    return times


def time_findings(values: pl.Series, times: TableTimes, file: str, lines: pl.Series | None = None) -> list[Finding]:
    """Report cells of a column of times that are neither empty nor readable."""
    rows = pl.DataFrame({"row": _lines(values, lines), values.name: values})
    unreadable = pl.Series(~times.usable) & (values.cast(pl.String).str.strip_chars() != "")
    return unreadable_cells(rows, values.name, unreadable, file)


def _lines(values: pl.Series, lines: pl.Series | None) -> pl.Series:
    """The line of each value; below a header in line 1 by default."""
    return pl.int_range(2, len(values) + 2, dtype=pl.Int64, eager=True) if lines is None else lines


def _numeric_times(
    values: pl.Series, spans_ns: IntArray, clock: Clock | None, unit: str | None, *, aligned: bool
) -> TableTimes:
    step, example = 0.0, ""
    if not values.dtype.is_numeric():
        texts = values.cast(pl.String).str.strip_chars()
        step, example = rounded_step(texts)
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
    if aligned and clock is None and unit is None and time_unit(values.name) is None:
        inside = any(_share_inside(numbers[usable] * factor, spans_ns) for factor in NS_IN.values())
        known = inside or _unix_unit(numbers[usable], list(NS_IN))
        clock, unit = (None, None) if known else (Clock.BOOT, _boot_unit(numbers[usable]))
    found_clock, found_unit = _clock_and_unit(values.name, numbers[usable], spans_ns, clock, unit)
    factor = NS_IN[found_unit]
    if (step_s := step * factor / 1e9) > MAX_STEP_S:
        raise UsageError(f"column {values.name}: times such as {example} are rounded to {step_s:.3g} s; {ROUNDED}")
    usable &= np.abs(numbers) < MOST_NS / factor
    if values.dtype.is_integer():
        time_ns = values.cast(pl.Int64, strict=False).fill_null(0).to_numpy() * np.where(usable, factor, 0)
    else:
        time_ns = np.round(np.where(usable, numbers, 0.0) * factor).astype(np.int64)
    named = "since boot" if found_clock is Clock.BOOT else "Unix time"
    return TableTimes(time_ns, usable, found_clock, f"column {values.name}: {named} in {found_unit}")


def _boot_unit(numbers: FloatArray) -> str:
    """The largest unit in which times since boot are of one recording."""
    span = float(np.ptp(numbers))
    return next((unit for unit, factor in NS_IN.items() if span * factor < _LONGEST_NS), "ns")


def _clock_and_unit(
    name: str, numbers: FloatArray, spans_ns: IntArray, clock: Clock | None, unit: str | None
) -> tuple[Clock, str]:
    """Clock and unit: as given, by the column's name, by rows within walks, by magnitude."""
    unit = unit or time_unit(name)
    units = list(NS_IN) if unit is None else [unit]
    unix = _unix_unit(numbers, units)
    inside = {each: _share_inside(numbers * NS_IN[each], spans_ns) for each in units}
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
    return next((each for each in units if FIRST_UNIX_S <= middle * NS_IN[each] / 1e9 <= _LAST_UNIX_S), None)


def _share_inside(time_ns: FloatArray, spans_ns: IntArray) -> float:
    inside = np.zeros(len(time_ns), dtype=bool)
    for start_ns, end_ns in spans_ns:
        inside |= (time_ns >= start_ns) & (time_ns <= end_ns)
    return float(inside.mean())


def _iso_times(name: str, texts: pl.Series, zone: str | None, lines: pl.Series) -> TableTimes:
    missing_zone = None if zone is None else time_zone(zone, "--zone")
    time_ns, usable = np.zeros(len(texts), dtype=np.int64), np.zeros(len(texts), dtype=bool)
    for i, text in enumerate(texts.to_list()):
        try:
            moment = datetime.fromisoformat(text)
        except (TypeError, ValueError):
            continue
        if moment.tzinfo is None and missing_zone is None:
            raise UsageError(
                f"column {name}, line {lines[i]}: '{text}' has no time zone; pass it with --zone, such as Europe/Berlin"
            )
        moment = moment if moment.tzinfo is not None else moment.replace(tzinfo=missing_zone)
        whole_s = (moment.replace(microsecond=0) - _EPOCH) // timedelta(seconds=1)
        if abs(whole_s) < MOST_NS // 10**9:
            time_ns[i], usable[i] = whole_s * 1_000_000_000 + moment.microsecond * 1000, True
    return TableTimes(time_ns, usable, Clock.UNIX, f"column {name}: date and time (ISO 8601)")


def time_zone(name: str, entry: str) -> ZoneInfo:
    """The time zone that an ``entry`` (an option or line of a file) names; raises UsageError if there is none."""
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:  # a folder of zones is none
        raise UsageError(f"{entry} {name}: is not a time zone; pass one such as Europe/Berlin or UTC") from error


_SHOWN = 120
"""Letters of a wrong header that a message repeats."""
_BRACKETS = r"[ _.-]*[\[(]\s*(?P<{}>[^)\]]*?)\s*[\])]"
_SUFFIX = rf"(?:{_BRACKETS.format('behind')}|[ _.-](?P<suffix>{UNIT_IN_NAME}))?"
_AXIS = rf"(?:{_BRACKETS.format('before')})?[ _.-]*(?P<axis>[xyz]){_SUFFIX}"
MOTION_COLUMNS = {
    "GYRO": re.compile(r"(?:gyro(?:scope)?(?:[ _]?rotation)?|gyr|rotation_?rate|angular_?velocity|omega|w)" + _AXIS),
    "ACC": re.compile(r"(?:acc|accel|acceleration|accelerometer(?:[ _]?acceleration)?|a)" + _AXIS),
}
"""Columns of three axes, by what the table ``sensors`` calls them."""
SENSOR_COLUMNS = MOTION_COLUMNS | {
    "MAG": re.compile(r"(?:magn?|magnetic(?:[ _]?field)?|magnetometer)" + _AXIS),
    "PRESSURE": re.compile(rf"(?:(?:air|barometric|atmospheric|barometer)[ _]?)?(?:pressure|baro){_SUFFIX}"),
}
"""Columns of each sensor; a pressure has no axes. Tables to attach have motion, and then the others are read, too."""
_OF_LABELS = frozenset(("row", "time_ns", "repeated", "floor", "device", "session", "x", "y", "z", "sigma", "status"))


def sensor_columns(columns: Sequence[str], sensor: str) -> tuple[list[str], str | None]:
    """The columns of a sensor's x, y and z, or of its one value, and the unit in all their names.

    Empty if the table does not have the sensor; None if the names do not state a unit.
    """
    pattern = SENSOR_COLUMNS[sensor]
    names = {name: name.strip().lower() for name in reversed(columns) if len(name) <= _LONGEST_NAME}
    found = {name: match.groupdict() for name, plain in names.items() if (match := pattern.fullmatch(plain))}
    axes = {parts.get("axis"): name for name, parts in found.items()}
    wanted = list("xyz") if "axis" in pattern.groupindex else [None]
    if not axes.keys() >= set(wanted):
        return [], None
    chosen = [axes[axis] for axis in wanted]
    units = {stated_unit(sensor, [unit for key, unit in found[name].items() if key != "axis"]) for name in chosen}
    return chosen, units.pop() if len(units) == 1 else None


def level_columns(columns: Sequence[str]) -> tuple[str, str] | None:
    """The columns of access points and their levels; None where the table has none."""
    found = find_columns(columns, ("address", "level"))
    return (found["address"].name, found["level"].name) if len(found) == 2 else None


def readings_in(rows: pl.DataFrame) -> pl.DataFrame | None:
    """``bssid``, ``ssid`` and ``rssi_dbm`` of a table whose levels are numbers; None if it has no such columns."""
    columns = level_columns(rows.columns)
    if columns is None:
        return None
    named = find_columns(rows.columns, ("ssid",)).get("ssid")
    ssid = pl.lit("") if named is None else pl.col(named.name)
    return rows.select(
        bssid=pl.col(columns[0]).cast(pl.String).str.strip_chars(),
        ssid=ssid.cast(pl.String).fill_null(""),
        rssi_dbm=pl.col(columns[1]).cast(pl.Float64),
    )


def with_readings(rows: pl.DataFrame, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """Turn the columns of levels and sensors into numbers, and report their cells that are none.

    ``rows`` has ``row``, the 1-based line. Columns of turn rates and accelerations that are exchanged are read the
    other way round, and reported.
    """
    levels = level_columns(rows.columns)
    sensors = [sensor_columns(rows.columns, sensor)[0] for sensor in SENSOR_COLUMNS]
    names = [*(levels or ())[1:], *(name for axes in sensors for name in axes)]
    readable, odd = with_numbers(rows, names, file)
    in_place, exchanged = with_axes_in_place(readable, sensors[0], sensors[1], file)
    return in_place, [*odd, *exchanged]


def session_tables(rows: pl.DataFrame, name: str, file: str) -> tuple[dict[str, pl.DataFrame], list[Finding]]:
    """Turn a table with ``row`` and ``time_ns`` into those of a session: ``wifi``, ``sensors``, or one called ``name``.

    Findings are about its cells and units. Raises UsageError where a column of the last has a name that labels take, or
    inertial readings share their times.
    """
    columns = [column for column in rows.columns if column not in ("row", "time_ns")]
    if level_columns(columns) is not None:
        readable, odd = with_readings(rows, file)
        return {"wifi": _wifi(readable)}, odd
    if any(sensor_columns(columns, sensor)[0] for sensor in MOTION_COLUMNS):
        sensors, odd = sensors_in(rows, file)
        return {"sensors": sensors}, odd
    if taken := sorted(_OF_LABELS & set(columns)):
        raise UsageError(f"the table has a column {' and '.join(taken)}, which is reserved for labels; rename it")
    first = pl.struct("time_ns", *columns).is_first_distinct()
    return {name: rows.select("row", "time_ns", first.not_().alias("repeated"), *columns)}, []


def _wifi(rows: pl.DataFrame) -> pl.DataFrame:
    """Readings of access points by scan."""
    readings = readings_in(rows)
    assert readings is not None
    named = find_columns(rows.columns, ("scan",)).get("scan")
    said = None if named is None else rows[named.name]
    table = rows.select(
        "row",
        "time_ns",
        scan_numbers(rows["time_ns"], readings["bssid"], said).alias("scan"),
        readings["bssid"],
        readings["ssid"],
        readings["rssi_dbm"].cast(pl.Float32),
        pl.lit(None, dtype=pl.Float32).alias("frequency_mhz"),
    )
    return mark_repeated(table.drop_nulls("rssi_dbm"), "bssid")


def sensors_in(rows: pl.DataFrame, file: str) -> tuple[pl.DataFrame, list[Finding]]:
    """The table ``sensors`` of a table with ``row``, ``time_ns`` and :data:`SENSOR_COLUMNS`, in units of Android.

    Readings of unknown unit are left out and reported. Raises UsageError if inertial readings share their times.
    """
    rows, findings = with_readings(rows, file)
    parts = [sensor_rows(rows.clear(), "", [])]
    for sensor in SENSOR_COLUMNS:
        axes, stated = sensor_columns(rows.columns, sensor)
        known = rows.drop_nulls(axes) if axes else rows.clear()
        if known.is_empty():
            continue
        if sensor in MOTION_COLUMNS and shared_times(known["time_ns"].to_numpy()):
            raise UsageError(f"{file}: most readings share their time with others, so times are rounded; {ROUNDED}")
        values, odd = in_sensor_unit(known.select(axes).to_numpy(), sensor, stated, file)
        findings += odd
        if values is not None:
            parts.append(sensor_rows(known, sensor, [pl.Series(axis) for axis in values.T]))
    return sensor_table(pl.concat(parts), "")[0], findings
