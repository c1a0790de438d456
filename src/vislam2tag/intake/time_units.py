"""The unit of a table's times: recognised if the stated one cannot be, by rate and by the clock of the frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import IntArray

NS_OF = {"nanoseconds": 1, "microseconds": 10**3, "milliseconds": 10**6, "seconds": 10**9}
_GREATEST_NS = 2**63 - 1


@dataclass(frozen=True)
class Steps:
    """How far apart rows may be in time, seconds."""

    least_s: float
    greatest_s: float

    def contain(self, step_ns: float) -> bool:
        """Whether a usual step is possible."""
        return self.least_s * 1e9 <= step_ns <= self.greatest_s * 1e9


FRAMES = Steps(1e-3, 20.0)
"""No camera has 1,000 frames a second; some apps log a pose at keyframes only."""
READINGS = Steps(2e-4, 60.0)
"""Inertial sensors have up to 1,000 readings a second, loggers write some of them in blocks."""
SCANS = Steps(0.05, 600.0)
ANY = Steps(0.0, np.inf)
"""For times that say nothing by their rate, such as presses."""


def recognised_ns(
    time_ns: IntArray, rate_ns: IntArray, steps: Steps, file: str, stated: str, frames_ns: IntArray | None = None
) -> tuple[IntArray, list[Finding]]:
    """Times (k,) that were read in the ``stated`` unit, in ns, and a finding if they are in another unit.

    ``rate_ns`` (r,) are the times of the rows whose distance in time ``steps`` limits; ``frames_ns`` those of usable
    frames. The stated unit is replaced only if it makes rows come impossibly fast, by the shortest that does not; or if
    its times never meet the frames, and exactly one other unit mends that.
    """
    if len(time_ns) == 0:
        return time_ns, []
    step = np.diff(np.unique(rate_ns))
    usual = float(np.median(step)) if len(step) else np.nan
    too_fast = usual < steps.least_s * 1e9
    if not too_fast and (frames_ns is None or not len(frames_ns) or _meet(time_ns, frames_ns, 1.0)):
        return time_ns, []

    def mends(factor: float) -> bool:
        possible = np.isnan(usual) or steps.contain(usual * factor)
        meets = frames_ns is None or not len(frames_ns) or _meet(time_ns, frames_ns, factor)
        return possible and meets and float(np.abs(time_ns).max()) * factor < _GREATEST_NS

    units = [unit for unit in NS_OF if unit != stated and mends(NS_OF[unit] / NS_OF[stated])]
    if not units or (len(units) > 1 and not too_fast):
        return time_ns, []
    unit, true, read = units[0], NS_OF[units[0]], NS_OF[stated]
    converted = time_ns * (true // read) if true > read else time_ns // (read // true)
    reason = f"rows come every {usual * true / read / 1e9:.3g} s" if too_fast else "only so they meet the camera frames"
    message = f"times must be in {stated}, and are in {unit} ({reason}); they are read as {unit}"
    return converted, [Finding(kind="time_unit", file=file, count=len(time_ns), message=message)]


def _meet(time_ns: IntArray, frames_ns: IntArray, factor: float) -> bool:
    """Whether times, multiplied by a factor, overlap those of frames."""
    first, last = float(time_ns.min()) * factor, float(time_ns.max()) * factor
    return first <= float(frames_ns[-1]) and last >= float(frames_ns[0])
