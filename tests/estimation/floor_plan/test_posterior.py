"""The posterior of a walk's poses: against a dense oracle, and where it leaves the plan."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.estimation.floor_plan.plans import OFFICE_ROUTE, along, area_of, in_own_frame, odometry_of, office
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.wall_costs import Float32Array, WallCosts
from vislam2tag.estimation.floor_plan.pose_grid import YAWS, PoseGrid, Transition
from vislam2tag.estimation.floor_plan.posterior import (
    ANYWHERE,
    OF_DECOYS,
    PoseWeights,
    best_pose,
    filtered,
    open_shares,
    walk_posterior,
)
from vislam2tag.estimation.floor_plan.stretches import Link, Stretch, Stretches, stretches_of

YAW_RAD = 0.7


def tiny_grid(seed: int, most: float = 6.0) -> PoseGrid:
    """Six positions of random costs."""
    cost = np.random.default_rng(seed).uniform(0, most, (8, 12)).astype(np.float32)
    return PoseGrid(WallCosts(cost, (0.0, 0.0)))


def tiny_walk(seed: int, count: int = 3, step_m: float = 0.5) -> Stretches:
    """Stretches of a few points."""
    rng = np.random.default_rng(seed)
    middles = np.cumsum(step_m * np.exp(1j * rng.uniform(-np.pi, np.pi, count)))
    shapes = 0.4 * (rng.uniform(-1, 1, (count, 6)) + 1j * rng.uniform(-1, 1, (count, 6)))
    shapes -= shapes.mean(axis=1, keepdims=True)
    stretches = tuple(Stretch(10 * i, 10 * i + 10, np.asarray(middles[i] + shapes[i])) for i in range(count))
    links = tuple(Link(after.middle - before.middle, 2.0, 0.1, 0.05, 1) for before, after in pairwise(stretches))
    return Stretches(stretches, links)


def matrix_of(transition: Transition) -> FloatArray:
    """Probabilities (poses, poses) of the pose after by that before, one unit weight at a time."""
    count = int(np.prod(transition.grid.shape))
    columns = np.empty((count, count))
    for pose in range(count):
        unit = np.zeros(transition.grid.shape, dtype=np.float32)
        unit.ravel()[pose] = 1
        columns[:, pose] = transition.forward(unit, 0.0)[0].ravel()
    return columns + ANYWHERE / count


def test_forward_backward_is_what_dense_matrices_give() -> None:
    grid, walk = tiny_grid(1), tiny_walk(2)
    rng = np.random.default_rng(3)
    count = int(np.prod(grid.shape))
    whole = slice(0, grid.shape[1]), slice(0, grid.shape[2])
    evidence: dict[int, Float32Array] = {1: rng.uniform(-3, 0, grid.shape).astype(np.float32)}
    fit = np.stack([grid.fit(one.shape, np.arange(YAWS), whole).ravel() for one in walk.stretches])
    likely = np.exp(fit.astype(np.float64))
    likely[1] *= np.exp(evidence[1].ravel())
    steps = [matrix_of(Transition(grid, link)) for link in walk.links]

    forward, log_evidence = [likely[0] / count], []
    for number in range(3):
        if number:
            forward.append(likely[number] * (steps[number - 1] @ forward[-1]))
        log_evidence.append(np.log(forward[-1].sum()))
        forward[-1] /= forward[-1].sum()
    backward = [np.ones(count)]
    for number in (2, 1):
        backward.append(steps[number - 1].T @ (likely[number] * backward[-1]))
        backward[-1] /= backward[-1].max()
    expected = [front * back for front, back in zip(forward, reversed(backward), strict=True)]

    posterior = walk_posterior(grid, walk, evidence)
    assert posterior.filtered.log_evidence == pytest.approx(log_evidence, abs=2e-3)
    for number, (found, true) in enumerate(zip(posterior.poses, expected, strict=True)):
        dense = np.zeros(count)
        dense[found.cell] = found.weight
        assert dense.sum() == pytest.approx(1)
        np.testing.assert_allclose(dense / dense.max(), true / true.max(), atol=2e-3)
        np.testing.assert_allclose(found.fit, fit[number][found.cell], rtol=1e-4)


@settings(max_examples=20)
@given(st.integers(0, 10**6), st.floats(0, 2), st.floats(0, 4))
def test_no_stretch_has_an_evidence_above_one(seed: int, most: float, step_m: float) -> None:
    found = filtered(tiny_grid(seed, most), tiny_walk(seed, 4, step_m), {})
    assert found.log_evidence.max() <= 1e-4


def office_walk(yaw_rad: float = YAW_RAD) -> tuple[PoseGrid, Stretches]:
    """A walk through the office, in the frame of its tracker."""
    path = in_own_frame(along(OFFICE_ROUTE), yaw_rad)
    return PoseGrid(office()), stretches_of(odometry_of(path))


def test_the_best_poses_are_where_the_walk_was() -> None:
    grid, walk = office_walk()
    posterior = walk_posterior(grid, walk, {})
    for poses, stretch in zip(posterior.poses, walk.stretches, strict=True):
        best = best_pose(grid, poses)
        assert best.place == pytest.approx(OFFICE_ROUTE[0] + stretch.middle * np.exp(1j * YAW_RAD), abs=0.3)
        assert np.exp(1j * best.yaw_rad) == pytest.approx(np.exp(1j * YAW_RAD), abs=0.1)
        assert best.mass > 0.99
        assert -2 < best.fit <= 0


def test_negligible_poses_change_the_evidence_little() -> None:
    grid, walk = office_walk()
    exact, usual, coarse = (filtered(grid, walk, {}, negligible=share).total for share in (1e-12, 1e-8, OF_DECOYS))
    assert usual == pytest.approx(exact, abs=0.01)
    assert coarse == pytest.approx(exact, abs=0.1)
    assert coarse < usual


def test_a_walk_is_not_followed_below_the_bound() -> None:
    grid, walk = office_walk()
    whole = filtered(grid, walk, {})
    bound = float(whole.log_evidence[:3].sum()) + 1e-9
    stopped = filtered(grid, walk, {}, bound=bound)
    assert len(stopped.poses) == 3
    assert stopped.log_evidence == pytest.approx(whole.log_evidence[:3])
    assert stopped.total < bound
    assert len(filtered(grid, walk, {}, bound=whole.total - 1e-6).poses) == len(walk.stretches)


def test_a_forward_pass_can_be_continued() -> None:
    grid, walk = office_walk()
    whole = filtered(grid, walk, {})
    begun = whole.first(2)
    assert len(begun.poses) == len(begun.log_evidence) == 2
    continued = filtered(grid, walk, {}, start=begun)
    assert continued.log_evidence == pytest.approx(whole.log_evidence)
    assert continued.poses[1] is begun.poses[1], "it is not computed again"


def test_some_yaws_show_how_open_a_plan_is() -> None:
    grid, walk = office_walk()
    share, possible = open_shares(grid, walk)
    assert share == pytest.approx(float(np.exp(filtered(grid, walk, {}).log_evidence[0])), rel=0.5)
    assert share < possible < 1
    hall = PoseGrid(WallCosts.of(area_of([(1, 1, 59, 49)], (60, 50))))
    assert min(open_shares(hall, walk)) > 0.4


def small_room() -> PoseGrid:
    return PoseGrid(WallCosts.of(area_of([(0.5, 0.5, 5.5, 4.5)], (6, 5))))


@pytest.mark.parametrize("route", [(0, 60), (0, 30, 30 + 30j)])
def test_a_walk_that_leaves_the_plan_fits_badly_and_nothing_breaks(route: tuple[complex, ...]) -> None:
    grid, walk = small_room(), stretches_of(odometry_of(along(route)))
    posterior = walk_posterior(grid, walk, {})
    assert len(posterior.poses) == len(walk.stretches) == 5
    assert np.isfinite(posterior.log_evidence)
    assert posterior.log_evidence < -60
    assert sum(best_pose(grid, poses).fit for poses in posterior.poses) < -30
    for poses in posterior.poses:
        assert poses.weight.sum() == pytest.approx(1)


def test_a_walk_that_comes_back_onto_the_plan_is_found_again() -> None:
    grid, walk = office_walk()
    jump = Link(walk.links[2].step + 300, walk.links[2].way_m, 0.0, 0.0, 1)
    jumped = Stretches(walk.stretches, (*walk.links[:2], jump, *walk.links[3:]))
    posterior = walk_posterior(grid, jumped, {})
    last = best_pose(grid, posterior.poses[-1])
    assert last.place == pytest.approx(OFFICE_ROUTE[0] + walk.stretches[-1].middle * np.exp(1j * YAW_RAD), abs=0.5)


def test_evidence_that_contradicts_everything_leaves_numbers_finite() -> None:
    grid, walk = office_walk()
    evidence = {1: np.full(grid.shape, -600, dtype=np.float32)}
    with_it, without = walk_posterior(grid, walk, evidence), walk_posterior(grid, walk, {})
    assert with_it.log_evidence == pytest.approx(without.log_evidence - 600, abs=0.05)
    for one, other in zip(with_it.poses, without.poses, strict=True):
        assert best_pose(grid, one).place == pytest.approx(best_pose(grid, other).place, abs=1e-3)


def cloud(grid: PoseGrid, rows: list[tuple[int, int, int, float]]) -> PoseWeights:
    """Poses (yaw, row, column) with weights."""
    cell = np.array([np.ravel_multi_index(pose[:3], grid.shape) for pose in rows])
    return PoseWeights(cell, np.array([pose[3] for pose in rows]), -np.arange(float(len(rows))))


def test_a_best_pose_counts_what_is_around_it_only() -> None:
    grid = PoseGrid(office())
    rows = [(0, 10, 10, 0.3), (119, 10, 11, 0.2), (1, 10, 11, 0.2), (0, 10, 40, 0.2), (60, 10, 10, 0.1)]
    best = best_pose(grid, cloud(grid, rows))
    assert best.mass == pytest.approx(0.7)
    assert best.place == pytest.approx(4.2 + 4.2j + 0.4 * 4 / 7)
    assert best.yaw_rad == pytest.approx(0, abs=1e-9)
    assert best.fit == pytest.approx(-(0.2 * 1 + 0.2 * 2) / 0.7)
    x_m2 = 0.4**2 * (4 / 7) * (3 / 7) + 0.4**2 / 12
    assert best.covariance_m2 == pytest.approx(np.diag([x_m2, 0.4**2 / 12]))
