"""What the smoother's own equations say of a walk before it is walked.

What a set of landmarks costs on typical walks.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vislam2tag.preparation.planning.prediction import (
    GAPS_M,
    PassedLandmarks,
    StationPasses,
    WalkCosts,
    expected_along,
    expected_on_walks,
    gap_costs,
    mean_error_m,
    passing,
    smoothed_walk,
)

STRAIGHT = np.column_stack((np.arange(0.0, 60.05, 0.1), np.zeros(601)))


def sheets_at(*x: float) -> PassedLandmarks:
    foot = np.array([(at, 0.0) for at in x]).reshape(-1, 2)
    return PassedLandmarks(foot + np.array((0.0, 1.1)), foot, np.full(len(x), 0.5))


def test_labels_are_surest_at_landmarks_and_least_sure_beyond_them() -> None:
    expected = expected_along(STRAIGHT, sheets_at(10.0, 25.0, 40.0), 0.02)
    assert expected is not None
    sigma = np.sqrt(expected.variance_m2)
    at = {x: sigma[round(10 * x)] for x in (0, 10, 25, 32.5, 40, 60)}
    assert at[25] < at[32.5] < at[60]
    assert at[25] < at[10] < at[0]


def test_one_landmark_more_makes_no_label_less_sure() -> None:
    few, more = (expected_along(STRAIGHT, sheets_at(*x), 0.02) for x in ((10.0, 50.0), (10.0, 30.0, 50.0)))
    assert few is not None
    assert more is not None
    assert (more.variance_m2 <= few.variance_m2 + 1e-9).all()
    assert more.variance_m2[300] < 0.7 * few.variance_m2[300]


def test_poorer_surveys_are_expected_to_label_worse() -> None:
    marks = sheets_at(10.0, 30.0, 50.0)
    usual = expected_on_walks([STRAIGHT], marks, 0.02)
    assert mean_error_m(expected_on_walks([STRAIGHT], marks, 0.3)) > 1.3 * mean_error_m(usual)


def test_a_walk_past_fewer_than_two_landmarks_cannot_be_mapped() -> None:
    assert expected_along(STRAIGHT, sheets_at(10.0), 0.02) is None
    assert expected_on_walks([STRAIGHT], sheets_at(), 0.02) == []
    assert np.isnan(mean_error_m([]))


def test_each_time_a_walk_comes_by_is_a_pass() -> None:
    there_and_back = np.vstack((STRAIGHT, STRAIGHT[::-1]))
    smoothed = smoothed_walk(there_and_back, sheets_at(10.0, 40.0), 0.02)
    assert smoothed is not None
    assert smoothed.model.observations.passes.at.tolist() == [100, 400, 801, 1101]
    assert smoothed.model.observations.passes.landmark.tolist() == [0, 1, 1, 0]
    assert passing([STRAIGHT], np.array([(20.0, 0.5), (20.0, 1.5)])).tolist() == [[True, False]]


def test_landmarks_that_a_walk_does_not_pass_change_nothing() -> None:
    near = expected_along(STRAIGHT, sheets_at(10.0, 40.0), 0.02)
    aside = sheets_at(10.0, 40.0).with_one(np.array((20.0, 9.0)), np.array((20.0, 8.0)), 0.5)
    with_far = expected_along(STRAIGHT, aside, 0.02)
    assert near is not None
    assert with_far is not None
    assert with_far.covariance == pytest.approx(near.covariance)


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
