"""Of plans with the fewest landmarks a good one.

Expected sigmas in cells and by distance.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.preparation.planning.floors import INNER, ring, stations_each_metre, ways_with
from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.planning.demands import demands_of, walking_distances
from vislam2tag.preparation.planning.prediction import ExpectedLabels, StationPasses, WalkCosts, gap_costs
from vislam2tag.preparation.planning.refine import (
    choose_walls,
    distance_classes,
    improve_stations,
    line_deviation_m,
    neighbourhoods,
    sigma_map,
)
from vislam2tag.preparation.planning.sheet_places import SheetPlaces


def there_and_back(length: float) -> FloatArray:
    x = np.concatenate((np.arange(0.0, length, 0.1), np.arange(length, 0.0, -0.1)))
    return np.column_stack((x, np.zeros_like(x)))


def test_three_landmarks_in_a_corridor_end_up_evenly_spread() -> None:
    ways = ways_with([30], [(0, 1)], 2)
    stations = stations_each_metre(ways)
    everywhere = np.ones(30, dtype=np.bool_)
    passes = StationPasses.of([there_and_back(30.0)], stations.point)
    crowded = np.isin(np.arange(30), [0, 1, 2])
    moved = improve_stations(
        crowded, crowded, everywhere, [], walking_distances(ways, stations), passes, gap_costs(0.02)
    )
    spread = np.flatnonzero(moved)
    # Who turns round at the end of a corridor is lost for twice the way: the outer ones stand nearer to the ends.
    assert spread[0] <= 7
    assert spread[-1] >= 19
    assert np.diff(spread).min() >= 5


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.floats(0.2, 0.8))
def test_moves_break_no_row_leave_fixed_ones_and_help(seed: int, share: float) -> None:
    ways = ways_with([9, 7, 8], [(0, 1), (1, 2), (1, 3)], 4)
    stations = stations_each_metre(ways)
    everywhere = np.ones(24, dtype=np.bool_)
    rng = np.random.default_rng(seed)
    rows = demands_of(ways, stations, everywhere, 10.0, 3.0).rows
    chosen = rng.random(24) < share
    met = [row for row in rows if chosen[sorted(row)].any()]
    fixed = chosen & (rng.random(24) < 0.3)
    passes = StationPasses.of([there_and_back(9.0), there_and_back(7.0)], stations.point)
    costs = gap_costs(0.02)
    moved = improve_stations(chosen, chosen & ~fixed, everywhere, met, walking_distances(ways, stations), passes, costs)
    assert moved.sum() == chosen.sum()
    assert moved[fixed].all()
    assert all(moved[sorted(row)].any() for row in met)
    assert WalkCosts(passes, costs, moved).total <= WalkCosts(passes, costs, chosen).total + 1e-9


@given(st.floats(-np.pi, np.pi), st.floats(0.0, 5.0))
def test_the_width_is_how_far_points_lie_off_their_line(angle: float, off: float) -> None:
    turn = np.array([(np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle))])
    points = np.array([(-20.0, off), (20.0, off), (-20.0, -off), (20.0, -off)]) @ turn.T
    assert line_deviation_m(points) == pytest.approx(off, abs=1e-6)
    assert line_deviation_m(points[:2]) == 0.0


def test_walls_are_chosen_so_that_landmarks_lie_off_one_line() -> None:
    station = np.repeat(np.arange(4), 2)
    position = np.array([(10.0 * i, y) for i in range(4) for y in (0.0, 2.4)])
    places = SheetPlaces(
        station,
        position,
        np.tile([(0.0, 1.0), (0.0, -1.0)], (4, 1)),
        np.full(8, 1.2),
        np.full(8, 3.0),
        np.full(8, 0.45),
        ("A4",) * 8,
    )
    distance = np.abs(np.arange(4)[:, None] - np.arange(4)) * 10.0
    chosen = choose_walls(np.arange(4), places, np.empty((0, 2)), np.empty(0, dtype=np.int64), distance)
    assert places.station[chosen].tolist() == [0, 1, 2, 3]
    for group in neighbourhoods(np.arange(4), distance):
        assert line_deviation_m(position[chosen][group]) > 0.9


def test_a_neighbourhood_is_a_landmark_and_its_nearest_ones() -> None:
    distance = np.abs(np.subtract.outer(np.arange(10.0), np.arange(10.0)))
    groups = neighbourhoods(np.array([0, 3, 4, 9, 8]), distance)
    assert [group[0] for group in groups] == [0, 1, 2, 3, 4]
    assert sorted(groups[3].tolist()) == [1, 2, 3, 4]


def walk(y: float, variance: float) -> ExpectedLabels:
    path = np.column_stack((np.arange(1.0, 29.0, 0.1), np.full(280, y)))
    return ExpectedLabels(path, np.tile(np.eye(2) * variance, (280, 1, 1)))


def test_cells_hold_what_their_walks_expect_and_nothing_lies_in_walls() -> None:
    space, _ = ring()
    found = sigma_map(space, [walk(1.0, 0.04), walk(1.0, 0.08), walk(15.0, 0.01)])
    low, high = (found.grid.cells_of(np.array([(10.0, y)]))[0] for y in (1.0, 15.0))
    assert found.sigma_m[tuple(low)] == pytest.approx(np.sqrt(0.06))
    assert found.sigma_m[tuple(high)] == pytest.approx(0.1)
    inside = found.grid.cells_of(np.array([((INNER[0] + INNER[2]) / 2, (INNER[1] + INNER[3]) / 2)]))[0]
    assert np.isnan(found.sigma_m[tuple(inside)])
    side = found.grid.cells_of(np.array([(1.0, 5.0)]))[0]
    assert found.sigma_m[tuple(side)] == pytest.approx(np.sqrt(0.06), rel=0.05)


def test_all_that_can_be_walked_has_a_value_however_far_from_a_walk() -> None:
    space, _ = ring()
    short = ExpectedLabels(np.array([(1.0, 1.0)]), np.eye(2)[None] * 0.04)
    found = sigma_map(space, [short])
    cells = np.argwhere(np.ones(found.grid.shape, dtype=np.bool_))
    walkable = (space.clearance_at(found.grid.centres_m(cells)) > 0.2).reshape(found.grid.shape)
    assert walkable.any()
    assert found.sigma_m[walkable] == pytest.approx(0.2)


def test_without_walks_nothing_is_expected() -> None:
    space, _ = ring()
    assert np.isnan(sigma_map(space, []).sigma_m).all()
    assert distance_classes(space, np.array([(5.0, 0.0)]), []) == []


def test_classes_go_by_the_way_to_the_nearest_landmark() -> None:
    space, _ = ring()
    classes = distance_classes(space, np.array([(1.0, 0.0)]), [walk(1.0, 0.04)])
    assert [(one.from_m, one.to_m) for one in classes][:3] == [(0.0, 5.0), (5.0, 10.0), (10.0, 15.0)]
    assert sum(one.share for one in classes) == pytest.approx(1.0, abs=1e-3)
    assert all(one.sigma_m == pytest.approx(0.2) for one in classes)
    assert all(one.error_m == pytest.approx(0.2 * np.sqrt(np.pi / 2), abs=1e-4) for one in classes)
