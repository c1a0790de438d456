"""Beside which place of another walk a walk felt the field that the other felt there.

Windows of the field along the two ways are laid upon one another, head-on ones turned round, at every shift that the
paths' sigmas allow; each window without its mean, for phones add fields of their own. What fits best counts where it
fits well, and much better than anything farther away (sequence matching; Subbu et al. 2013).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np
from scipy.spatial import KDTree

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.walk_ties.felt_ways import STEP_M, FeltWay

HALF = 16
"""Windows reach so many steps to either side: 8 m together."""
REACH_SIGMAS, LEAST_REACH_M, MOST_REACH_M = 3.0, 1.5, 6.0
"""Another walk's place is looked for within so many sigmas of how far both are off, along the course and across."""
MOST_ASIDE_M = 4.0
"""Farther aside the field is another."""
ALIKE_COURSE = 0.9
"""Cosine between courses that are alike, or opposite."""
UNLIKE = 0.35
"""Of two windows that differ by a greater share of their variance neither is the other's."""
APART_M, CLEARLY = 1.5, 1.8
"""Shifts so much away from the best one must fit worse by this factor."""
LEAST_SLOPE_UT_M = 0.7
"""Fields that change less along the way say nothing."""
NOISE_SHARE, LEAST_M = 0.5, 0.1
"""A match is expected to be off by this share of the difference over the field's slope, and a little, up to a factor
that is estimated."""
MOST_WALKS, MOST_MARKS, MARK_STEPS = 8, 128, 8
"""Most walks that a place is compared with, nearest first; found by so many marks, one in so many steps of a walk."""


class Match(NamedTuple):
    """How far ahead along the walk's course the other walk puts it; expected error squared, and sigma of the other."""

    walk: int
    shift_m: float
    variance_m2: float
    sigma_m: float


@dataclass(frozen=True)
class FeltFloor:
    """The ways of a floor's walks, and a tree of their marks (k,), of which ``walk`` (k,) is the walk's number."""

    ways: Sequence[FeltWay | None]
    tree: KDTree
    walk: IntArray

    @classmethod
    def of(cls, ways: Sequence[FeltWay | None]) -> Self:
        """Mark each way."""
        marks = [np.empty((0, 2)) if way is None else way.place[::MARK_STEPS] for way in ways]
        return cls(ways, KDTree(np.concatenate(marks)), np.repeat(np.arange(len(ways)), [len(one) for one in marks]))

    def matches(self, number: int, rows: IntArray) -> list[list[Match]]:
        """Of each of some steps (k,) of a walk those of other walks that felt the same there."""
        own = self.ways[number]
        if own is None or not len(rows):
            return [[] for _ in rows]
        reach_m = np.hypot(MOST_REACH_M, MOST_ASIDE_M)
        marks = self.tree.query(own.place[rows], min(MOST_MARKS, len(self.walk)), distance_upper_bound=reach_m)[1]
        felt = windows(own.field_ut, rows)
        return [self._at(number, *each) for each in zip(rows.tolist(), felt, marks.reshape(len(rows), -1), strict=True)]

    def _at(self, number: int, row: int, felt: FloatArray, marks: IntArray) -> list[Match]:
        """Matches of one step, whose window is (w, 2), with walks of marks (k,), of which the tree's size stands for
        none.
        """
        slope_ut_m = float(np.sqrt((np.diff(felt, axis=0) ** 2).sum(axis=1).mean())) / STEP_M
        if not slope_ut_m > LEAST_SLOPE_UT_M:  # or not known
            return []
        walks = [one for one in dict.fromkeys(self.walk[marks[marks < len(self.walk)]].tolist()) if one != number]
        own, ways = self.ways[number], [(one, self.ways[one]) for one in walks[:MOST_WALKS]]
        assert own is not None
        found = [(one, way, _best(own, row, felt, way)) for one, way in ways if way is not None]
        return [
            Match(one, fit.shift_m, (NOISE_SHARE * fit.noise_ut / slope_ut_m) ** 2 + LEAST_M**2, way.sigma_m[fit.step])
            for one, way, fit in found
            if fit is not None
        ]


class _Fit(NamedTuple):
    """The best shift, the step of the other walk, and by how much windows differ there, microtesla."""

    shift_m: float
    step: int
    noise_ut: float


def windows(field_ut: FloatArray, rows: IntArray) -> FloatArray:
    """(k, w, 2) the field about steps (k,) without its mean; NaN where one is not felt in whole."""
    at = rows[:, None] + np.arange(-HALF, HALF + 1)
    inside = (at >= 0) & (at < len(field_ut))
    found = np.where(inside[..., None], field_ut[at.clip(0, len(field_ut) - 1)], np.nan)
    return np.asarray(found - found.mean(axis=1, keepdims=True))


def _best(own: FeltWay, row: int, felt: FloatArray, way: FeltWay) -> _Fit | None:
    """Where along another way the field was most like a window (w, 2) of a walk; None where that is not clear."""
    steps, ahead_m, same = _candidates(own, row, way)
    if not len(steps):
        return None
    other = windows(way.field_ut, steps)
    other = np.where(same[:, None, None], other, other[:, ::-1])
    square = ((other - felt) ** 2).sum(axis=(1, 2))
    unlike = square / ((felt**2).sum() + (other**2).sum(axis=(1, 2)))
    unlike = np.where(np.isfinite(unlike), unlike, np.inf)
    best = int(unlike.argmin())
    elsewhere = float(unlike[np.abs(ahead_m - ahead_m[best]) > APART_M].min(initial=np.inf))
    whole = 0 < best < len(steps) - 1 and steps[best + 1] - steps[best - 1] == 2
    if not whole or unlike[best] > UNLIKE or elsewhere < CLEARLY * unlike[best]:
        return None
    before, least, after = unlike[best - 1 : best + 2]
    bend = before - 2 * least + after
    off = np.clip((before - after) / (2 * bend), -0.5, 0.5) if 0 < bend < np.inf else 0.0
    shift_m = ahead_m[best] + off * (ahead_m[best + 1] - ahead_m[best - 1]) / 2
    return _Fit(float(shift_m), int(steps[best]), float(np.sqrt(square[best] / len(felt))))


def _candidates(own: FeltWay, row: int, way: FeltWay) -> tuple[IntArray, FloatArray, BoolArray]:
    """Steps (k,) of another way that may lie where a walk was, in order; how far ahead of it they seem to lie, and
    whether they lead the same way.
    """
    course = own.course[row]
    away = way.place - own.place[row]
    ahead_m, aside_m = away @ course, np.abs(away @ (-course[1], course[0]))
    turn = way.course @ course
    reach_m = np.clip(REACH_SIGMAS * np.hypot(own.sigma_m[row], way.sigma_m), LEAST_REACH_M, MOST_REACH_M)
    near = (np.abs(ahead_m) < reach_m) & (aside_m < np.minimum(reach_m, MOST_ASIDE_M))
    steps = np.flatnonzero(near & (np.abs(turn) > ALIKE_COURSE))
    return steps, ahead_m[steps], turn[steps] > 0
