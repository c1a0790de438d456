"""Where one more landmark would help: by how much the expected errors of a session, and of a floor, fall with it.

A sighting of a landmark whose place is known measures the camera's position, with covariance ``R``. All that is known
of the walk is Gaussian, so the covariance at frame i falls by ``C_iS (C_SS + R)^-1 C_Si``, where ``S`` are the passes
of that place and ``C`` the covariances between positions at different times. Those follow from neighbouring states
alone (:func:`positions_each_metre`); they fade from landmark to landmark, so they are kept over a limited way only and
the cost grows linearly with the walk.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.tracks import Landmarks, near_landmarks
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.factors import LinearWalk
from vislam2tag.estimation.least_squares import solve
from vislam2tag.estimation.observations import Passes
from vislam2tag.estimation.smoother import SolvedWalk
from vislam2tag.quality.self_check import expected_error_m
from vislam2tag.quality.self_check_record import FloorCheck, ProposedPlace

EVERY_M = 1.0
"""Positions are tied to each other this densely along the walk."""
REACH = 150
"""A landmark is not asked to help further off along the walk than this many such steps."""
CELL_M = 1.0
"""Places stand for squares of this side."""
SIGHT_M = 1.0
"""A landmark is sighted at every pass of its place within this distance: it is made to be walked by."""
SURVEY_SIGMA_M = 0.02
"""How well one more landmark would be surveyed: the usual error of a tape."""
Place = tuple[int, int, int]
"""Floor, and the square from a cell to the next ones in units of :data:`CELL_M`."""
_AROUND = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 2)


@dataclass(frozen=True)
class DensePositions:
    """A walk at some of its frames ``at`` (k,), closely in order.

    ``position`` (k, 2) metres BCS. ``covariance`` (k, REACH + 1, 2, 2) of the position at each with those of the next
    ones, itself first, zero beyond the end. ``frames`` (k,) how many frames each stands for.
    """

    at: IntArray
    position: FloatArray
    covariance: FloatArray
    frames: FloatArray


def gains(smoothed: SolvedWalk, positions: DensePositions, floor: IntArray) -> dict[Place, float]:
    """By how much a landmark at each place that a walk passes lowers the expected errors, summed over frames, metres.

    ``floor`` (k,) is that of each of the ``positions``.
    """
    usual = float(np.median(smoothed.variance_factors.sighting)) * smoothed.noise.sighting_m**2
    noise = np.eye(2) * (usual + SURVEY_SIGMA_M**2)
    before = expected_error_m(positions.covariance[:, 0])
    gain_m: dict[tuple[int, ...], float] = {}
    found = {}
    for where, nodes in _places(positions, floor):
        passes = tuple(nodes)
        if passes not in gain_m:
            index, after = _improved(positions.covariance, np.array(passes), noise)
            gain_m[passes] = float(positions.frames[index] @ (before[index] - expected_error_m(after)))
        found[where] = gain_m[passes]
    return found


def positions_each_metre(smoothed: SolvedWalk) -> DensePositions:
    """Solve a smoothed walk for a state a metre and reduce it to positions and their covariances with the next ones."""
    fine = _with_silent_passes(smoothed)
    solution = solve(fine.normal_equations())
    nodes, count = fine.model.observations.nodes, len(fine.model.path)
    # Given the border, each state depends on its neighbours only; what the border ties together is added again.
    tied = np.linalg.solve(solution.border_covariance, solution.cross.transpose(0, 2, 1)).transpose(0, 2, 1)
    own = solution.covariance - tied @ solution.cross.transpose(0, 2, 1)
    beside = solution.next_covariance - tied[:-1] @ solution.cross[1:].transpose(0, 2, 1)
    onward = np.linalg.solve(own[:-1], beside)
    covariance = np.zeros((len(nodes), REACH + 1, 2, 2))
    row = own[:, :2]
    for step in range(min(REACH + 1, len(nodes))):
        if step:
            row = row[: len(nodes) - step] @ onward[step - 1 :]
        ties = tied[: len(nodes) - step, :2] @ solution.cross[step:, :2].transpose(0, 2, 1)
        covariance[: len(nodes) - step, step] = row[:, :, :2] + ties
    nearest = np.searchsorted((nodes[1:] + nodes[:-1]) / 2, np.arange(count))
    frames = np.bincount(nearest, minlength=len(nodes)).astype(np.float64)
    error = solution.state[:, 0] + 1j * solution.state[:, 1]
    return DensePositions(nodes, as_points(fine.model.path[nodes] + error), covariance, frames)


def _with_silent_passes(smoothed: SolvedWalk) -> LinearWalk:
    """Add a pass every metre at which nothing is sighted: the same walk, with more states."""
    model, variance_factors = smoothed.model, smoothed.variance_factors
    observations = model.observations
    metre = np.floor(np.concatenate(([0.0], np.cumsum(observations.odometry.step_length_m))) / EVERY_M)
    at = np.setdiff1d(np.flatnonzero(np.diff(metre) > 0) + 1, observations.nodes)
    zero, whole, nowhere = np.zeros(len(at)), np.zeros(len(at), dtype=np.int64), np.zeros(len(at), dtype=np.complex128)
    silent = Passes(at, whole, nowhere, nowhere, zero, zero, whole)
    order = np.argsort(np.concatenate((observations.passes.at, at)), kind="stable")
    fine = replace(observations, passes=observations.passes.with_more(silent))
    stretch = np.clip(
        np.searchsorted(observations.nodes, fine.nodes[:-1], side="right") - 1, 0, len(observations.nodes) - 2
    )
    finer = replace(
        variance_factors,
        stretch={source: factor[stretch] for source, factor in variance_factors.stretch.items()},
        sighting=np.concatenate((variance_factors.sighting, np.full(len(at), np.inf)))[order],
        sheet=np.concatenate((variance_factors.sheet, np.ones(len(at))))[order],
    )
    return LinearWalk(replace(model, observations=fine), smoothed.priors, finer)


def _places(positions: DensePositions, floor: IntArray) -> Iterator[tuple[Place, list[int]]]:
    """Yield each place near the walk, as floor and cell, and the nearest position at each pass; ``floor`` (k,)."""
    cell = np.floor(positions.position / CELL_M).astype(np.int64)[:, None] + _AROUND
    away = np.linalg.norm((cell + 0.5) * CELL_M - positions.position[:, None], axis=2)
    node, around = np.nonzero(away <= SIGHT_M)
    key = np.column_stack((floor[node], cell[node, around]))
    away = away[node, around]
    order = np.lexsort((node, *key.T[::-1]))
    key, node, away = key[order], node[order], away[order]
    anew = np.concatenate(([True], (np.diff(key, axis=0) != 0).any(axis=1)))
    apart = anew | np.concatenate(([True], np.diff(node) != 1))
    starts = np.flatnonzero(apart)
    nearest = np.lexsort((away, np.cumsum(apart)))[starts]
    for group in np.split(np.arange(len(starts)), np.flatnonzero(anew[starts])[1:]):
        first = starts[group[0]]
        yield (int(key[first, 0]), int(key[first, 1]), int(key[first, 2])), node[nearest[group]].tolist()


def _improved(covariance: FloatArray, passes: IntArray, noise: FloatArray) -> tuple[IntArray, FloatArray]:
    """Which positions (j,) sightings at these passes (s,) help, and their covariances (j, 2, 2) then."""
    count = len(covariance)
    near = [np.arange(max(at - REACH, 0), min(at + REACH + 1, count)) for at in passes]
    index = np.unique(np.concatenate(near))
    shared = _between(covariance, index, passes).transpose(0, 2, 1, 3).reshape(len(index), 2, -1)
    own = _between(covariance, passes, passes).transpose(0, 2, 1, 3).reshape(2 * len(passes), -1)
    fall = shared @ np.linalg.solve(own + np.kron(np.eye(len(passes)), noise), shared.transpose(0, 2, 1))
    return index, covariance[index, 0] - fall


def _between(covariance: FloatArray, rows: IntArray, columns: IntArray) -> FloatArray:
    """Covariances (r, c, 2, 2) between positions; 0 where they lie too far apart along the walk."""
    first = np.minimum(rows[:, None], columns)
    step = np.abs(rows[:, None] - columns)
    block = covariance[first, np.minimum(step, REACH)]
    block = np.where((rows[:, None] > columns)[:, :, None, None], block.transpose(0, 1, 3, 2), block)
    return np.where((step <= REACH)[:, :, None, None], block, 0.0)


BEST = 3
"""So many places are named on each floor ..."""
APART_M = 10.0
"""... at least this far from each other: what is closer helps the same walks ..."""
BESIDE_M = 3.0
"""... and from landmarks that hang there: who passes one passes the other."""

Cell = tuple[int, int]
_Key = TypeVar("_Key", bound=Hashable)
_Number = TypeVar("_Number", int, float)


@dataclass
class GainMap:
    """Sums over sessions, or of one; their size grows with the building, not with the survey."""

    frames: dict[int, int] = field(default_factory=dict)
    """Number of frames by floor."""
    expected_m: dict[int, float] = field(default_factory=dict)
    """Sum of the frames' expected errors by floor, metres."""
    gain_m: dict[Place, float] = field(default_factory=dict)
    """Summed over frames, metres."""

    def add(self, other: GainMap) -> None:
        """Add the sums of other sessions."""
        _add(self.frames, other.frames)
        _add(self.expected_m, other.expected_m)
        _add(self.gain_m, other.gain_m)

    def floors(self, landmarks: Landmarks) -> list[FloorCheck]:
        """What was found of each floor, by its number; ``landmarks`` are those that hang there."""
        return [
            FloorCheck(
                number=number,
                frames=self.frames[number],
                expected_m=round(self.expected_m[number] / self.frames[number], 4),
                places=self._best(number, landmarks),
            )
            for number in sorted(self.frames)
        ]

    def mean_gain_m(self, number: int) -> dict[Cell, float]:
        """By how much the mean expected error of a floor falls with a landmark in each of its cells."""
        here = {(x, y): gain for (floor, x, y), gain in sorted(self.gain_m.items()) if floor == number}
        return {cell: gain / self.frames[number] for cell, gain in here.items()}

    def _best(self, number: int, landmarks: Landmarks) -> list[ProposedPlace]:
        chosen: list[ProposedPlace] = []
        gains = self.mean_gain_m(number)
        here = landmarks.on_floor(number)
        hanging_m = here.position_bcs[here.surveyed]
        for cell in sorted(gains, key=lambda cell: (-gains[cell], cell)):
            x_m, y_m = ((index + 0.5) * CELL_M for index in cell)
            if (np.linalg.norm(hanging_m - (x_m, y_m), axis=1) < BESIDE_M).any():
                continue
            if all((x_m - other.x_m) ** 2 + (y_m - other.y_m) ** 2 >= APART_M**2 for other in chosen):
                near = near_landmarks(landmarks, number, (x_m, y_m))
                chosen.append(ProposedPlace(x_m=x_m, y_m=y_m, near=near, gain_m=round(gains[cell], 4)))
            if len(chosen) == BEST:
                break
        return chosen


def session_gains(gains: Mapping[Place, float], factor: float, floor: IntArray, expected_m: FloatArray) -> GainMap:
    """Reduce a session: its gains and the expected errors (n,) of its frames on floors (n,), all times a factor."""
    numbers = sorted(set(floor.tolist()))
    return GainMap(
        {number: int((floor == number).sum()) for number in numbers},
        {number: float(expected_m[floor == number].sum()) * factor for number in numbers},
        {place: gain * factor for place, gain in gains.items()},
    )


def _add(sums: dict[_Key, _Number], more: Mapping[_Key, _Number]) -> None:
    for key, value in more.items():
        sums[key] = sums.get(key, 0) + value
