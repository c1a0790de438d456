"""Detect the unit of a table's times if the stated unit is impossible, by rate, duration and the clock of other
tables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import IntArray

NS_OF = {"nanoseconds": 1, "microseconds": 10**3, "milliseconds": 10**6, "seconds": 10**9}
_GREATEST_NS = 2**63 - 1


@dataclass(frozen=True)
class Steps:
    """Possible intervals between rows, seconds."""

    least_s: float
    greatest_s: float

    def contain(self, step_ns: float) -> bool:
        """Whether this usual interval is possible."""
        return self.least_s * 1e9 <= step_ns <= self.greatest_s * 1e9


FRAMES = Steps(1 / 300, 10.0)
"""No tracker has 300 frames a second; some apps log a pose at keyframes only."""
READINGS = Steps(2e-4, 2.0)
"""Inertial sensors give up to 1,000 readings a second; some loggers write them in blocks."""
SCANS = Steps(0.05, 600.0)
ANY = Steps(0.0, np.inf)
"""For times without a rate, such as presses."""
DURATION = Steps(1.0, 86_400.0)
"""Possible durations of a walk."""
MIN_STEPS = 10
"""The duration is judged only with at least this many steps."""
_UNIX_S = (1_262_304_000.0, 2_051_222_400.0)
"""Unix time from 2010 to 2035; a clock that starts with the phone never reaches such values in nanoseconds."""


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
    message = f"times must be in {stated}, but these are in {unit} ({reason}); they are read as {unit}"
    return converted, [Finding(kind="time_unit", file=file, count=len(time_ns), message=message)]
