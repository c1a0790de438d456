"""Times of other people's tables: which column, which clock and unit, as nanoseconds; and how clocks are aligned."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import TypeAlias
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray

TIME_COLUMNS = ("time_ns", "timestamp", "time", "datetime", "date_time", "t", "unix_time", "unixtime", "epoch", "zeit")
"""Names of a column of times, those looked for first first; a unit may follow: ``timestamp_ms``."""
_UNITS_NS = {"s": 1_000_000_000, "ms": 1_000_000, "us": 1000, "ns": 1}
_UNIT = re.compile(r"(.+?)[ _]?[\[(]?(s|ms|us|ns|sec|seconds)[\])]?", re.IGNORECASE)
_FIRST_UNIX_S, _LAST_UNIX_S = 1.26e9, 4.1e9
"""2010 to 2099: times between are taken for Unix times, in whichever unit they are so."""
_ENOUGH_INSIDE = 0.5
"""Share of rows within walks from which times that could be either are those of the boot clock."""


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
            raise UsageError(f"--time-column {wanted}: there is no such column; there are: {', '.join(columns)}")
        return wanted
    plain = {name.strip().lower(): name for name in reversed(columns)}
    for known in TIME_COLUMNS:
        for name, written in plain.items():
            with_unit = _UNIT.fullmatch(name)
            if name == known or (with_unit and with_unit.group(1) == known):
                return written
    raise UsageError(f"no column is called as times are ({', '.join(TIME_COLUMNS)}); name it by --time-column")


def table_times(
    values: pl.Series, spans_ns: IntArray, *, clock: Clock | None, unit: str | None, zone: str | None
) -> TableTimes:
    """Read times; ``spans_ns`` (s, 2) are the walks', boot clock.

    Clock and unit follow from the name's unit and by magnitude, unless given. Raises UsageError where nothing can be
    read, or ISO 8601 times have no zone and ``zone`` is not given.
    """
    if not values.dtype.is_numeric():
        texts = values.cast(pl.String).str.strip_chars()
        if clock is None and (texts.str.contains(r"^\d{4}-\d\d-\d\d[T ]").sum() or 0) > len(texts) / 2:
            return _iso_times(values.name, texts, zone)
        values = texts.str.replace(",", ".", literal=True).cast(pl.Float64, strict=False).alias(values.name)
        exact = texts.cast(pl.Int64, strict=False).alias(values.name)
        values = exact if exact.null_count() <= values.null_count() else values
    numbers = values.cast(pl.Float64).fill_null(float("nan")).to_numpy()
    usable = np.isfinite(numbers)
    if not usable.any():
        raise UsageError(f"column {values.name}: holds no time that can be read: give numbers or ISO 8601")
    found_clock, found_unit = _clock_and_unit(values.name, numbers[usable], spans_ns, clock, unit)
    factor = _UNITS_NS[found_unit]
    if values.dtype.is_integer():
        time_ns = values.fill_null(0).cast(pl.Int64).to_numpy() * factor
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
    middle = float(np.median(np.abs(numbers)))
    unix = next((each for each in units if _FIRST_UNIX_S <= middle * _UNITS_NS[each] / 1e9 <= _LAST_UNIX_S), None)
    inside = {each: _share_inside(numbers * _UNITS_NS[each], spans_ns) for each in units}
    boot = max(inside, key=lambda each: inside[each])
    if clock is None:
        clock = Clock.BOOT if unix is None or inside[boot] >= _ENOUGH_INSIDE else Clock.UNIX
    if clock is Clock.UNIX and unix is None:
        raise UsageError(f"column {name}: {middle:g} is no Unix time in {' or '.join(units)}; give its unit by --unit")
    if clock is Clock.BOOT and unit is None and not inside[boot]:
        raise UsageError(
            f"column {name}: its times lie in no walk, whichever unit they are in; say what they are by --clock and "
            "--unit, and by how much the clock is ahead by --offset-s"
        )
    return clock, boot if clock is Clock.BOOT else str(unix)


def _share_inside(time_ns: FloatArray, spans_ns: IntArray) -> float:
    inside = np.zeros(len(time_ns), dtype=bool)
    for start_ns, end_ns in spans_ns:
        inside |= (time_ns >= start_ns) & (time_ns <= end_ns)
    return float(inside.mean())


def _iso_times(name: str, texts: pl.Series, zone: str | None) -> TableTimes:
    try:
        missing_zone = None if zone is None else ZoneInfo(zone)
    except (ZoneInfoNotFoundError, ValueError) as error:
        raise UsageError(f"--zone {zone}: is no time zone; give one such as Europe/Berlin or UTC") from error
    time_ns, usable = np.zeros(len(texts), dtype=np.int64), np.zeros(len(texts), dtype=bool)
    for i, text in enumerate(texts.to_list()):
        try:
            moment = datetime.fromisoformat(text)
        except (TypeError, ValueError):
            continue
        if moment.tzinfo is None and missing_zone is None:
            raise UsageError(
                f"column {name}, row {i + 1}: '{text}' has no zone; give it by --zone, such as Europe/Berlin"
            )
        moment = moment if moment.tzinfo is not None else moment.replace(tzinfo=missing_zone)
        whole_s = int(moment.replace(microsecond=0).timestamp())
        time_ns[i], usable[i] = whole_s * 1_000_000_000 + moment.microsecond * 1000, True
    return TableTimes(time_ns, usable, Clock.UNIX, f"column {name}: date and time (ISO 8601)")


Heard: TypeAlias = Mapping[str, tuple[IntArray, FloatArray]]
"""Times (n,), ns, sorted, and levels (n,), dBm, by BSSID."""
_STEP_S = 0.5
_NEAR_S = 1.5
"""Two readings of one access point are compared if they are so close in time."""
_GREATEST_DB = 12.0
"""Differences count up to this: an access point that fades tells no more than that."""
_LEAST_PAIRS = 40
_LEAST_CLEAR = 1.25
"""How much worse than the best offset the best of the others must be."""
_APART_S = 10.0
_COINCIDE_NS = 10_000_000
_MOST_OFFSETS = 40_000


def offset_by_wifi(theirs: Heard, ours: Heard) -> int | None:
    """Nanoseconds that their clock is ahead of ours, by access points that both heard; None where nothing is clear.

    Levels of two phones may differ by a constant.
    """
    shared = [bssid for bssid in theirs if bssid in ours]
    if not shared:
        return None
    first = min(int(theirs[b][0][0]) for b in shared) - max(int(ours[b][0][-1]) for b in shared)
    last = max(int(theirs[b][0][-1]) for b in shared) - min(int(ours[b][0][0]) for b in shared)
    offsets = np.arange(first, last, int(_STEP_S * 1e9))
    if not 0 < len(offsets) <= _MOST_OFFSETS:
        return None
    costs = np.array([_cost(theirs, ours, shared, int(offset)) for offset in offsets])
    best = int(np.argmin(costs))
    others = costs[np.abs(offsets - offsets[best]) > _APART_S * 1e9]
    if not np.isfinite(costs[best]) or (len(others) and others.min() < _LEAST_CLEAR * costs[best]):
        return None
    return _refined(theirs, ours, shared, int(offsets[best]))


def _refined(theirs: Heard, ours: Heard, shared: Sequence[str], offset_ns: int) -> int:
    """The offset at which most of those readings coincide that both clocks dated, to 10 ms; else as it is."""
    apart = []
    for bssid in shared:
        (their_ns, their_dbm), (our_ns, our_dbm) = theirs[bssid], ours[bssid]
        differences = (their_ns - offset_ns)[:, None] - our_ns
        near = (np.abs(differences) <= _NEAR_S * 1e9) & (their_dbm[:, None] == our_dbm)
        apart.append(differences[near])
    found = np.round(np.concatenate(apart) / _COINCIDE_NS).astype(np.int64)
    values, counts = np.unique(found, return_counts=True)
    if not len(values) or counts.max() < _LEAST_PAIRS // 2:
        return offset_ns
    return offset_ns + int(values[np.argmax(counts)]) * _COINCIDE_NS


def _cost(theirs: Heard, ours: Heard, shared: Sequence[str], offset_ns: int) -> float:
    """Mean difference of levels heard at the same time, dB, were their clock ahead by this; infinite for few."""
    found = []
    for bssid in shared:
        (their_ns, their_dbm), (our_ns, our_dbm) = theirs[bssid], ours[bssid]
        wanted = their_ns - offset_ns
        after = np.searchsorted(our_ns, wanted).clip(1, max(len(our_ns) - 1, 1)).clip(max=len(our_ns) - 1)
        before = np.maximum(after - 1, 0)
        nearer = np.where(np.abs(our_ns[after] - wanted) < np.abs(our_ns[before] - wanted), after, before)
        near = np.abs(our_ns[nearer] - wanted) <= _NEAR_S * 1e9
        found.append((their_dbm - our_dbm[nearer])[near])
    differences = np.concatenate(found)
    if len(differences) < _LEAST_PAIRS:
        return np.inf
    return float(np.minimum(np.abs(differences - np.median(differences)), _GREATEST_DB).mean())
