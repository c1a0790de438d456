"""The fewest stations, by the integer programme and by trying all sets."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from vislam2tag.core.arrays import BoolArray
from vislam2tag.preparation.planning.demands import Cover, StationSet, cover, row_matrix, time_out

COUNT = 9
ROWS = st.lists(st.frozensets(st.integers(0, COUNT - 1), min_size=1, max_size=4), min_size=1, max_size=12)


def solved(rows: list[StationSet], fixed: BoolArray | None = None, later: list[StationSet] | None = None) -> Cover:
    nothing = np.zeros(COUNT, dtype=np.bool_)
    held = nothing if fixed is None else fixed
    return cover(
        rows,
        held,
        lambda chosen: {row for row in later or [] if not chosen[sorted(row)].any()},
        allowed=~nothing,
        gap=0.0,
        nodes=1000,
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
