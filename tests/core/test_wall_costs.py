"""What it costs to walk through each place of a floor."""

from __future__ import annotations

import numpy as np
import pytest

from tests.estimation.floor_plan.plans import area_of
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.wall_costs import (
    AT_WALL_NATS_M,
    COARSE,
    FINE_M,
    FURNITURE_SHARE,
    NEAR_WALL_M,
    OUTSIDE_NATS_M,
    POSITION_M,
    REACH_M,
    WallCosts,
    on_common_cells,
)

ORIGIN_M = (3.0, -2.0)
ROOM = (1.0, 1.0, 9.0, 7.0)
SIZE_M = (10.0, 8.0)


def room(cell_m: float = FINE_M) -> WalkableArea:
    """A room of 8 x 6 m with walls of a metre around it."""
    mask = np.zeros((round(SIZE_M[1] / cell_m), round(SIZE_M[0] / cell_m)), dtype=np.bool_)
    left, low, right, high = (round(edge / cell_m) for edge in ROOM)
    mask[low:high, left:right] = True
    return WalkableArea(mask, ORIGIN_M, cell_m)


def at(costs: WallCosts, x: float, y: float) -> float:
    """Cost at a place relative to the origin, metres."""
    return float(costs.cost[int(y / FINE_M), int(x / FINE_M)])


def test_walls_cost_most_their_surroundings_less_and_the_middle_nothing() -> None:
    costs = WallCosts.of(room())
    assert costs.origin_m == ORIGIN_M
    assert costs.cost.shape == (80, 100)
    assert at(costs, 0.5, 0.5) == at(costs, 9.5, 4.0) == OUTSIDE_NATS_M
    for number, away_m in enumerate((0.05, 0.15, 0.25)):
        expected = AT_WALL_NATS_M * (1 - away_m / NEAR_WALL_M)
        assert at(costs, 1.05 + number * FINE_M, 4.0) == pytest.approx(expected, abs=1e-5)
    assert at(costs, 5.0, 4.0) == 0
    assert set(np.unique(costs.cost[15:65, 15:85])) == {0.0}


def test_the_edge_of_the_plan_is_a_wall() -> None:
    costs = WallCosts.of(WalkableArea(np.ones((40, 40), dtype=np.bool_), (0.0, 0.0), FINE_M))
    assert at(costs, 0.05, 2.0) == pytest.approx(AT_WALL_NATS_M * (1 - 0.05 / NEAR_WALL_M), abs=1e-5)
    assert at(costs, 2.0, 2.0) == 0


def wall_across(*gaps: tuple[int, int]) -> WallCosts:
    """A room with a wall at y = 4 m whose ink is missing between some columns."""
    area = room()
    area.mask[39:41] = False
    for start, stop in gaps:
        area.mask[39:41, start:stop] = True
    return WallCosts.of(area)


@pytest.mark.parametrize(("columns", "cost"), [(5, OUTSIDE_NATS_M), (8, 0.0)])
def test_nobody_goes_through_a_narrow_gap_in_a_wall(columns: int, cost: float) -> None:
    assert at(wall_across((40, 40 + columns)), 4.0 + columns * FINE_M / 2, 4.0) == cost


def test_a_piece_of_wall_between_gaps_is_no_furniture() -> None:
    costs = wall_across((40, 48), (56, 64))
    assert at(costs, 5.2, 4.0) == OUTSIDE_NATS_M
    assert at(costs, 4.4, 4.0) == 0


