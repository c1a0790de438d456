"""Positions between places that a walker tapped at: straight, at a constant pace, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory

TAP_SIGMA_M = 0.3
"""Where the walker stands when tapping, against the place tapped at; one standard deviation per axis."""
PACE_M2_S = 0.25
"""How fast the variance of a walker at an uneven pace grows from a tap on (m^2/s), as a Brownian bridge between two.

From real walks: inner taps left out and interpolated (docs/reference/importing.md, "Positions between taps")."""
FARTHEST_M = 10_000.0
"""No site is larger: a tap farther away than this is a fault."""
LONGEST_LEG_S = 600.0
"""Nobody walks straight for longer: between taps farther apart in time nothing is known."""
_STEP_NS = 500_000_000
"""Frames are made this far apart, so that sigma between them is nearly linear."""


@dataclass(frozen=True)
class Waypoints:
    """Taps of one walk in time order, each time once: ``time_ns`` (n,), ``position`` (n, 2) metres, ``floor`` (n,)."""

    time_ns: IntArray
    position: FloatArray
    floor: IntArray

    @classmethod
    def of(cls, time_ns: IntArray, position: FloatArray, floor: IntArray) -> Waypoints:
        """Put taps (n,) into time order; of several at one time the first counts."""
        order = np.unique(time_ns, return_index=True)[1]
        return cls(time_ns[order], position[order], floor[order])

    def __len__(self) -> int:
        """Return how many taps there are."""
        return len(self.time_ns)

    @property
    def leg_m(self) -> FloatArray:
        """Straight way (n - 1,) from each tap to the next, metres; 0 where it is not known."""
        known: FloatArray = np.where(self.straight, np.linalg.norm(np.diff(self.position, axis=0), axis=1), 0.0)
        return known

    @property
    def straight(self) -> BoolArray:
        """Mask (n - 1,) of the legs that were walked straight: on one floor and not for too long."""
        known: BoolArray = (np.diff(self.floor) == 0) & (np.diff(self.time_ns) <= LONGEST_LEG_S * 1e9)
        return known


def trajectory_between(taps: Waypoints) -> Trajectory:
    """Make frames at the taps and between them; there are none before the first and after the last.

    Between two taps on different floors, or too far apart in time, lies a frame without a position (``gap``): how the
    walker went there is not known. The variance per axis is ``TAP_SIGMA_M^2 + PACE_M2_S a b / (a + b)``, a and b
    seconds from and to a tap.
    """
    time_ns = _frame_times(taps)
    leg = np.clip(np.searchsorted(taps.time_ns, time_ns, side="right") - 1, 0, max(len(taps) - 2, 0))
    end = np.minimum(leg + 1, len(taps) - 1)
    since, until = (time_ns - taps.time_ns[leg]) * 1e-9, (taps.time_ns[end] - time_ns) * 1e-9
    whole = np.maximum(since + until, 1e-9)
    variance = TAP_SIGMA_M**2 + PACE_M2_S * since * until / whole
    position = taps.position[leg] + (since / whole)[:, None] * (taps.position[end] - taps.position[leg])
    at_tap = (since == 0) | (until == 0)
    unknown = ~np.append(taps.straight, True)[leg] & ~at_tap
    variance[unknown], position[unknown] = np.nan, np.nan
    return Trajectory(
        time_ns=time_ns,
        position_bcs=np.column_stack((position, np.full(len(time_ns), np.nan))),
        orientation_bcs=np.full((len(time_ns), 4), np.nan),
        covariance_bcs=variance[:, None, None] * np.eye(2),
        status=np.where(unknown, np.int8(Status.GAP), np.int8(Status.OK)),
        floor=np.where(until == 0, taps.floor[end], taps.floor[leg]),
    )


def _frame_times(taps: Waypoints) -> IntArray:
    """Times (k,), ns, of the taps and of enough moments between them (at least one)."""
    if len(taps) < 2:
        return taps.time_ns
    frames = np.where(taps.straight, np.maximum(-(-np.diff(taps.time_ns) // _STEP_NS), 2), 2)
    spans = [
        np.linspace(start, end, count, endpoint=False).round().astype(np.int64)
        for start, end, count in zip(taps.time_ns[:-1], taps.time_ns[1:], frames.tolist(), strict=True)
    ]
    times: IntArray = np.unique(np.concatenate((*spans, taps.time_ns)))
    return times
