"""Times of tables in memory: integers, decimal numbers, date-times or dates in text, as nanoseconds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Finding, at_lines_if
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.intake.columns import find_columns, shown, time_unit
from vislam2tag.intake.time_units import FRAMES, NS_IN
from vislam2tag.sessions.foreign_tables import MOST_NS, table_times
from vislam2tag.sessions.walk_tables import ZONE, have_dates


@dataclass(frozen=True)
class GivenTimes:
    """Times of a table's rows, ``ns`` (n,) with null for those without; ``local`` if they are dates without a zone."""

    ns: pl.Series
    column: str
    local: bool = False

    def missing(self, table: str) -> list[Finding]:
        """Report the rows without a time, which are left out; rows count from 1."""
        rows = [row + 1 for row in self.ns.is_null().arg_true().to_list()]
        message = f"column {self.column}: these rows have no time; they are left out"
        return at_lines_if("rows_without_time", table, rows, message)


def given_times(
    frame: pl.DataFrame, table: str, column: str = "time_ns", span_ns: IntArray | None = None
) -> GivenTimes:
    """Read the times of a table, from ``column`` or, without ``time_ns``, the one whose header is that of times.

    Numbers are in the unit that the header states, else in nanoseconds. Decimal numbers without a unit are seconds if
    they then meet ``span_ns`` (times of the walk) or have the rate of frames. Dates without a zone are read as UTC.
    Raises UsageError, naming table, column and row, for anything else.
    """
    name, unit = _time_column(frame, table, column)
    values, where = frame[name], f"{table}, column {name}"
    if isinstance(values.dtype, pl.Datetime):
        return GivenTimes(_checked(values.dt.epoch("ns"), values, where), name, values.dtype.time_zone is None)
    if not (values.dtype.is_numeric() or values.dtype in (pl.String, pl.Categorical, pl.Enum, pl.Null)):
        raise UsageError(f"{where}: expected numbers, date-times or dates as text; found values of another kind")
    if not values.dtype.is_numeric():
        texts = values.cast(pl.String).str.strip_chars().replace("", None)
        if have_dates(texts.drop_nulls()):
            return _of_dates(texts, name, where)
        values = _numbers(texts, where)
    return GivenTimes(_checked(_in_ns(values, unit, where, span_ns), values, where), name)


def refuse_mixed_dates(times: Sequence[tuple[str, GivenTimes]]) -> None:
    """Raise UsageError if some tables have dates without a time zone, and others anything else."""
    local = [f"{table}, column {one.column}" for table, one in times if one.local]
    others = [f"{table}, column {one.column}" for table, one in times if not one.local]
    if local and others:
        raise UsageError(
            f"{local[0]}: the dates have no time zone, but those of {others[0]} have one or are numbers. Give all "
            "tables times of one kind, for example with .dt.tz_localize('Europe/Berlin') in pandas"
        )


def _time_column(frame: pl.DataFrame, table: str, column: str) -> tuple[str, str | None]:
    """The column of times and the unit in its name."""
    if column in frame.columns:
        return column, time_unit(column)
    found = find_columns(frame.columns, ("time",)).get("time") if column == "time_ns" else None
    if found is None:
        raise UsageError(f"{table}: the column {column} is missing; it has {shown(frame.columns) or 'none'}")
    return found.name, found.unit


def _of_dates(texts: pl.Series, name: str, where: str) -> GivenTimes:
    zoned = texts.drop_nulls().str.contains(ZONE)
    if zoned.any() and not zoned.all():
        row = int((~texts.str.contains(ZONE)).fill_null(value=False).arg_max() or 0)
        raise UsageError(f"{where}, row {row + 1}: {texts[row]!r} has no time zone, but other rows have one; add it")
    local = not zoned.any()
    try:
        times = table_times(texts, np.empty((0, 2), dtype=int), clock=None, unit=None, zone="UTC" if local else None)
    except UsageError as error:
        raise UsageError(f"{where}: {str(error).removeprefix(f'column {name}: ')}") from error
    ns = pl.select(pl.when(pl.Series(times.usable)).then(pl.Series(times.time_ns))).to_series()
    return GivenTimes(_checked(ns, texts, where), name, local)


def _numbers(texts: pl.Series, where: str) -> pl.Series:
    """Numbers that are written as text."""
    whole = texts.cast(pl.Int64, strict=False)
    if whole.null_count() == texts.null_count():
        return whole
    numbers = texts.cast(pl.Float64, strict=False)
    return numbers if numbers.null_count() == texts.null_count() else _checked(numbers, texts, where)


