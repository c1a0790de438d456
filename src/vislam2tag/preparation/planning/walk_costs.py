"""What a set of landmarks costs on typical walks: the mean square error to expect, quick enough to try many sets.

Between two passes a label's variance depends on the way between them, before the first and after the last on the way to
it. Both are tabulated once, from the smoother's own equations on straight walks (:mod:`prediction`); the cost of a walk
is then a sum over its gaps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial import KDTree

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.preparation.planning.prediction import LEAST_BETWEEN_M, PASSED_M, PassedLandmarks, expected_along

GAPS_M = (1.0, 2.0, 4.0, 7.0, 11.0, 16.0, 22.0, 30.0, 45.0, 70.0, 110.0)
"""Gaps for which the model is solved; the cost of others lies between them."""
PASSES = 5
"""Passes of a tabulated walk."""
STEP_M = 0.1
OFF_WAY_M = 1.0


@dataclass(frozen=True)
class GapCosts:
    """Sums of the variance per axis over a gap of each length, m^2 times m; ``ends`` of one with a pass on one side."""

    between: FloatArray
    ends: FloatArray

    def of_walk(self, passes_m: FloatArray, length_m: float) -> float:
        """Cost of a walk with passes at these distances (p,), sorted, from its start."""
        if not len(passes_m):
            return 2 * float(np.interp(length_m, GAPS_M, self.ends))
        gaps = np.interp(np.diff(passes_m), GAPS_M, self.between).sum()
        ends = np.interp([passes_m[0], length_m - passes_m[-1]], GAPS_M, self.ends).sum()
        return float(gaps + ends)


@cache
def gap_costs(survey_sigma_m: float) -> GapCosts:
    """Solve straight walks with evenly spaced landmarks."""
    between, ends = [0.0], [0.0]
    for gap in GAPS_M[1:]:
        x = np.arange(0.0, PASSES * gap + STEP_M / 2, STEP_M)
        foot = np.column_stack((np.arange(PASSES) * gap, np.zeros(PASSES)))
        sheets = PassedLandmarks(foot + np.array((0.0, OFF_WAY_M)), foot, np.full(PASSES, 0.5))
        expected = expected_along(np.column_stack((x, np.zeros_like(x))), sheets, survey_sigma_m)
        assert expected is not None
        inner = (x >= 2 * gap) & (x < 3 * gap)
        between.append(float(expected.variance_m2[inner].sum() * STEP_M))
        ends.append(float(expected.variance_m2[x >= (PASSES - 1) * gap].sum() * STEP_M))
    between[0], ends[0] = between[1] / 2, ends[1] / 2
    return GapCosts(np.array(between), np.array(ends))


@dataclass(frozen=True)
class StationPasses:
    """Where walks come by stations: ``walk`` and ``at_m`` (k,) of each pass, sorted by station; those of station ``s``
    are ``offsets[s]:offsets[s + 1]``. ``length_m`` of each walk.
    """

    walk: IntArray
    at_m: FloatArray
    offsets: IntArray
    length_m: tuple[float, ...]

    @classmethod
    def of(cls, walks: Sequence[FloatArray], points: FloatArray) -> StationPasses:
        """Find the passes of all stations ``points`` (s, 2) on some walks."""
        tree = KDTree(points)
        found = [_passes(arc_lengths(walk), KDTree(walk), tree) for walk in walks]
        station = np.concatenate([*(part[0] for part in found), np.zeros(0, dtype=np.int64)])
        walk = np.repeat(np.arange(len(walks)), [len(part[0]) for part in found])
        at_m = np.concatenate([*(part[1] for part in found), np.zeros(0)])
        order = np.lexsort((at_m, walk, station))
        offsets = np.searchsorted(station[order], np.arange(len(points) + 1))
        lengths = tuple(float(arc_lengths(walk)[-1]) for walk in walks)
        return cls(walk[order].astype(np.int64), at_m[order], offsets.astype(np.int64), lengths)

    def of_station(self, station: int) -> slice:
        """Rows of one station."""
        return slice(int(self.offsets[station]), int(self.offsets[station + 1]))


def _passes(at_m: FloatArray, walk: KDTree, stations: KDTree) -> tuple[IntArray, FloatArray]:
    """Stations (k,) that one walk comes by and how far along (k,) it is nearest, once each time."""
    near = walk.sparse_distance_matrix(stations, PASSED_M, output_type="ndarray")
    order = np.lexsort((near["i"], near["j"]))
    sample, station, away = near["i"][order], near["j"][order], near["v"][order]
    if not len(sample):
        return np.zeros(0, dtype=np.int64), np.zeros(0)
    anew = (np.diff(station) != 0) | (np.diff(at_m[sample]) > LEAST_BETWEEN_M)
    visit = np.concatenate(([0], np.cumsum(anew)))
    best = np.lexsort((away, visit))[np.searchsorted(visit, np.arange(visit[-1] + 1))]
    return station[best].astype(np.int64), at_m[sample[best]]


class WalkCosts:
    """The cost of a set of stations that changes by one station at a time."""

    def __init__(self, passes: StationPasses, costs: GapCosts, chosen: BoolArray) -> None:
        self._passes, self._costs = passes, costs
        self._at: list[FloatArray] = [np.zeros(0) for _ in passes.length_m]
        for station in np.flatnonzero(chosen).tolist():
            for walk, at in self._by_walk(station).items():
                self._at[walk] = np.sort(np.concatenate((self._at[walk], at)))
        self._cost = [costs.of_walk(at, length) for at, length in zip(self._at, passes.length_m, strict=True)]

    @property
    def total(self) -> float:
        """Cost of all walks."""
        return float(np.sum(self._cost))

    def gain(self, old: int, new: int) -> float:
        """By how much the cost falls with a landmark at ``new`` instead of ``old``."""
        return sum(self._cost[walk] - cost for walk, (_, cost) in self._after(old, new).items())

    def move(self, old: int, new: int) -> None:
        """Put the landmark of ``old`` at ``new``."""
        for walk, (at, cost) in self._after(old, new).items():
            self._at[walk], self._cost[walk] = at, cost

    def _after(self, old: int, new: int) -> dict[int, tuple[FloatArray, float]]:
        """Passes (p,) and cost of the walks that change where the landmark of ``old`` goes to ``new``."""
        gone, come = self._by_walk(old), self._by_walk(new)
        after = {}
        for walk in sorted(gone.keys() | come.keys()):
            at = self._at[walk]
            if walk in gone:
                # Two stations are never passed at exactly the same place of a walk but by being the same.
                at = np.delete(at, np.searchsorted(at, gone[walk]))
            if walk in come:
                at = np.sort(np.concatenate((at, come[walk])))
            after[walk] = (at, self._costs.of_walk(at, self._passes.length_m[walk]))
        return after

    def _by_walk(self, station: int) -> dict[int, FloatArray]:
        """Passes (p,) of a station by walk, metres from the walk's start."""
        rows = self._passes.of_station(station)
        walks, at = self._passes.walk[rows], self._passes.at_m[rows]
        return {int(walk): at[walks == walk] for walk in np.unique(walks)}
