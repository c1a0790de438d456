"""All poses of a stretch: how well its shape fits at each, and where the next one is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.wall_costs import FINE_M, OUTSIDE_NATS_M, POSITION_M, Float32Array, WallCosts
from vislam2tag.estimation.floor_plan.pose_grid import (
    DRIFT_RAD,
    WIDE_SHARE,
    WORST_NATS,
    YAW_RAD,
    YAWS,
    PoseGrid,
    Transition,
    box_around,
)
from vislam2tag.estimation.floor_plan.stretches import SPACING_M, Link

ORIGIN_M = (-2.0, 5.0)


def random_costs(seed: int, rows: int = 61, columns: int = 90) -> WallCosts:
    """Costs without any order; the last row of positions is not filled."""
    rng = np.random.default_rng(seed)
    return WallCosts(rng.uniform(0, 8, (rows, columns)).astype(np.float32), ORIGIN_M)


def free(rows: int, columns: int) -> PoseGrid:
    """Positions (rows, columns) that cost nothing."""
    return PoseGrid(WallCosts(np.zeros((4 * rows, 4 * columns), dtype=np.float32), ORIGIN_M))


def link(step: complex, sigma_m: float = 0.0, sigma_rad: float = 0.0, jumps: int = 0) -> Link:
    return Link(step, max(abs(step), 2.0), sigma_m, sigma_rad, jumps)


def at(grid: PoseGrid, yaw: int, row: int, column: int) -> Float32Array:
    """All weight at one pose."""
    weight = np.zeros(grid.shape, dtype=np.float32)
    weight[yaw, row, column] = 1
    return weight


def mean_place(grid: PoseGrid, weight: Float32Array) -> complex:
    """Mean of the positions, complex metres."""
    by_place = weight.sum(axis=0, dtype=np.float64).ravel()
    place, _ = grid.place(np.arange(by_place.size))  # at the first yaw
    return complex((by_place * place).sum() / by_place.sum())


WHOLE = (slice(0, 16), slice(0, 23))


def direct_fit(costs: WallCosts, shape: ComplexArray, yaw_rad: float, place: complex) -> float:
    """Log-likelihood at one pose, point by point."""
    total = 0.0
    for point in (place + shape * np.exp(1j * yaw_rad)).tolist():
        row, column = int((point.imag - ORIGIN_M[1]) // FINE_M), int((point.real - ORIGIN_M[0]) // FINE_M)
        inside = 0 <= row < costs.cost.shape[0] and 0 <= column < costs.cost.shape[1]
        total += float(costs.cost[row, column]) if inside else OUTSIDE_NATS_M
    return -min(total * SPACING_M, WORST_NATS)


@pytest.mark.parametrize(("points", "spread_m", "is_capped"), [(4, 0.7, False), (20, 3.0, True), (5, 7.0, False)])
def test_the_fit_is_the_sum_over_the_points(points: int, spread_m: float, is_capped: bool) -> None:
    rng = np.random.default_rng(points)
    grid = PoseGrid(random_costs(points))
    shape: ComplexArray = spread_m * (rng.uniform(-1, 1, points) + np.complex128(1j) * rng.uniform(-1, 1, points))
    yaws = np.array([0, 7, 45, 119])
    fit = grid.fit(shape, yaws, WHOLE)
    assert fit.shape == (4, 16, 23)
    for number, yaw in enumerate(yaws.tolist()):
        for row, column in rng.integers(0, (16, 23), (40, 2)).tolist():
            (place,), (yaw_rad,) = grid.place(np.ravel_multi_index(([yaw], [row], [column]), grid.shape))
            expected = direct_fit(grid.costs, shape, yaw_rad, place)
            assert fit[number, row, column] == pytest.approx(expected, abs=1e-4)
    assert (fit == -WORST_NATS).any() == is_capped


def test_points_beyond_reach_count_as_outside() -> None:
    grid = free(5, 5)
    fit = grid.fit(np.array([0, 20.0, -40.0, 30j, 400 - 400j]), np.arange(YAWS), (slice(0, 5), slice(0, 5)))
    np.testing.assert_allclose(fit, -4 * OUTSIDE_NATS_M * SPACING_M, rtol=1e-5)


def test_a_box_has_the_fit_of_the_whole_grid() -> None:
    grid = PoseGrid(random_costs(3))
    shape = np.array([0.3 + 1j, -2 + 0.4j, 1.7 - 0.9j])
    whole = grid.fit(shape, np.arange(YAWS), WHOLE)
    box = slice(3, 11), slice(8, 23)
    np.testing.assert_array_equal(grid.fit(shape, np.array([5, 60]), box), whole[[5, 60]][:, *box])


def test_places_are_the_middles_of_their_cells() -> None:
    place, yaw_rad = free(4, 6).place(np.array([0, 5, 6, 24 * 30 + 23]))
    assert place == pytest.approx([-1.8 + 5.2j, 0.2 + 5.2j, -1.8 + 5.6j, 0.2 + 6.4j])
    assert yaw_rad == pytest.approx([0, 0, 0, np.pi / 2])


@settings(max_examples=25)
@given(
    step=st.complex_numbers(max_magnitude=6, allow_nan=False),
    sigma_m=st.floats(0, 1.5),
    sigma_rad=st.floats(0, 1),
    jumps=st.integers(0, 3),
    seed=st.integers(0, 1000),
)
def test_backward_is_the_transpose_of_forward(
    step: complex, sigma_m: float, sigma_rad: float, jumps: int, seed: int
) -> None:
    grid = free(9, 12)
    rng = np.random.default_rng(seed)
    transition = Transition(grid, link(step, sigma_m, sigma_rad, jumps))
    before, after = (rng.uniform(0, 1, grid.shape).astype(np.float32) for _ in range(2))
    forward, backward = transition.forward(before, 0.0)[0], transition.backward(after, 0.0)[0]
    one, other = (float((a.astype(np.float64) * b).sum()) for a, b in ((after, forward), (backward, before)))
    assert one == pytest.approx(other, rel=1e-4)


@settings(max_examples=25)
@given(
    step=st.complex_numbers(max_magnitude=6, allow_nan=False),
    sigma_m=st.floats(0, 0.4),
    yaw=st.integers(0, YAWS - 1),
)
def test_away_from_edges_no_weight_is_lost_and_shifts_are_unbiased(step: complex, sigma_m: float, yaw: int) -> None:
    grid = free(40, 40)
    transition = Transition(grid, link(step, sigma_m))
    before = at(grid, yaw, 20, 20)
    for spread, sign in ((transition.forward(before, 0.0)[0], 1), (transition.backward(before, 0.0)[0], -1)):
        assert spread.sum(dtype=np.float64) == pytest.approx(1, abs=1e-3)
        share = spread.sum(axis=(1, 2), dtype=np.float64)
        half_m = sign * step / 2
        expected = half_m * grid.turns[yaw] + half_m * (share * grid.turns).sum()
        moved = mean_place(grid, spread) - mean_place(grid, before)
        assert abs(moved - expected) < POSITION_M / 3


def test_a_step_goes_where_the_yaw_points() -> None:
    grid = free(40, 40)
    quarter = YAWS // 4
    spread, yaws = Transition(grid, link(4 + 0j)).forward(at(grid, quarter, 20, 20), 1e-6)
    assert mean_place(grid, spread) - mean_place(grid, at(grid, quarter, 20, 20)) == pytest.approx(4j, abs=0.05)
    assert yaws.tolist() == np.flatnonzero(spread.sum(axis=(1, 2)) > 0).tolist()
    assert (yaws.min(), yaws.max()) == (quarter - 2, quarter + 2)


def spread_of_yaw(transition: Transition, yaw: int) -> FloatArray:
    """Share (yaws,) of each turn after all weight had one yaw, the yaw itself first."""
    grid = transition.grid
    spread = transition.forward(at(grid, yaw, *(side // 2 for side in grid.shape[1:])), 0.0)[0]
    return np.roll(spread.sum(axis=(1, 2), dtype=np.float64), -yaw)


@pytest.mark.parametrize("yaw", [0, 1, 63, 119])
def test_yaws_spread_alike_on_both_sides_of_any_yaw(yaw: int) -> None:
    turned = spread_of_yaw(Transition(free(12, 12), link(0j, sigma_rad=0.2)), yaw)
    np.testing.assert_allclose(turned[1:], turned[:0:-1], rtol=1e-3, atol=1e-9)
    signed = (np.arange(YAWS) + YAWS // 2) % YAWS - YAWS // 2
    sigma_rad = np.hypot(DRIFT_RAD * np.sqrt(2 / 12), 0.2)
    assert YAW_RAD * np.sqrt((turned * signed**2).sum()) == pytest.approx(sigma_rad, rel=0.02)


def test_an_unconnected_step_may_have_turned_much_more() -> None:
    grid = free(12, 12)
    plain, jumped = (spread_of_yaw(Transition(grid, link(0j, jumps=jumps)), 0) for jumps in (0, 1))
    far = slice(6, YAWS - 5)  # by 18 degrees and more: half of a normal distribution of 25 degrees
    assert plain[far].sum() < 1e-6
    assert jumped[far].sum() == pytest.approx(0.51 * WIDE_SHARE, rel=0.02)


def test_a_doubtful_step_spreads_positions_by_its_sigma() -> None:
    grid = free(60, 60)
    spread = Transition(grid, link(0j, sigma_m=1.0)).forward(at(grid, 0, 30, 30), 0.0)[0]
    place, _ = grid.place(np.arange(spread.size))
    x = place.real - place.real[30]
    sigma_m = np.hypot(1.0, 0.22)
    assert np.sqrt((spread.ravel() * x**2).sum(dtype=np.float64)) == pytest.approx(sigma_m, abs=0.03)
    assert spread.ravel()[np.abs(x) > 3 * sigma_m].sum() == pytest.approx(0.0027, abs=0.0008)


def test_weights_that_leave_the_plan_are_lost() -> None:
    grid = free(10, 10)
    spread, yaws = Transition(grid, link(30 + 0j)).forward(at(grid, 0, 5, 5), 0.0)
    assert not spread.any()
    assert len(yaws) == 0


def test_few_weights_spread_as_all_of_the_grid() -> None:
    grid = free(30, 30)
    transition = Transition(grid, link(3 - 2j, 0.2, 0.1))
    few = np.zeros(grid.shape, dtype=np.float32)
    few[10:13, 5:9, 18:22] = np.random.default_rng(1).uniform(0, 1, (3, 4, 4))
    everywhere = few + np.float32(1e-12)  # so that the box is the whole plan
    np.testing.assert_allclose(transition.forward(few, 0.0)[0], transition.forward(everywhere, 0.0)[0], atol=2e-5)


def test_the_density_is_what_spreads() -> None:
    grid = free(40, 40)
    transition = Transition(grid, link(5 + 2j, 0.3, 0.1))
    before = np.array([(10, 14, 14), (12, 15, 13), (8, 14, 15)])
    index = np.ravel_multi_index(before.T.tolist(), grid.shape)
    spreads = [transition.forward(at(grid, *pose), 0.0)[0].ravel() for pose in before.tolist()]
    after = np.argsort(-spreads[0])[:1000:7]
    density = transition.density(*grid.place(index), *grid.place(after))
    expected = np.stack([spread[after] for spread in spreads], axis=1)
    assert density.shape == expected.shape == (143, 3)
    assert expected[:, 0].sum() > 2 * expected[:, 2].sum() > 0
    np.testing.assert_allclose(density / density.max(), expected / expected.max(), atol=0.03)


def test_the_box_is_as_small_as_possible() -> None:
    weight = np.zeros((YAWS, 9, 7), dtype=np.float32)
    weight[3, 2, 5] = weight[70, 6, 1] = 1
    assert box_around(weight) == (slice(2, 7), slice(1, 6))
