"""Demands as rows: a set of landmarks meets them exactly where no walk is longer without one.

The fewest stations, by the integer programme and by trying all sets.
"""

from __future__ import annotations

from functools import cache
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.preparation.planning.floors import graph_of, stations_each_metre, ways_with
from vislam2tag.core.arrays import BoolArray
from vislam2tag.preparation.planning.corridors import Corridors, corridors_of
from vislam2tag.preparation.planning.demands import (
    Cover,
    StationSet,
    broken_spacing,
    cover,
    demands_of,
    open_area_rows,
    row_matrix,
    time_out,
    walking_distances,
    without_supersets,
)
from vislam2tag.site.walkable.graph import NodeKind


@st.composite
def floor_ways(draw: st.DrawFn) -> Corridors:
    """A few ways of whole metres that hang together, rings and parallel ways among them."""
    ends = draw(st.integers(2, 5))
    joined = [(draw(st.integers(0, end - 1)), end) for end in range(1, ends)]
    joined += draw(st.lists(st.tuples(st.integers(0, ends - 1), st.integers(0, ends - 1)), max_size=3))
    lengths = draw(st.lists(st.integers(1, 6), min_size=len(joined), max_size=len(joined)))
    return ways_with(lengths, joined, ends)


def longest_walk_m(ways: Corridors, chosen: BoolArray) -> float:
    """Longest walk between two landmarks, metre by metre: another way than windows to find the same.

    Each metre has its station in its middle, so that ``m`` metres without one between two landmarks are ``m + 1`` m.
    """
    lengths = ways.length_m.round().astype(int).tolist()
    start = np.concatenate(([0], np.cumsum(lengths)))

    def after(cell: tuple[int, int]) -> list[tuple[int, int]]:
        half, number = cell
        if number + 1 < lengths[half // 2]:
            return [(half, number + 1)]
        return [(onward, 0) for onward in ways.onward(half)]

    def has_landmark(cell: tuple[int, int]) -> bool:
        half, number = cell
        along = lengths[half // 2] - 1 - number if half % 2 else number
        return bool(chosen[start[half // 2] + along])

    open_cells: set[tuple[int, int]] = set()

    @cache
    def longest(cell: tuple[int, int]) -> float:
        if cell in open_cells:
            return np.inf
        if has_landmark(cell):
            return 0.0
        open_cells.add(cell)
        found = 1.0 + max(longest(other) for other in after(cell))
        open_cells.discard(cell)
        return found

    cells = [(half, number) for half in range(2 * len(lengths)) for number in range(lengths[half // 2])]
    return max(longest(cell) for cell in cells) + 1.0


@settings(max_examples=150)
@given(floor_ways(), st.integers(3, 8), st.integers(0, 2**32 - 1), st.floats(0.1, 0.9))
def test_a_walk_is_found_broken_exactly_where_it_is_too_long(
    ways: Corridors, spacing: int, seed: int, share: float
) -> None:
    stations = stations_each_metre(ways)
    chosen = np.random.default_rng(seed).random(len(stations.corridor)) < share
    everywhere = np.ones(len(chosen), dtype=np.bool_)
    assert bool(broken_spacing(ways, stations, everywhere, chosen, float(spacing))) == (
        longest_walk_m(ways, chosen) > spacing
    )


@settings(max_examples=100)
@given(floor_ways(), st.integers(3, 9))
def test_every_cover_is_a_cover_and_the_bound_holds(ways: Corridors, spacing: int) -> None:
    stations = stations_each_metre(ways)
    everywhere = np.ones(len(stations.corridor), dtype=np.bool_)
    demands = demands_of(ways, stations, everywhere, float(spacing), 3.0)
    assert demands.gaps == ()
    found = cover(
        demands.rows,
        ~everywhere,
        lambda chosen: broken_spacing(ways, stations, everywhere, chosen, float(spacing)),
        everywhere,
        time_limit_s=30.0,
    )
    assert longest_walk_m(ways, found.chosen) <= spacing
    assert found.bound <= found.number <= 1.1 * found.bound
    for way, length in enumerate(ways.length_m.tolist()):
        assert length < 3.0 or found.chosen[stations.corridor == way].any()


def test_a_spacing_that_no_wall_allows_is_told_with_its_place() -> None:
    ways = ways_with([30], [(0, 1)], 2)
    stations = stations_each_metre(ways)
    usable = np.ones(30, dtype=np.bool_)
    usable[8:26] = False
    demands = demands_of(ways, stations, usable, 15.0, 3.0)
    (gap,) = {gap.kind: gap for gap in demands.gaps}.values()
    assert gap.kind == "spacing"
    assert gap.length_m == pytest.approx(19.0)
    assert {gap.start[0], gap.stop[0]} == {7.5, 26.5}
    assert frozenset({7}) not in demands.rows or frozenset({26}) in demands.rows


def test_a_way_between_turns_without_a_wall_is_told_unless_it_is_short() -> None:
    ways = ways_with([4, 2, 9], [(0, 1), (1, 2), (2, 3)], 4)
    stations = stations_each_metre(ways)
    usable = stations.corridor == 2
    gaps = demands_of(ways, stations, usable, 50.0, 3.0).gaps
    assert [gap.length_m for gap in gaps if gap.kind == "turn"] == [4.0]


def test_open_areas_have_a_landmark_within_half_the_spacing_of_each_place() -> None:
    nodes = [(0.0, 0.0), (6.0, 0.0), (12.0, 0.0), (18.0, 0.0)]
    ways = corridors_of(graph_of(nodes, [(0, 1), (1, 2), (2, 3)], [NodeKind.OPEN] * 4), 0.6)
    stations = stations_each_metre(ways)
    rows, gaps = open_area_rows(ways, stations, np.ones(18, dtype=np.bool_), 7.5)
    assert gaps == []
    for end, row in zip(ways.ends, rows, strict=True):
        away = np.abs(stations.point[:, 0] - end[0])
        assert set(row) == set(np.flatnonzero(away <= 7.5).tolist())
    _, far = open_area_rows(ways, stations, np.arange(18) < 2, 7.5)
    assert [gap.length_m for gap in far] == [10.5, 16.5]


def test_walking_distances_take_the_shorter_of_two_ways() -> None:
    ways = ways_with([3, 9], [(0, 1), (0, 1)], 2)
    distance = walking_distances(ways, stations_each_metre(ways))
    assert distance[0, 2] == pytest.approx(2.0)
    assert distance[3, 11] == pytest.approx(0.5 + 3.0 + 0.5)
    assert np.allclose(distance, distance.T)


@given(st.lists(st.frozensets(st.integers(0, 8), min_size=1), max_size=30))
def test_rows_left_out_say_nothing_more(rows: list[frozenset[int]]) -> None:
    kept = without_supersets(rows)
    assert set(kept) <= set(rows)
    assert all(any(one <= row for one in kept) for row in rows)
    assert not any(a < b for a in kept for b in kept)


COUNT = 9
ROWS = st.lists(st.frozensets(st.integers(0, COUNT - 1), min_size=1, max_size=4), min_size=1, max_size=12)


def solved(rows: list[StationSet], fixed: BoolArray | None = None, later: list[StationSet] | None = None) -> Cover:
    nothing = np.zeros(COUNT, dtype=np.bool_)
    held = nothing if fixed is None else fixed
    return cover(
        rows,
        held,
        lambda chosen: {row for row in later or [] if not chosen[sorted(row)].any()},
        ~nothing,
        time_limit_s=20.0,
    )


def fewest(rows: list[StationSet], held: frozenset[int] = frozenset()) -> int:
    for size in range(len(held), COUNT + 1):
        for chosen in combinations(range(COUNT), size):
            if held <= set(chosen) and all(row & set(chosen) for row in rows):
                return size
    raise AssertionError


@settings(max_examples=60)
@given(ROWS)
def test_the_bound_is_the_number_that_trying_all_sets_finds(rows: list[StationSet]) -> None:
    found = solved(rows)
    assert all(found.chosen[sorted(row)].any() for row in rows)
    assert found.bound == found.number == fewest(rows)
    assert not found.cut_short


@settings(max_examples=40)
@given(ROWS, ROWS)
def test_rows_that_are_told_later_are_met_too(rows: list[StationSet], later: list[StationSet]) -> None:
    found = solved(rows, later=later)
    assert all(found.chosen[sorted(row)].any() for row in [*rows, *later])
    assert found.bound <= found.number == fewest([*rows, *later])


@settings(max_examples=40)
@given(ROWS, st.frozensets(st.integers(0, COUNT - 1), max_size=3))
def test_fixed_stations_are_chosen_and_counted(rows: list[StationSet], held: frozenset[int]) -> None:
    fixed = np.isin(np.arange(COUNT), sorted(held))
    found = solved(rows, fixed)
    assert found.chosen[sorted(held)].all()
    assert found.number == fewest(rows, held)


def test_nothing_demanded_is_nothing_chosen() -> None:
    found = solved([])
    assert (found.number, found.bound) == (0, 0)


def test_the_matrix_has_a_one_for_each_station_of_a_row() -> None:
    matrix = row_matrix([frozenset({2, 0}), frozenset({1})], 3)
    assert matrix.toarray().tolist() == [[1, 0, 1], [0, 1, 0]]


def test_only_the_time_limit_makes_a_plan_depend_on_the_machine() -> None:
    assert time_out(1, "Time limit reached. (HiGHS Status 13: Time limit reached)")
    assert not time_out(1, "Iteration limit reached. (HiGHS Status 14: Iteration limit reached)")
    assert not time_out(0, "Optimization terminated successfully. (HiGHS Status 7: Optimal)")