def _in_ns(values: pl.Series, unit: str | None, where: str, span_ns: IntArray | None) -> pl.Series:
    greatest = values.cast(pl.Float64).fill_nan(None).abs().max()
    if unit is not None and isinstance(greatest, float) and MOST_NS / NS_IN[unit] <= greatest < np.inf:
        raise UsageError(f"{where}: {greatest:.15g} is too large for a time in {unit}; correct the unit in its name")
    if values.dtype.is_integer():
        return values.cast(pl.Int64, strict=False) * NS_IN[unit or "ns"]
    numbers = values.cast(pl.Float64).fill_nan(None)
    _checked(numbers.set(numbers.is_infinite(), None), numbers, where)
    known = numbers.drop_nulls().to_numpy()
    fractions = bool((known % 1 != 0).any())
    if fractions and unit == "ns":
        fitting = _fitting(known, span_ns) or ["s"]
        row, found = _first_fraction(numbers)
        raise UsageError(
            f"{where}, row {row + 1}: expected whole numbers, nanoseconds; found {found!r}. "
            f"If the times are in another unit, rename the column, for example to time_{fitting[0]}"
        )
    if fractions and unit is None:
        fitting = _fitting(known, span_ns)
        if "s" not in fitting:
            names = " or ".join(f"time_{each}" for each in (fitting or ["s", "ms", "us"]))
            raise UsageError(
                f"{where}: times such as {_first_fraction(numbers)[1]!r} state no unit, and do not fit as seconds; "
                f"rename the column to {names}"
            )
        unit = "s"
    scaled = numbers * NS_IN[unit or "ns"]
    return scaled.set(scaled.abs() >= MOST_NS, None).round().cast(pl.Int64, strict=False)


def _fitting(known: FloatArray, span_ns: IntArray | None) -> list[str]:
    """The units in which times (n,) meet the times of the walk, or have the rate of frames."""
    return [unit for unit, ns in NS_IN.items() if _fits(known * ns, span_ns)]


def _fits(ns: FloatArray, span_ns: IntArray | None) -> bool:
    if span_ns is not None and len(span_ns):
        return bool(ns.min() <= span_ns.max() and ns.max() >= span_ns.min())
    steps = np.diff(np.unique(ns))
    return bool(len(steps)) and FRAMES.contain(float(np.median(steps)))


def _first_fraction(numbers: pl.Series) -> tuple[int, float]:
    """The first row whose number has a fraction, from 0, and the number."""
    row = int((numbers % 1 != 0).fill_null(value=False).arg_max() or 0)
    return row, float(numbers[row])


def _checked(ns: pl.Series, given: pl.Series, where: str) -> pl.Series:
    """Times, if all values that are given are times; raises UsageError with the first row of another."""
    there = given.is_not_null() & (given.is_not_nan() if given.dtype.is_float() else True)
    wrong = (ns.is_null() & there) | (ns < 0).fill_null(value=False)
    if wrong.any():
        row = int(wrong.arg_max() or 0)
        raise UsageError(f"{where}, row {row + 1}: expected a time, not negative; found {given[row]!r}")
    return ns.alias("time_ns")


def outside_walk(times: GivenTimes, table: str, walk_ns: IntArray) -> str:
    """Say that no row is within the walk, whose frames have the times ``walk_ns``; empty if some are, or none has one.

    Names the unit that would fit, if there is one.
    """
    known = times.ns.drop_nulls().to_numpy()
    if not len(known) or not len(walk_ns) or _fits(known.astype(float), walk_ns):
        return ""
    beside = (
        f"{table}, column {times.column}: no row is within the walk. Its times are {known.min()} to {known.max()} ns, "
        f"those of the walk {walk_ns.min()} to {walk_ns.max()} ns"
    )
    factors = {unit: factor for unit, factor in NS_IN.items() if unit != "ns"}
    for unit, factor in factors.items():
        if _fits(known.astype(float) * factor, walk_ns):
            return f"{beside}. They fit if multiplied by {factor:,}: rename the column to time_{unit}"
    for factor in factors.values():
        if _fits(known.astype(float) / factor, walk_ns):
            return f"{beside}. They fit if divided by {factor:,}: correct the unit in the column's name"
    return f"{beside}. Give the table times of the poses' clock"
