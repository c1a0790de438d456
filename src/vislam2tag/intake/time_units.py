"""Detect the unit of a table's times if the stated unit is impossible, by rate, duration and the clock of other
tables."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import islice
from typing import TypeAlias

import numpy as np
import polars as pl

from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray, IntArray

NS_OF = {"nanoseconds": 1, "microseconds": 10**3, "milliseconds": 10**6, "seconds": 10**9}
UNIT_NAMES = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
NS_IN = {unit: NS_OF[name] for unit, name in UNIT_NAMES.items()}
"""Nanoseconds in each unit, by its symbol."""
_GREATEST_NS = 2**63 - 1


@dataclass(frozen=True)
class Steps:
    """Possible intervals between rows, seconds."""

    least_s: float
    greatest_s: float

    def contain(self, step_ns: float) -> bool:
        """Whether this usual interval is possible."""
        return self.least_s * 1e9 <= step_ns <= self.greatest_s * 1e9


MAX_STEP_S = 1 / 30
"""Times that are rounded to more than a frame of usual trackers, 5 cm of a walk, are refused."""
ROUNDED = "use the original file, not one that a spreadsheet saved"
_EXPONENT = re.compile(r"[+-]?\d+(?:[.,](\d*))?[eE]([+-]?\d+)")
_GREATEST_EXPONENT = 300
_FRACTION = re.compile(r"\d+[.,]\d+")
_SHOWN = 1000
"""Cells of a column that are looked at."""
_ALIKE = 3
"""An inertial sensor with so many readings at each time has rounded times."""
HOUR_NS = 3600 * 10**9
OTHER_HOURS = sorted({*range(-14, 15)} - {0}, key=abs)
"""By how many hours clocks of time zones differ, the likely ones first."""
_CLOCK_CHANGE_NS = 10**9
"""Jumps that differ by less from an hour are changes of the clock; a pause is hardly ever that long to a second."""


def rounded_step(cells: Iterable[str | None]) -> tuple[float, str]:
    """The largest step to which cells such as 1.70000E+18 are rounded, in their unit, and the cell; 0 if none is."""
    found = ((_EXPONENT.fullmatch(cell.strip()), cell) for cell in islice(cells, _SHOWN) if cell is not None)
    exponents = [(int(match[2]) - len(match[1] or ""), cell) for match, cell in found if match is not None]
    steps = [(10.0 ** min(exponent, _GREATEST_EXPONENT), cell) for exponent, cell in exponents]
    return max(steps, default=(0.0, ""))


_FIELDS = re.compile(r"[;,\s]+")
_LARGE_STEP = 1000.0
"""A spreadsheet rounds numbers of more than 11 digits to 6: to a larger step."""


def rounded_number(line: bytes) -> str:
    """The number of a table's line that is rounded the most, if as by a spreadsheet; else empty."""
    step, cell = rounded_step(_FIELDS.split(line.decode(errors="replace")))
    return cell if step > _LARGE_STEP else ""


def have_fractions(cells: Sequence[str]) -> bool:
    """Whether times have a fraction, like seconds; those of the formats of sessions are whole numbers."""
    return bool(cells) and all(map(_FRACTION.fullmatch, cells))


def shared_times(time_ns: IntArray) -> bool:
    """Whether so many readings of an inertial sensor have the same time that the times are rounded."""
    return len(time_ns) >= MIN_STEPS and len(np.unique(time_ns)) * _ALIKE <= len(time_ns)


