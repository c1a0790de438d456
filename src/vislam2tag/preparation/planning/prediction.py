"""The label sigma to expect: typical walks past the planned landmarks, solved by the smoother's own equations.

Only the route of a walk is drawn at random. Its passes follow from the landmarks, and the covariance of every frame
from :mod:`vislam2tag.core` as for a real session, at the usual noise of phones. Only what no equation knows before a
walk is measured once in the simulator: how much a phone turns in walking and to look at a sheet.

``WalkCosts`` is quick enough to try many sets of landmarks. Between two passes a label's variance depends on the way
between them, before the first and after the last on the way to it. Both are tabulated once from straight walks; the
cost of a walk is then a sum over its gaps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.spatial import KDTree

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.core.transforms import as_complex
from vislam2tag.estimation.factors import LinearWalk, Model
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import Passes, WalkObservations
from vislam2tag.estimation.odometry import Odometry
from vislam2tag.estimation.reweighting import equivalent_variances
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path
from vislam2tag.estimation.tracker_errors import USUAL, VarianceFactors
from vislam2tag.quality.self_check import expected_error_m

PASSED_M = 0.7
"""A walk that comes so near to a landmark's station passes it."""
SPEED_M_S = 0.85
"""Walking speed, pauses included."""
SWAY_RAD_M = 0.22
"""A phone turns to and fro by so much over a metre walked ..."""
LOOK_RAD = 1.4
"""... and by so much to a sheet, and back."""
LOOK_M = 1.5
"""Over so many metres before a sheet, and after."""
SPREAD_M = 0.02
"""Scatter of the sightings of one pass, per axis."""
LEAST_BETWEEN_M = 4.0
"""Who stays within this of a landmark passes it once."""


@dataclass(frozen=True)
class PassedLandmarks:
    """Landmarks as the prediction needs them: ``position`` (m, 2) on the walls, ``foot`` (m, 2) the points of the
    corridors at which they are passed, ``pass_m`` (m,) the distance then; BCS metres.
    """

    position: FloatArray
    foot: FloatArray
    pass_m: FloatArray

    def with_one(self, position: FloatArray, foot: FloatArray, pass_m: float) -> PassedLandmarks:
        """The same and one more: ``position`` (2,), ``foot`` (2,)."""
        return PassedLandmarks(
            np.vstack((self.position, position[None])),
            np.vstack((self.foot, foot[None])),
            np.append(self.pass_m, pass_m),
        )

    def take(self, rows: IntArray) -> PassedLandmarks:
        """Some of the landmarks, by rows (k,)."""
        return PassedLandmarks(self.position[rows], self.foot[rows], self.pass_m[rows])


@dataclass(frozen=True)
class ExpectedLabels:
    """What is expected along one walk: ``path`` (n, 2) BCS metres and the covariances (n, 2, 2) of its labels."""

    path: FloatArray
    covariance: FloatArray

    @property
    def variance_m2(self) -> FloatArray:
        """(n,) per axis."""
        return np.asarray(np.trace(self.covariance, axis1=1, axis2=2) / 2)


def expected_along(path: FloatArray, sheets: PassedLandmarks, survey_sigma_m: float) -> ExpectedLabels | None:
    """Covariances (n, 2, 2) of the labels of a walk (n, 2); None where it passes no two landmarks apart, so that
    nothing is mapped.
    """
    smoothed = smoothed_walk(path, sheets, survey_sigma_m)
    return None if smoothed is None else ExpectedLabels(path, mapped_path(smoothed)[1])


def smoothed_walk(path: FloatArray, sheets: PassedLandmarks, survey_sigma_m: float) -> SolvedWalk | None:
    """A walk (n, 2) as the smoother would have it once solved; None where it passes no two landmarks."""
    at, landmark = _passes(path, sheets.foot)
    if len(np.unique(landmark)) < 2:
        return None
    passed, landmark = np.unique(landmark, return_inverse=True)
    sheets = sheets.take(passed)
    observations = _simulated_walk(path, sheets, at, landmark)
    priors = LandmarkPriors.nothing(len(sheets.position))
    priors.position[:] = as_complex(sheets.position)
    priors.covariance[:] = np.eye(2) * survey_sigma_m**2
    plane = as_complex(path)
    model = Model(observations, plane, np.ones_like(plane), rough=False)
    # A pass gives two numbers, and the walk itself takes about one: the rest determines the level of sightings.
    noise = replace(USUAL, sighting_observations=float(len(at)))
    even = VarianceFactors.even(noise, len(at), len(sheets.position))
    return SolvedWalk.of(LinearWalk(model, priors, equivalent_variances(model, even)))


