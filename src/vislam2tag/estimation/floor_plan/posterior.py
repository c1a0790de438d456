"""The exact posterior of all stretches' poses: forward-backward over a grid of the whole plan.

    f_i(s) = L_i(s) E_i(s) sum_r T_i(s | r) f_(i-1)(r) / z_i        forward, z_i its sum
    b_i(r) = sum_s T_(i+1)(s | r) L_(i+1)(s) E_(i+1)(s) b_(i+1)(s)  backward
    p_i    = f_i b_i / sum                                         posterior

``L`` is the likelihood of the stretch's shape at pose ``s``, ``E`` that of other evidence, ``T`` the transition. The
logarithm of all ``z`` is the evidence of the walk for the plan. ``z_i`` is at most 1, so a walk whose evidence has
fallen below a bound stays below it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.wall_costs import POSITION_M, Float32Array
from vislam2tag.estimation.floor_plan.pose_grid import YAWS, Box, PoseGrid, Transition, box_around
from vislam2tag.estimation.floor_plan.stretches import Link, Stretches

NEGLIGIBLE = 1e-6
"""Poses with a smaller share of the greatest weight are dropped ..."""
NEGLIGIBLE_YAW = 100.0
"""... and yaws with a smaller share of all weight than so many times that."""
OF_DECOYS = 1e-5
"""The same for a walk of which only the evidence matters."""
ANYWHERE = 1e-5
"""Share with which a stretch is anywhere on the plan: the tracker may have jumped unseen."""
Evidence = Mapping[int, Float32Array]
"""Log-likelihoods (yaws, rows, columns) of other evidence, by number of the stretch."""


@dataclass(frozen=True)
class PoseWeights:
    """Poses of one stretch: flat indices ``cell`` (k,) into the grid, with ``weight`` (k,), sum 1; ``fit`` (k,) is the
    log-likelihood of the stretch's shape there.
    """

    cell: IntArray
    weight: FloatArray
    fit: FloatArray


@dataclass(frozen=True)
class Filtered:
    """The forward pass: ``poses`` of the stretches so far, and the logarithm of the evidence (s,) of each given those
    before it.
    """

    poses: tuple[PoseWeights, ...]
    log_evidence: FloatArray

    @property
    def total(self) -> float:
        """Logarithm of the evidence of the walk so far."""
        return float(self.log_evidence.sum())

    def first(self, count: int) -> Filtered:
        """The first stretches only."""
        return Filtered(self.poses[:count], self.log_evidence[:count])


@dataclass(frozen=True)
class WalkPosterior:
    """Posteriors of all stretches on one plan, and the forward pass that led to them."""

    grid: PoseGrid
    poses: tuple[PoseWeights, ...]
    filtered: Filtered

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence of the walk for the plan."""
        return self.filtered.total


NOTHING = Filtered((), np.empty(0))


AROUND_YAWS, AROUND_CELLS = 1, 3
"""So far around known poses those of a walk of slightly different size are looked for."""
SAMPLED_YAWS = 10
"""Every so many yaws show how many poses fit a stretch."""


def open_shares(grid: PoseGrid, walk: Stretches) -> tuple[float, float]:
    """Share of all poses that fit the first stretch, and of those that are not negligible for it, from some yaws."""
    yaws, (rows, columns) = np.arange(0, YAWS, SAMPLED_YAWS), grid.shape[1:]
    first = walk.stretches[0]
    fit = grid.fit(first.shape, yaws, (slice(0, rows), slice(0, columns)), first.floor)
    return float(np.exp(fit).mean()), float((fit > np.log(NEGLIGIBLE)).mean())


def filtered(
    grid: PoseGrid,
    walk: Stretches,
    evidence: Evidence,
    *,
    start: Filtered = NOTHING,
    bound: float = -np.inf,
    negligible: float = NEGLIGIBLE,
    among: tuple[IntArray, Box] | None = None,
) -> Filtered:
    """Go through the stretches that ``start`` does not contain; stop if the evidence falls below ``bound`` (log).

    Poses, and yaws, with a smaller share of the weight than ``negligible`` are dropped. The first stretch is only
    ``among`` some yaws and positions, if these are given.
    """
    count = int(np.prod(grid.shape))
    poses, each = list(start.poses), start.log_evidence.tolist()
    for number in range(len(poses), len(walk.stretches)):
        if number:
            prior, yaws, box = _predicted(grid, walk.links[number - 1], poses[-1], NEGLIGIBLE_YAW * negligible)
        else:
            yaws, box = among or _everywhere(grid)
            prior = np.full((len(yaws), *(side.stop - side.start for side in box)), 1 / count, dtype=np.float32)
        stretch = walk.stretches[number]
        fit = grid.fit(stretch.shape, yaws, box, stretch.floor)
        likely = fit if number not in evidence else fit + evidence[number][yaws][:, *box]
        top = likely.max()  # many facts that contradict each other may have no likelihood that a float can hold
        weight = np.exp(likely - top) * prior
        total = float(weight.sum(dtype=np.float64))
        each.append(float(np.log(total)) + float(top))
        kept = np.nonzero(weight > negligible * weight.max())
        cell = np.ravel_multi_index((yaws[kept[0]], kept[1] + box[0].start, kept[2] + box[1].start), grid.shape)
        poses.append(PoseWeights(cell, weight[kept] / total, fit[kept].astype(np.float64)))
        if sum(each) < bound:
            break
    return Filtered(tuple(poses), np.array(each))