def clock_change(time_ns: IntArray) -> int | None:
    """Index of the first of times (k,) at which the clock was set forward or back by an hour; None if it was not."""
    steps = np.diff(time_ns)
    usual = int(np.median(steps)) if len(steps) >= MIN_STEPS else HOUR_NS
    if not 0 <= usual < HOUR_NS // 6:
        return None
    found = np.flatnonzero(np.abs(np.abs(steps - usual) - HOUR_NS) <= _CLOCK_CHANGE_NS + usual // 2)
    return int(found[0]) + 1 if len(found) == 1 else None


FRAMES = Steps(1 / 300, 10.0)
"""No tracker has 300 frames a second; some apps log a pose at keyframes only."""
READINGS = Steps(2e-4, 2.0)
"""Inertial sensors give up to 1,000 readings a second; some loggers write them in blocks."""
SCANS = Steps(0.05, 600.0)
MAX_AFTER_S = 5.0
"""Scans do not end later than the frames and sensors of their recording by more."""
ANY = Steps(0.0, np.inf)
"""For times without a rate, such as presses."""
DURATION = Steps(1.0, 86_400.0)
"""Possible durations of a walk."""
MIN_STEPS = 10
"""The duration is judged only with at least this many steps."""
_UNIX_S = (1_262_304_000.0, 2_051_222_400.0)
"""Unix time from 2010 to 2035; a clock that starts with the phone never reaches such values in nanoseconds."""


_DAY_NS = 24 * HOUR_NS
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
Span: TypeAlias = tuple[int, int]


def unix_span(time_ns: IntArray, ahead_ns: int | None) -> Span | None:
    """First and last of times (k,), ns, as Unix time; None if unknown.

    ``ahead_ns`` is how far Unix time is ahead of their clock; times that are Unix time need none.
    """
    if not len(time_ns):
        return None
    first, last = int(time_ns.min()), int(time_ns.max())
    if first >= _UNIX_S[0] * 1e9:
        ahead_ns = 0
    return None if ahead_ns is None else (first + ahead_ns, last + ahead_ns)


def other_day(what: str, theirs: Span | None, walk: str, ours: Span | None) -> str | None:
    """Say that a recording and a walk (:func:`unix_span`) are more than a day apart; None if not, or unknown."""
    if theirs is None or ours is None or max(theirs[0] - ours[1], ours[0] - theirs[1]) <= _DAY_NS:
        return None
    return (
        f"{what} was recorded on {_written(*theirs)}, {walk} on {_written(*ours)}: not the same walk; choose the "
        "recording of that day"
    )


def _written(first_ns: int, last_ns: int) -> str:
    first, last = (_EPOCH + timedelta(microseconds=ns // 1000) for ns in (first_ns, last_ns))
    until = f"{last:%H:%M}" if last.date() == first.date() else f"{last:%Y-%m-%d %H:%M}"
    return f"{first:%Y-%m-%d %H:%M} to {until} (UTC)"


@dataclass(frozen=True)
class _Times:
    """Times as read, ns: ``step_ns`` usual interval, NaN if unknown; ``span_ns`` duration, NaN if there are few
    steps."""

    first_ns: float
    last_ns: float
    step_ns: float
    span_ns: float
    steps: Steps
    clock_ns: tuple[float, float] | None

    @classmethod
    def of(cls, time_ns: IntArray, rate_ns: IntArray, steps: Steps, clock_ns: IntArray | None) -> _Times:
        apart = np.diff(np.unique(rate_ns))
        # Gaps are not steps; rows that are logged in pairs or blocks have the mean interval.
        usual = float(apart[apart <= np.quantile(apart, 0.99, method="higher")].mean()) if len(apart) else np.nan
        known = steps is not ANY and len(apart) >= MIN_STEPS
        clock = (float(clock_ns.min()), float(clock_ns.max())) if clock_ns is not None and len(clock_ns) else None
        span = usual * len(apart) if known else np.nan
        return cls(float(time_ns.min()), float(time_ns.max()), usual, span, steps, clock)

    def possible(self, factor: float) -> bool:
        """Whether the times, multiplied by a factor, have a possible rate and duration."""
        rate = np.isnan(self.step_ns) or self.steps.contain(self.step_ns * factor)
        return rate and (np.isnan(self.span_ns) or DURATION.contain(self.span_ns * factor))

    @property
    def as_stated(self) -> bool:
        """Whether the stated unit is possible. Slow rows are possible, because tables have gaps."""
        if self.is_unix(1.0):
            return True
        too_fast = self.step_ns < self.steps.least_s * 1e9
        return not too_fast and (np.isnan(self.span_ns) or DURATION.contain(self.span_ns))

    def meet(self, factor: float) -> bool:
        """Whether the times, multiplied by a factor, overlap the clock; true if there is none."""
        if self.clock_ns is None:
            return True
        return self.first_ns * factor <= self.clock_ns[1] and self.last_ns * factor >= self.clock_ns[0]

    def is_unix(self, factor: float) -> bool:
        """Whether the times, multiplied by a factor, are recent Unix time."""
        return _UNIX_S[0] <= self.first_ns * factor / 1e9 and self.last_ns * factor / 1e9 <= _UNIX_S[1]


def recognised_ns(
    time_ns: IntArray, rate_ns: IntArray, steps: Steps, file: str, stated: str, clock_ns: IntArray | None = None
) -> tuple[IntArray, list[Finding]]:
    """Return times (k,) that were read in the ``stated`` unit, in ns, and a finding if they are in another unit.

    ``rate_ns`` (r,) are the times of the rows whose interval ``steps`` limits; ``clock_ns`` those of usable frames or
    of sensor readings. The stated unit stays if it makes rate and duration possible and the times overlap the clock.
    Otherwise a unit that does all this replaces it: one that makes the times Unix time, else the shortest. If only the
    clock contradicts the stated unit, it is replaced only if exactly one other unit fits.
    """
    if len(time_ns) == 0:
        return time_ns, []
    times = _Times.of(time_ns, rate_ns, steps, clock_ns)
    if times.as_stated and times.meet(1.0):
        return time_ns, []
    greatest = float(np.abs(time_ns).max())
    factors = {unit: ns / NS_OF[stated] for unit, ns in NS_OF.items() if unit != stated}
    units = [
        unit
        for unit, factor in factors.items()
        if times.possible(factor) and times.meet(factor) and greatest * factor < _GREATEST_NS
    ]
    units = [unit for unit in units if times.is_unix(factors[unit])] or units
    if not units or (len(units) > 1 and times.as_stated):
        return time_ns, []
    unit, true, read = units[0], NS_OF[units[0]], NS_OF[stated]
    converted = time_ns * (true // read) if true > read else time_ns // (read // true)
    reason = "only then do they overlap with the frames or readings"
    if not times.as_stated:
        reason = f"rows come every {times.step_ns * true / read / 1e9:.3g} s"
    message = _other_unit(stated, unit, reason)
    return converted, [Finding(kind="time_unit", file=file, count=len(time_ns), message=message)]


def ns_of_seconds(times: FloatArray, steps: Steps, file: str) -> tuple[IntArray, list[Finding]]:
    """Return times (k,) that are stated in seconds, in ns, and a finding if they are in another unit.

    Times that do not fit into 64 bits in any unit become the greatest that do.
    """
    unit = unix_unit(times)
    with np.errstate(over="ignore"):
        scaled = np.nan_to_num(times * NS_OF[unit])
    time_ns = np.round(np.clip(scaled, -(2.0**62), 2.0**62)).astype(np.int64)
    if shared_times(time_ns):
        message = f"most rows share their time with others, so times are rounded; {ROUNDED}"
        return time_ns, [Finding(kind="rounded_times", file=file, count=len(times), message=message)]
    if unit == "seconds":
        return recognised_ns(time_ns, time_ns, steps, file, "seconds")
    return time_ns, [not_in_seconds(unit, file, len(times))]


def unix_unit(times: FloatArray | IntArray) -> str:
    """The unit (a key of :data:`NS_OF`) that makes most of the times (k,) dates from 2010 to 2035; else seconds."""
    middle = float(np.median(np.abs(times))) if len(times) else 0.0
    return next((unit for unit, ns in NS_OF.items() if _UNIX_S[0] <= middle * ns / 1e9 <= _UNIX_S[1]), "seconds")


def are_dates(times_s: pl.Series) -> pl.Series:
    """Whether times (k,) in seconds are dates from 2010 to 2035."""
    return times_s.is_between(*_UNIX_S)


def not_in_seconds(unit: str, file: str, count: int) -> Finding:
    """Report ``count`` times that are stated in seconds, and are read as another unit of Unix time."""
    message = _other_unit("seconds", unit, "only then are they dates from 2010 to 2035")
    return Finding(kind="time_unit", file=file, count=count, message=message)


def _other_unit(stated: str, unit: str, reason: str) -> str:
    return f"times must be in {stated}, but these are in {unit} ({reason}); they are read as {unit}"