@pytest.mark.parametrize(("side_m", "share"), [(2.4, FURNITURE_SHARE), (2.7, 1.0)])
def test_what_stands_free_and_is_small_may_be_furniture(side_m: float, share: float) -> None:
    area = room()
    low, left = 30, 35
    side = round(side_m / FINE_M)
    area.mask[low : low + side, left : left + side] = False
    costs = WallCosts.of(area)
    assert at(costs, 4.0, 4.0) == pytest.approx(share * OUTSIDE_NATS_M)
    beside = costs.cost[low + side // 2, left - 1]
    assert beside == pytest.approx(share * AT_WALL_NATS_M * (1 - 0.05 / NEAR_WALL_M), abs=1e-5)
    assert at(costs, 0.5, 4.0) == OUTSIDE_NATS_M


def test_a_small_piece_of_a_wall_is_no_furniture() -> None:
    area = room()
    area.mask[10:20, 30:33] = False  # from the lower wall on
    assert at(WallCosts.of(area), 3.15, 1.5) == OUTSIDE_NATS_M


@pytest.mark.parametrize(("deep_m", "share"), [(0.8, FURNITURE_SHARE), (0.2, 1.0)])
def test_what_is_thicker_than_a_wall_may_be_furniture_at_a_wall(deep_m: float, share: float) -> None:
    area = WalkableArea(np.ones((80, 100), dtype=np.bool_), ORIGIN_M, FINE_M)
    area.mask[40:42] = False
    area.mask[42 : 42 + round(deep_m / FINE_M), 30:45] = False
    costs = WallCosts.of(area)
    assert at(costs, 3.75, 4.35) == pytest.approx(share * OUTSIDE_NATS_M)
    assert at(costs, 2.75, 4.15) == OUTSIDE_NATS_M


@pytest.mark.parametrize(("long_m", "share"), [(0.9, FURNITURE_SHARE), (1.5, 1.0)])
def test_a_line_that_stands_free_is_the_rest_of_a_wall(long_m: float, share: float) -> None:
    area = room()
    area.mask[30:32, 35 : 35 + round(long_m / FINE_M)] = False
    assert at(WallCosts.of(area), 3.85, 3.05) == pytest.approx(share * OUTSIDE_NATS_M)


def test_floors_come_on_common_cells() -> None:
    own = WallCosts.of(room())
    other = WallCosts(np.zeros((30, 20), dtype=np.float32), (ORIGIN_M[0] - 1.0, ORIGIN_M[1] + 7.0))
    common = on_common_cells({0: own, 3: other})
    assert {one.cost.shape for one in common.values()} == {(100, 110)}
    assert {one.origin_m for one in common.values()} == {(ORIGIN_M[0] - 1.0, ORIGIN_M[1])}
    np.testing.assert_array_equal(common[0].cost[:80, 10:], own.cost)
    np.testing.assert_array_equal(common[3].cost[70:, :20], 0)
    assert common[3].cost.sum() == OUTSIDE_NATS_M * (100 * 110 - 600)


def test_beside_furniture_and_a_wall_the_wall_counts() -> None:
    area = room()
    area.mask[30:40, 12:16] = False  # 0.2 m off the left wall
    between = WallCosts.of(area).cost[35, 11]
    assert between == pytest.approx(AT_WALL_NATS_M * (1 - 0.15 / NEAR_WALL_M), abs=1e-5)


@pytest.mark.parametrize("cell_m", [0.05, 0.2, 0.25])
def test_cells_of_other_sizes_give_the_same_costs(cell_m: float) -> None:
    costs, expected = WallCosts.of(room(cell_m)), WallCosts.of(room())
    assert costs.cost.shape == expected.cost.shape
    assert costs.cost == pytest.approx(expected.cost, abs=1e-5)


def test_a_fine_cell_is_blocked_if_its_middle_is() -> None:
    mask = np.ones((40, 40), dtype=np.bool_)
    mask[:, 13:27] = False  # 3.25 to 6.75 m
    blocked = WallCosts.of(WalkableArea(mask, ORIGIN_M, 0.25)).cost[50] == OUTSIDE_NATS_M
    assert np.flatnonzero(blocked).tolist() == list(range(32, 67))
    assert len(blocked) == 100


def test_positions_are_cells_four_times_as_wide() -> None:
    costs = WallCosts.of(area_of([ROOM], (10.0, 8.2), ORIGIN_M))  # 82 rows of 0.1 m
    assert costs.positions.shape == (21, 25)
    assert (costs.positions.cell_m, costs.positions.origin_m) == (POSITION_M, ORIGIN_M)


@pytest.mark.parametrize("rows", [80, 81, 82, 83])
def test_interleaved_costs_are_those_of_the_map_with_a_margin(rows: int) -> None:
    rng = np.random.default_rng(rows)
    costs = WallCosts(rng.uniform(0, 9, (rows, 50)).astype(np.float32), ORIGIN_M)
    margin = round(REACH_M / POSITION_M)
    parts = costs.interleaved
    assert parts.shape == (COARSE, COARSE, costs.positions.rows + 2 * margin, costs.positions.columns + 2 * margin)
    plain = parts.transpose(2, 0, 3, 1).reshape(parts.shape[2] * COARSE, parts.shape[3] * COARSE)
    inside = plain[margin * COARSE :, margin * COARSE :][:rows, :50]
    np.testing.assert_array_equal(inside, costs.cost)
    assert plain.sum() - inside.sum() == pytest.approx((plain.size - inside.size) * OUTSIDE_NATS_M, rel=1e-4)
