"""Slips of a tracker: where its way and that of the inertial sensors part, although it reports no loss.

Steps that a slip takes seconds for fit their neighbours; only sensors that do not slip along tell it from walking.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, runs_of

WINDOW_S, HOP_S = 1.0, 0.25
"""Ways are compared over windows so long, begun so often."""
BESIDE = 5
"""So many windows on each side tell heading and scale of the inertial path."""
LEAST_WAY_M2 = 2.0
"""Of them, lengths squared and summed: who walked less told no heading."""
UNUSUAL = 6.0
"""A slip leads farther off than this many times what such windows of the same walk usually do, per axis ..."""
LEAST_M = 0.3
"""... and at least this far."""
CLEAREST = 0.8
"""Of windows one after the other those count that show nearly as much as the clearest one."""
MEDIAN_SIGMAS = 1.18
"""Median length of a normal error of two dimensions, in standard deviations per axis."""


@dataclass(frozen=True)
class Slip:
    """Steps ``start`` to ``stop`` (excluded) of a tracker's path, which led it off by ``off``, complex metres."""

    start: int
    stop: int
    off: complex


def tracker_slips(time_s: FloatArray, told: ComplexArray, felt: ComplexArray, sound: BoolArray) -> list[Slip]:
    """Find slips of a tracker's path ``told`` (n,) against the inertial one ``felt`` (n,), both complex metres.

    ``sound`` (n - 1,) are the steps of which both tell. Slips that last longer than a window are not found.
    """
    start_s = np.arange(time_s[0], time_s[-1] - WINDOW_S, HOP_S)
    end_s = start_s + WINDOW_S
    if not len(start_s):
        return []
    unsound = np.concatenate(([0.0], np.cumsum(~sound)))
    moved, walked, broken = (
        np.interp(end_s, time_s, path) - np.interp(start_s, time_s, path) for path in (told, felt, unsound)
    )
    whole = broken == 0
    alike = _beside(np.where(whole, walked.conj() * moved, 0))
    way_m2 = _beside(np.where(whole, np.abs(walked) ** 2, 0)).real
    known = whole & (way_m2 > LEAST_WAY_M2)
    off = np.where(known, moved - walked * alike / np.where(known, way_m2, 1), 0)
    usual_m = float(np.median(np.abs(off[known]))) / MEDIAN_SIGMAS if known.any() else 0.0
    found = []
    for first, after in runs_of(np.abs(off) > max(UNUSUAL * usual_m, LEAST_M)):
        size = np.abs(off[first:after])
        clear = first + np.flatnonzero(size > CLEAREST * size.max())
        start, stop = np.searchsorted(time_s, (start_s[clear[0]], end_s[clear[-1]])).tolist()
        found.append(Slip(start, stop, complex(off[first + int(size.argmax())])))
    return found


def _beside(values: ComplexArray) -> ComplexArray:
    """Sums (m,) of values (m,) of the windows beside each that do not overlap it nor one another."""
    hops = round(WINDOW_S / HOP_S)
    padded = np.pad(values, BESIDE * hops)
    shifts = [BESIDE * hops + side * hops * number for number in range(1, BESIDE + 1) for side in (-1, 1)]
    return np.asarray(sum(padded[shift : shift + len(values)] for shift in shifts), dtype=np.complex128)