def _passes(path: FloatArray, foot: FloatArray) -> tuple[IntArray, IntArray]:
    """Samples (p,) of a path at which it comes nearest to landmarks (p,), in order."""
    found: list[tuple[int, int]] = []
    for landmark, place in enumerate(foot):
        away = np.linalg.norm(path - place, axis=1)
        near = np.flatnonzero(away < PASSED_M)
        step = LEAST_BETWEEN_M / max(float(np.linalg.norm(np.diff(path[:2], axis=0))), 0.05)
        runs = np.split(near, np.flatnonzero(np.diff(near) > step) + 1)
        found += [(int(run[np.argmin(away[run])]), landmark) for run in runs if len(run)]
    found.sort()
    order = np.array(found, dtype=np.int64).reshape(-1, 2)
    return order[:, 0], order[:, 1]


def passing(paths: Sequence[FloatArray], points: FloatArray) -> BoolArray:
    """Which walks (w) pass which stations: (w, s) for ``points`` (s, 2)."""
    return np.array([KDTree(path).query(points)[0] < PASSED_M for path in paths]).reshape(len(paths), len(points))


def _simulated_walk(path: FloatArray, sheets: PassedLandmarks, at: IntArray, landmark: IntArray) -> WalkObservations:
    """The odometry of a path (n, 2) and the passes (p,) of landmarks (p,) that a tracker would have logged, without any
    fault.
    """
    count = len(path)
    step = np.diff(path, axis=0)
    step_length_m = np.linalg.norm(step, axis=1)
    direction = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    turned = np.abs(np.diff(direction, append=direction[-1])) + SWAY_RAD_M * step_length_m
    along = np.concatenate(([0.0], np.cumsum(step_length_m)))
    for sample in at.tolist():
        about = np.abs(along[:-1] - along[sample]) <= LOOK_M
        turned[about] += LOOK_RAD / LOOK_M * step_length_m[about]
    nothing, zero = np.zeros(count - 1), np.zeros(count)
    odometry = Odometry(
        frame=np.arange(count),
        time_s=along / SPEED_M_S,
        path=as_complex(path),
        turn=np.ones(count, dtype=np.complex128),
        step_length_m=step_length_m,
        turned_rad=turned,
        jump_m2=nothing,
        jump_rad2=nothing,
        doubt=nothing.astype(np.complex128),
        rewritten=np.zeros(count, dtype=np.bool_),
        aside_m2=zero,
        jumped=np.zeros(count - 1, dtype=np.bool_),
        blind=np.zeros(count - 1, dtype=np.bool_),
        events=(),
    )
    away = as_complex(sheets.position[landmark]) - as_complex(path[at])
    distance = sheets.pass_m[landmark] + 0.15
    passes = Passes(
        at=at,
        landmark=landmark,
        offset=away / np.maximum(np.abs(away), 1e-9) * distance,
        heading=np.ones(len(at), dtype=np.complex128),
        distance_m=distance,
        spread_m=np.full(len(at), SPREAD_M),
        count=np.ones(len(at), dtype=np.int64),
    )
    return WalkObservations(tuple(str(i) for i in range(len(sheets.position))), odometry, passes)


def expected_on_walks(
    paths: Sequence[FloatArray], sheets: PassedLandmarks, survey_sigma_m: float
) -> list[ExpectedLabels]:
    """What is expected along many walks, (n, 2) each; those that cannot be mapped are left out."""
    found = (expected_along(path, sheets, survey_sigma_m) for path in paths)
    return [one for one in found if one is not None]


def mean_error_m(expected: Sequence[ExpectedLabels]) -> float:
    """Mean length of the errors to expect on some walks; NaN where there are none."""
    errors = [expected_error_m(one.covariance) for one in expected]
    return float(np.concatenate(errors).mean()) if errors else float("nan")


GAPS_M = (1.0, 2.0, 4.0, 7.0, 11.0, 16.0, 22.0, 30.0, 45.0, 70.0, 110.0)
"""Gaps for which the model is solved; the cost of others is between them."""
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
        found = [_station_passes(arc_lengths(walk), KDTree(walk), tree) for walk in walks]
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


def _station_passes(at_m: FloatArray, walk: KDTree, stations: KDTree) -> tuple[IntArray, FloatArray]:
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
