"""A walk cut into stretches that are rigid enough to be laid over a plan as one piece."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.estimation.odometry import Odometry

SAMPLE_S = 0.3
"""Interval of the positions between which way is measured; a phone in the hand sways within a step."""
SPACING_M = 0.2
"""Distance of the points that stand for a stretch."""
LENGTH_M, SHORTEST_M = 12.0, 2.0
GAP_M, GAP_RAD = 0.3, 0.15
"""A stretch ends where the tracker's place or turn is less certain than this (standard deviation)."""
BETWEEN_FLOORS = -(2**31)
"""Instead of a floor's number: on stairs or in a lift, of which plans show little."""


@dataclass(frozen=True)
class Stretch:
    """``points`` (k,) complex, metres in the continuous frame, every :data:`SPACING_M` of the way from frame ``first``
    to frame ``last`` of the odometry; ``middle`` is their mean. ``floor`` is its floor's number, if that is known.
    """

    first: int
    last: int
    points: ComplexArray
    floor: int | None = None

    @cached_property
    def middle(self) -> complex:
        """Mean of the points, complex metres."""
        return complex(self.points.mean())

    @property
    def shape(self) -> ComplexArray:
        """(k,) points relative to their middle."""
        return np.asarray(self.points - self.middle)

    @property
    def way_m(self) -> float:
        """Length of the way, metres."""
        return SPACING_M * len(self.points)


@dataclass(frozen=True)
class Link:
    """How one stretch leads to the next: ``step`` between their middles, complex metres in the continuous frame, and
    the standard deviations of its error per axis, metres, and of the turn, rad. ``jumps`` counts unconnected steps.
    """

    step: complex
    way_m: float
    sigma_m: float
    sigma_rad: float
    jumps: int


@dataclass(frozen=True)
class Stretches:
    """A walk's ``s`` stretches and the ``s - 1`` links between them."""

    stretches: tuple[Stretch, ...]
    links: tuple[Link, ...]

    @property
    def way_m(self) -> float:
        """Length of the way in all stretches, metres."""
        return sum(stretch.way_m for stretch in self.stretches)


def stretches_of(odometry: Odometry, length_m: float = LENGTH_M, floor: IntArray | None = None) -> Stretches:
    """Cut a walk; stretches shorter than :data:`SHORTEST_M` join the one before, or are left out between gaps.

    ``floor`` (n,) is the number of each frame's floor, or :data:`BETWEEN_FLOORS`; such frames are left out.
    """
    knots = np.unique(np.searchsorted(odometry.time_s, np.arange(0, odometry.time_s[-1] + SAMPLE_S, SAMPLE_S)))
    knots = np.unique(np.append(knots, len(odometry.path) - 1)[: len(knots) + 1].clip(0, len(odometry.path) - 1))
    place_m2 = np.concatenate(([0.0], np.cumsum(odometry.jump_m2)))
    turn_rad2 = np.concatenate(([0.0], np.cumsum(odometry.jump_rad2)))
    jumps = np.concatenate(([0], np.cumsum(odometry.jumped)))
    gap = (np.diff(place_m2[knots]) > GAP_M**2) | (np.diff(turn_rad2[knots]) > GAP_RAD**2)
    if floor is not None:
        gap |= np.diff(floor[knots]) != 0
    pieces: list[Stretch] = []
    for start, stop in _runs(gap):
        number = None if floor is None else int(floor[knots[start]])
        if number != BETWEEN_FLOORS:
            pieces += _cut(odometry.path, knots[start : stop + 1], length_m, number)
    links = tuple(_link(before, after, place_m2, turn_rad2, jumps) for before, after in pairwise(pieces))
    return Stretches(tuple(pieces), links)


def _runs(gap: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> list[tuple[int, int]]:
    """First and last knot of each run without a gap between neighbouring knots (k - 1,)."""
    ends = np.flatnonzero(gap)
    return list(zip([0, *(ends + 1).tolist()], [*ends.tolist(), len(gap)], strict=True))


def _cut(path: ComplexArray, knots: IntArray, length_m: float, floor: int | None) -> list[Stretch]:
    """Stretches of about equal length between the knots (k,) of a run on a floor, frames of the path (n,)."""
    place = path[knots]
    along = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(place)))))
    if along[-1] < SHORTEST_M:
        return []
    count = max(1, round(along[-1] / length_m))
    edges = np.linspace(0, along[-1], count + 1)
    found = []
    for low, high in pairwise(edges.tolist()):
        at = np.arange(low + SPACING_M / 2, high, SPACING_M)
        points = np.interp(at, along, place.real) + 1j * np.interp(at, along, place.imag)
        first, last = np.interp((low, high), along, knots).round().astype(np.int64).tolist()
        found.append(Stretch(first, last, points, floor))
    return found


def _link(before: Stretch, after: Stretch, place_m2: FloatArray, turn_rad2: FloatArray, jumps: IntArray) -> Link:
    middles = [(one.first + one.last) // 2 for one in (before, after)]
    way_m = max((before.way_m + after.way_m) / 2, abs(after.middle - before.middle))
    return Link(
        step=after.middle - before.middle,
        way_m=way_m,
        sigma_m=float(np.sqrt(max(place_m2[middles[1]] - place_m2[middles[0]], 0.0))),
        sigma_rad=float(np.sqrt(max(turn_rad2[middles[1]] - turn_rad2[middles[0]], 0.0))),
        jumps=int(jumps[middles[1]] - jumps[middles[0]]),
    )
