"""What a set of landmarks costs on typical walks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.preparation.planning.test_prediction import STRAIGHT, sheets_at
from vislam2tag.preparation.planning.prediction import GAPS_M, StationPasses, WalkCosts, expected_along, gap_costs

COSTS = gap_costs(0.02)
POINTS = np.column_stack((np.arange(0.5, 60.0), np.zeros(60)))
PASSES = StationPasses.of([STRAIGHT, STRAIGHT[::-1], STRAIGHT[:300]], POINTS)


def test_longer_gaps_cost_more_than_their_length_and_ends_more_than_gaps() -> None:
    per_metre = COSTS.between[2:] / np.array(GAPS_M[2:])
    assert (np.diff(per_metre[3:]) > 0).all()
    assert (COSTS.ends[3:] > COSTS.between[3:]).all()


def test_the_table_comes_near_to_solving_the_walk() -> None:
    at = (6.0, 18.0, 33.0, 52.0)
    expected = expected_along(STRAIGHT, sheets_at(*at), 0.02)
    assert expected is not None
    assert COSTS.of_walk(np.array(at), 60.0) == pytest.approx(expected.variance_m2.sum() * 0.1, rel=0.3)


def test_a_station_is_passed_where_a_walk_is_nearest_to_it() -> None:
    rows = PASSES.of_station(20)
    assert PASSES.walk[rows].tolist() == [0, 1, 2]
    assert PASSES.at_m[rows] == pytest.approx([20.5, 39.5, 20.5], abs=0.06)
    assert PASSES.length_m == pytest.approx((60.0, 60.0, 29.9))


@settings(max_examples=40)
@given(st.sets(st.integers(0, 59), min_size=1, max_size=8), st.integers(0, 59))
def test_a_move_costs_what_the_new_set_costs(chosen: set[int], new: int) -> None:
    if new in chosen:
        return
    before, after = (np.isin(np.arange(60), sorted(each)) for each in (chosen, (chosen - {min(chosen)}) | {new}))
    walks = WalkCosts(PASSES, COSTS, before)
    total = walks.total
    gain = walks.gain(min(chosen), new)
    walks.move(min(chosen), new)
    assert walks.total == pytest.approx(WalkCosts(PASSES, COSTS, after).total)
    assert total - walks.total == pytest.approx(gain)
