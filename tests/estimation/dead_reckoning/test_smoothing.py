"""The algebra: the banded solution is the dense one, its covariance the dense inverse, its slopes the differences.

Sigma of walks with few fixes covers walkers and buildings unlike the calibrated ones; of many fixes it stays.
"""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.estimation.dead_reckoning.walks import simulated, true_fixes
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.estimation.dead_reckoning import factors, smoothing
from vislam2tag.estimation.dead_reckoning.factors import STATES, Nodes, PathModel, PathState, WalkFixes
from vislam2tag.estimation.dead_reckoning.gait import speed_model
from vislam2tag.estimation.dead_reckoning.maps import SharedLines, Walls
from vislam2tag.estimation.dead_reckoning.smoothing import FACTORS, smooth_path
from vislam2tag.estimation.dead_reckoning.walk import ReckonedWalk, SensedWalk
from vislam2tag.estimation.settings import DeadReckoningSettings

CORRIDORS = np.zeros((40, 40), dtype=bool)
CORRIDORS[18:22], CORRIDORS[:, 10:13] = True, True
WALLS = Walls(WalkableArea(CORRIDORS, (-10.0, -10.0), 0.5), 0.5)


def made(seed: int, count: int = 12) -> tuple[PathModel, WalkFixes, PathState]:
    rng = np.random.default_rng(seed)
    time_s = np.cumsum(rng.uniform(0.3, 0.7, count))
    motion = rng.uniform(0.3, 0.8, count - 1) * np.exp(1j * np.cumsum(rng.normal(0, 0.3, count - 1)))
    turn, known = rng.uniform(0, 0.2, count - 1), np.ones(count - 1, dtype=bool)
    still = np.zeros(count - 1)
    nodes = Nodes(time_s, motion, np.abs(motion), turn, known, rng.normal(0, 0.1, count), still)
    fixes = WalkFixes(np.array((0, count // 2, count - 1)), rng.normal(0, 3, 3) + 1j * rng.normal(0, 3, 3), 0.5)
    position = rng.normal(0, 2, count) + 1j * rng.normal(0, 2, count)
    scale, heading, offset = (rng.normal(0, sigma, count) for sigma in (0.1, 0.3, 0.1))
    return PathModel(nodes), fixes, PathState(position, scale, heading, offset)


def dense(model: PathModel, state: PathState, fixes: WalkFixes) -> tuple[FloatArray, FloatArray]:
    equations = model.equations(state, fixes)
    count = len(state.scale)
    matrix = np.zeros((count, STATES, count, STATES))
    for k in range(count):
        matrix[k, :, k] = equations.diagonal[k]
        if k:
            matrix[k - 1, :, k], matrix[k, :, k - 1] = equations.upper[k - 1], equations.upper[k - 1].T
    return matrix.reshape(count * STATES, -1), equations.right.ravel()


@given(seed=st.integers(0, 50), unknown=st.integers(0, 12 * STATES - 1))
def test_the_right_side_is_the_slope_of_the_cost(seed: int, unknown: int) -> None:
    model, fixes, state = made(seed)
    others = SharedLines(state.position + 1 - 2j, np.exp(1j * state.heading_rad), np.full(len(state.scale), 0.3))
    node, kind = divmod(unknown, STATES)
    for walls in (None, WALLS):
        kinks = 0.3 if walls and kind < 2 else 1e-2  # walls' slope is taken over two cells
        assert_slope(replace(model, walls=walls, lines=others), fixes, state, node, kind, kinks)


def assert_slope(model: PathModel, fixes: WalkFixes, state: PathState, node: int, kind: int, within: float) -> None:

    def cost(by: float) -> float:
        steps = [np.zeros(len(state.scale)) for _ in range(STATES)]
        steps[kind][node] = by
        return model.cost(PathState.of_columns(state.columns + np.column_stack(steps)), fixes)

    slope = (cost(1e-5) - cost(-1e-5)) / 2e-5
    known = 1 + 1 / 3 if kind == 3 else 1.0
    right = float(model.equations(state, fixes).right[node, kind])
    assert slope == pytest.approx(-2 * right, rel=1e-3 * known, abs=within)


@given(seed=st.integers(0, 50))
def test_covariances_are_those_of_the_dense_inverse_where_the_scatter_is_known(seed: int) -> None:
    model, fixes, _ = made(seed)
    with patch.object(smoothing, "FIX_SIGMA_SPREAD", 0.01):
        found = smooth_path(model, fixes)
    assume(found.unreached_m == 0)
    fixes = WalkFixes(fixes.node, fixes.position, found.fix_sigma_m)
    matrix, right = dense(model, found.state, fixes)
    assert np.linalg.eigvalsh(matrix).min() > 0
    blocks = np.linalg.inv(matrix).reshape(len(found.state.scale), STATES, -1, STATES)
    inverse = np.array([blocks[k, :, k] for k in range(len(blocks))])
    assert found.covariance == pytest.approx(inverse, rel=0.1, abs=1e-3)
    assert np.abs(np.linalg.solve(matrix, right).reshape(-1, STATES)[:, :2]).max() < 0.05


def test_what_the_scatter_of_fixes_may_be_is_averaged_over() -> None:
    model, fixes, _ = made(3)
    with patch.object(smoothing, "FIX_SIGMA_SPREAD", 0.01):
        small, large = (smooth_path(model, replace(fixes, sigma_m=fixes.sigma_m * factor)) for factor in (0.45, 3.0))
    vague = smooth_path(model, fixes)
    assert small.fix_sigma_m < vague.fix_sigma_m < large.fix_sigma_m
    assert np.abs(vague.fix_sigma_m / (fixes.sigma_m * FACTORS) - 1).min() > 0.01, "one of those tried, not their mean"
    assert np.trace(small.covariance[3, :2, :2]) < np.trace(vague.covariance[3, :2, :2])


def test_first_steps_of_a_recording_tell_less_than_later_ones() -> None:
    model = made(3, 60)[0]
    with patch.object(factors, "START_NOISE", 0.0):
        usual = model.precision[:, 0]
    share = model.precision[:, 0] / usual
    assert (np.diff(share) > 0).all()
    assert share[0] < 0.1
    assert share[-1] > 0.99


def test_the_motion_and_heading_of_a_swinging_phone_tell_less() -> None:
    held = made(3, 60)[0]
    swinging = replace(held, nodes=replace(held.nodes, swinging=np.ones(len(held.nodes.motion))))
    share = swinging.precision / held.precision
    assert (share[10:, [0, 1, 3]] < 0.2).all()
    assert (share[:, 2] == 1).all()


def test_who_turns_goes_beside_where_the_phone_points_for_a_while() -> None:
    straight = made(3, 60)[0]
    nodes = replace(straight.nodes, turn_rad=np.where(np.arange(59) == 20, 1.5, 0.0))
    precision = replace(straight, nodes=nodes).precision[:, 4]
    assert precision.argmin() == 20
    assert precision[20] < 0.01 * precision[21]
    assert (straight.kept < 1).all()


def test_a_walker_unlike_those_of_whom_the_speed_was_learned_is_followed() -> None:
    time_s = np.arange(0, 60.5, 0.5)
    motion = np.asarray(0.6 * np.exp(1j * np.repeat((0.0, np.pi / 2, np.pi, np.pi / 2), 30)), dtype=np.complex128)
    still, known = np.zeros(120), np.ones(120, dtype=bool)
    nodes = Nodes(time_s, motion, np.abs(motion), still, known, np.zeros(121), still)
    model = PathModel(nodes)
    true = np.concatenate(([0.0], np.cumsum(1.35 * motion)))
    at = np.array((0, 40, 80, 120))
    found = smooth_path(model, WalkFixes(at, true[at], 0.45)).state
    assert found.scale == pytest.approx(np.log(1.35), abs=0.1)
    assert np.abs(found.position - true).max() < 0.5


def test_a_fix_that_is_told_to_be_rough_weighs_less() -> None:
    model, fixes, _ = made(7)
    rough = replace(fixes, share=np.array((1.0, 4.0, 1.0)))
    off = [np.abs(smooth_path(model, each).state.position[fixes.node] - fixes.position) for each in (fixes, rough)]
    assert off[1][1] > off[0][1] + 0.2
    assert off[1][2] < off[0][2]


SEEDS = range(6)
INSIDE_95 = 2.45


def errors_and_sigmas_m(seed: int, seconds: float, count: int) -> tuple[FloatArray, FloatArray, ReckonedWalk]:
    """Errors (n,), sigmas per axis (n,) at five moments a second, and the walk, through so many true fixes."""
    log, time_ns, place = simulated(seed, seconds)
    sensed = SensedWalk.of(log)
    assert sensed is not None
    walk = sensed.path(true_fixes(time_ns, place, count), speed_model(), DeadReckoningSettings())
    at_s = np.arange(0.0, sensed.signals.time_s[-1], 0.2)
    found, covariance = walk.at(at_s)
    at_ns = sensed.signals.start_ns + (at_s * 1e9).astype(np.int64)
    true = np.column_stack([np.interp(at_ns, time_ns, place[:, axis]) for axis in (0, 1)])
    return np.linalg.norm(found - true, axis=1), np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2), walk


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seconds", "count"),
    [(120.0, 2), *(pytest.param(*more, marks=pytest.mark.campaign) for more in ((300.0, 2), (300.0, 3), (120.0, 5)))],
)
def test_stated_regions_contain_the_walk_however_few_its_fixes_are(seconds: float, count: int) -> None:
    walks = [errors_and_sigmas_m(seed, seconds, count)[:2] for seed in SEEDS]
    error_m, sigma_m = (np.concatenate(parts) for parts in zip(*walks, strict=True))
    assert np.mean(error_m < INSIDE_95 * sigma_m) > 0.93
    assert (error_m < 5 * sigma_m + 0.5).all()


@pytest.mark.parametrize(
    ("seconds", "count"),
    [(120.0, 5), *(pytest.param(*more, marks=pytest.mark.campaign) for more in ((120.0, 9), (300.0, 20)))],
)
def test_with_enough_fixes_sigma_stays_that_of_the_path(seconds: float, count: int) -> None:
    for seed in SEEDS:
        _, sigma_m, walk = errors_and_sigmas_m(seed, seconds, count)
        own = np.trace(walk.path.covariance[:, :2, :2], axis1=1, axis2=2) / 2 + walk.path.scatter_m**2
        own_m = np.sqrt(np.interp(np.arange(len(sigma_m)) * 0.2, walk.nodes.time_s, own))
        assert np.median(sigma_m / own_m) == pytest.approx(1.0, abs=0.03)
