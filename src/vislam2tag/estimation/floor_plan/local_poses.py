"""Finer positions around poses that are known: short stretches on small grids, by the same recursion."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.transforms import wrapped
from vislam2tag.core.wall_costs import FINE_M, OUTSIDE_NATS_M, WallCosts
from vislam2tag.estimation.floor_plan.pose_grid import DRIFT_PER_M, DRIFT_SHARE, WORST_NATS, PoseGrid
from vislam2tag.estimation.floor_plan.posterior import BestPose
from vislam2tag.estimation.floor_plan.stretches import SPACING_M, Link, Stretch, Stretches

LOCAL_LENGTH_M = 5.0
"""Length of the stretches."""
CELL_M, REACH_CELLS = 0.15, 7
TURN_RAD, REACH_TURNS = np.radians(1.0), 7
"""Cells of positions and turns, and how many of them on each side."""
DRIFT_M, DRIFT_RAD = 0.08, np.radians(1.0)
"""Drift over 12 m of way. The search for the pose allows for more, because faults may be undetected."""
LOST_M = 0.8
"""Without a known pose between them two stretches are not connected."""


@dataclass(frozen=True)
class LocalPoses:
    """Poses of short stretches: ``stretches`` (k) with ``place`` (k,) complex, metres, of their middles, ``yaw_rad``
    (k,), and the ``covariance_m2`` (k, 2, 2) of the places.
    """

    stretches: tuple[Stretch, ...]
    place: ComplexArray
    yaw_rad: FloatArray
    covariance_m2: FloatArray


def local_poses(
    grid: PoseGrid, long: Stretches, best: tuple[BestPose, ...], sure: BoolArray, short: Stretches
) -> LocalPoses:
    """Poses of the ``short`` stretches within the ``sure`` (s,) ones of the ``long`` (s), whose poses are known."""
    parents = _parents(long, short)
    kept = [number for number, parent in enumerate(parents) if parent >= 0 and sure[parent]]
    centre, yaw = np.empty(len(kept), dtype=np.complex128), np.empty(len(kept))
    for row, number in enumerate(kept):
        pose, whole = best[parents[number]], long.stretches[parents[number]]
        yaw[row] = pose.yaw_rad
        centre[row] = pose.place + np.exp(1j * pose.yaw_rad) * (short.stretches[number].middle - whole.middle)
    if not kept:
        return LocalPoses((), centre, yaw, np.empty((0, 2, 2)))
    stretches = [short.stretches[number] for number in kept]
    links = [_between(short, before, after) for before, after in pairwise(kept)]
    weight = _smoothed(grid, stretches, links, centre, yaw)
    offset, turn = _offsets(), _turns()
    by_place = weight.sum(axis=1).reshape(len(kept), -1)
    place = by_place @ offset
    away = np.stack(((offset - place[:, None]).real, (offset - place[:, None]).imag), axis=2)
    covariance = np.einsum("kp,kpi,kpj->kij", by_place, away, away)
    by_turn = weight.sum(axis=(2, 3))
    return LocalPoses(tuple(stretches), centre + place, yaw + by_turn @ turn, covariance)


def _parents(long: Stretches, short: Stretches) -> list[int]:
    """Of each short stretch the long one that contains its middle; -1 if none does."""
    found = []
    for one in short.stretches:
        middle = (one.first + one.last) / 2
        inside = [number for number, whole in enumerate(long.stretches) if whole.first <= middle <= whole.last]
        found.append(inside[0] if inside else -1)
    return found


def _between(short: Stretches, before: int, after: int) -> Link | None:
    """The link between two short stretches; None if others between them are left out, or nothing connects them."""
    link = short.links[before] if after == before + 1 else None
    return link if link is not None and link.sigma_m < LOST_M else None


def _offsets() -> ComplexArray:
    """(p,) positions of the cells relative to their middle, complex metres, row by row."""
    side = CELL_M * np.arange(-REACH_CELLS, REACH_CELLS + 1)
    return np.asarray((side[None, :] + 1j * side[:, None]).ravel())


def _turns() -> FloatArray:
    return np.asarray(TURN_RAD * np.arange(-REACH_TURNS, REACH_TURNS + 1))


def _fit(costs: WallCosts, stretch: Stretch, centre: complex, yaw_rad: float) -> FloatArray:
    """Log-likelihood (turns, cells) of a stretch around a pose."""
    turned = np.exp(1j * (yaw_rad + _turns()))[:, None] * stretch.shape
    place = (centre - complex(*costs.origin_m) + _offsets()[:, None] + turned[:, None]) / FINE_M
    row, column = (np.floor(axis).astype(np.int64) for axis in (place.imag, place.real))
    rows, columns = costs.cost.shape
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    cost = costs.cost[row.clip(0, rows - 1), column.clip(0, columns - 1)]
    total = np.where(inside, cost, OUTSIDE_NATS_M).sum(axis=2) * SPACING_M
    return np.asarray(-np.minimum(total, WORST_NATS), dtype=np.float64)


def _smoothed(
    grid: PoseGrid, stretches: list[Stretch], links: list[Link | None], centre: ComplexArray, yaw: FloatArray
) -> FloatArray:
    """Posterior weights (k, turns, rows, columns) of all stretches, each with sum 1."""
    side = 2 * REACH_CELLS + 1
    likely = []
    for stretch, place, turn in zip(stretches, centre.tolist(), yaw.tolist(), strict=True):
        fit = _fit(grid.costs_of(stretch.floor), stretch, place, turn)
        likely.append(np.exp(fit - fit.max()).reshape(-1, side, side))
    steps = [
        None if link is None else _Step.of(link, centre[number : number + 2], yaw[number : number + 2])
        for number, link in enumerate(links)
    ]
    ahead = [*likely[:1]]
    for number, step in enumerate(steps):
        came = likely[number + 1] * (1.0 if step is None else step.forward(ahead[-1]))
        ahead.append(came / came.sum() if came.sum() > 0 else likely[number + 1])
    behind = [np.ones_like(one) for one in likely]
    for number in range(len(steps) - 1, -1, -1):
        if (step := steps[number]) is not None:
            back = step.backward(likely[number + 1] * behind[number + 1])
            behind[number] = back / max(float(back.max()), 1e-300)
    weight = np.array([front * back for front, back in zip(ahead, behind, strict=True)]).reshape(-1, *_shape())
    return np.asarray(weight / np.maximum(weight.sum(axis=(1, 2, 3), keepdims=True), 1e-300))


def _shape() -> tuple[int, int, int]:
    side = 2 * REACH_CELLS + 1
    return 2 * REACH_TURNS + 1, side, side


@dataclass(frozen=True)
class _Step:
    """From the grid of one stretch to that of the next: shifts (turns, cells, cells) by half a step along y and x
    before and after a ``turn`` (turns, turns).
    """

    first: tuple[FloatArray, FloatArray]
    turn: FloatArray
    second: tuple[FloatArray, FloatArray]

    @classmethod
    def of(cls, link: Link, centre: ComplexArray, yaw: FloatArray) -> _Step:
        """Make it for a link between grids about poses (2,)."""
        half = link.step / 2
        frames = np.exp(1j * (yaw[:, None] + _turns()))
        apart = complex(centre[0] - centre[1]) + half * complex(np.exp(1j * yaw[0]) + np.exp(1j * yaw[1]))
        nominal = half * np.exp(1j * yaw)
        own = np.hypot(DRIFT_M * np.sqrt(link.way_m / DRIFT_PER_M), DRIFT_SHARE * link.way_m / 2)
        sigma = float(np.sqrt((own**2 + link.sigma_m**2) / 2))
        shifts = (half * frames[0] - nominal[0] + apart, half * frames[1] - nominal[1])
        first, second = ((_shift(by.imag, sigma), _shift(by.real, sigma)) for by in shifts)
        turns = _turns()
        off = wrapped(yaw[1] + turns[:, None] - yaw[0] - turns)
        turn_sigma = np.hypot(DRIFT_RAD * np.sqrt(link.way_m / DRIFT_PER_M), link.sigma_rad)
        return cls(first, np.exp(-0.5 * (off / np.hypot(turn_sigma, TURN_RAD / 2)) ** 2), second)

    def forward(self, weight: FloatArray) -> FloatArray:
        """Weights (turns, rows, columns) of the next stretch by those of this."""
        down, across = self.first
        moved = down @ weight @ across.transpose(0, 2, 1)
        turned = np.einsum("ab,bij->aij", self.turn, moved)
        down, across = self.second
        return np.asarray(down @ turned @ across.transpose(0, 2, 1))

    def backward(self, weight: FloatArray) -> FloatArray:
        """The transposed matrix."""
        down, across = self.second
        moved = down.transpose(0, 2, 1) @ weight @ across
        turned = np.einsum("ab,aij->bij", self.turn, moved)
        down, across = self.first
        return np.asarray(down.transpose(0, 2, 1) @ turned @ across)


def _shift(by_m: FloatArray, sigma_m: float) -> FloatArray:
    """Matrices (turns, cells, cells) that move values by distances (turns,) and blur them."""
    cell = CELL_M * np.arange(-REACH_CELLS, REACH_CELLS + 1)
    off = cell[:, None] - cell - by_m[:, None, None]
    return np.asarray(np.exp(-0.5 * (off / np.hypot(sigma_m, CELL_M / 2)) ** 2))


def frames_of(poses: LocalPoses) -> IntArray:
    """(k,) frame of the odometry in the middle of each stretch."""
    return np.array([(one.first + one.last) // 2 for one in poses.stretches], dtype=np.int64)