def surroundings(grid: PoseGrid, poses: PoseWeights) -> tuple[IntArray, Box]:
    """Yaws and positions around all poses that are not negligible."""
    yaw, row, column = np.unravel_index(poses.cell, grid.shape)
    yaws = np.unique((yaw[:, None] + np.arange(-AROUND_YAWS, AROUND_YAWS + 1)) % YAWS)
    rows, columns = (
        slice(max(int(side.min()) - AROUND_CELLS, 0), min(int(side.max()) + AROUND_CELLS + 1, count))
        for side, count in zip((row, column), grid.shape[1:], strict=True)
    )
    return yaws, (rows, columns)


def _everywhere(grid: PoseGrid) -> tuple[IntArray, Box]:
    return np.arange(YAWS), (slice(0, grid.shape[1]), slice(0, grid.shape[2]))


def _predicted(grid: PoseGrid, link: Link, before: PoseWeights, least: float) -> tuple[Float32Array, IntArray, Box]:
    """Weights (k, r, c) of a stretch's poses by those before it, at yaws (k,) with more than ``least``, in a box."""
    weight = np.zeros(grid.shape, dtype=np.float32)
    weight.ravel()[before.cell] = before.weight
    spread, yaws = Transition(grid, link).forward(weight, least)
    if spread.sum(dtype=np.float64) > ANYWHERE:
        box = box_around(spread)
    else:  # the step leads beyond the plan
        yaws, box = _everywhere(grid)
    return spread[yaws][:, *box] + np.float32(ANYWHERE / spread.size), yaws, box


def walk_posterior(grid: PoseGrid, walk: Stretches, evidence: Evidence) -> WalkPosterior:
    """Posterior of each stretch given the whole walk."""
    ahead = filtered(grid, walk, evidence)
    behind = np.ones(grid.shape, dtype=np.float32)
    found: list[PoseWeights] = []
    for number in range(len(walk.stretches) - 1, -1, -1):
        poses = ahead.poses[number]
        weight = poses.weight * behind.ravel()[poses.cell]
        weight = weight / weight.sum()
        kept = weight > NEGLIGIBLE * weight.max()
        found.append(PoseWeights(poses.cell[kept], weight[kept], poses.fit[kept]))
        if number:
            own = np.zeros(grid.shape, dtype=np.float32)
            after = behind.ravel()[poses.cell] * np.exp(poses.fit + _at(evidence.get(number), poses.cell))
            own.ravel()[poses.cell] = after / after.max()
            behind, _ = Transition(grid, walk.links[number - 1]).backward(own, 0.0)
            behind += np.float32(ANYWHERE * own.mean())
    return WalkPosterior(grid, tuple(reversed(found)), ahead)


def _at(evidence: Float32Array | None, cell: IntArray) -> FloatArray | float:
    return 0.0 if evidence is None else evidence.ravel()[cell].astype(np.float64)


@dataclass(frozen=True)
class BestPose:
    """The most probable pose of a stretch: ``place`` complex metres and ``yaw_rad``, means around it; ``mass`` is the
    posterior within :data:`AROUND_M` and :data:`AROUND_RAD`, ``covariance_m2`` (2, 2) that of the place.
    """

    place: complex
    yaw_rad: float
    mass: float
    covariance_m2: FloatArray
    fit: float


AROUND_M, AROUND_RAD = 2.0, np.radians(20.0)


def best_pose(grid: PoseGrid, poses: PoseWeights) -> BestPose:
    """Summarise the posterior of a stretch around its most probable pose."""
    place, yaw = grid.place(poses.cell)
    top = int(np.argmax(poses.weight))
    for _ in range(2):  # the mode of single cells may be beside the middle of the mass
        turn = np.angle(np.exp(1j * (yaw - yaw[top])))
        near = (np.abs(place - place[top]) <= AROUND_M) & (np.abs(turn) <= AROUND_RAD)
        weight = np.where(near, poses.weight, 0.0)
        mass = float(weight.sum())
        middle = complex((weight * place).sum() / mass)
        mean_yaw = float(yaw[top] + (weight * turn).sum() / mass)
        off = np.abs(place - middle) + 2.0 * np.abs(np.angle(np.exp(1j * (yaw - mean_yaw))))
        top = int(np.argmin(np.where(near, off, np.inf)))
    away = np.stack(((place - middle).real, (place - middle).imag), axis=1)[near]
    covariance = (away * weight[near, None]).T @ away / mass + np.eye(2) * POSITION_M**2 / 12
    return BestPose(middle, mean_yaw, mass, covariance, float((weight * poses.fit).sum() / mass))
