"""Maps in unknown frames are put together where landmarks tie them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.estimation.landmark_survey.local_maps import building, seen_from, surveyed
from vislam2tag.estimation.landmark_survey.local_map import tied_to_survey

ANGLE = st.floats(-np.pi, np.pi)
FAR = st.floats(-500, 500)
NONE = np.full(12, np.nan)


@given(st.integers(0, 1000), ANGLE, ANGLE, FAR, FAR)
def test_maps_tied_over_others_lie_where_they_were_walked(seed: int, a: float, b: float, x: float, y: float) -> None:
    place, _ = building(12, seed)
    maps = [
        seen_from(place, NONE, [0, 1, 2, 3, 4], a, complex(x, y)),
        seen_from(place, NONE, [3, 4, 5, 6, 7], b, complex(y, x)),
        seen_from(place, NONE, [6, 7, 8, 9], a - b, 3j),
    ]
    chart = tied_to_survey(maps, surveyed(place, [0, 2]))
    assert chart.position[:10] == pytest.approx(place[:10], abs=1e-6)
    assert chart.origin == pytest.approx(np.array([complex(x, y), complex(y, x), 3j]), abs=1e-6)
    assert np.exp(1j * chart.turn_rad) == pytest.approx(np.exp(1j * np.array([a, b, a - b])), abs=1e-6)
    assert np.isnan(chart.position[10:]).all()


def test_two_walks_with_one_surveyed_landmark_each_are_tied_together() -> None:
    place, _ = building(12, 1)
    maps = [seen_from(place, NONE, [0, 2, 3], 1.0, 5j), seen_from(place, NONE, [2, 3, 9], -2.0, 7 + 0j)]
    chart = tied_to_survey(maps, surveyed(place, [0, 9]))
    assert chart.members.all()
    assert chart.position[[0, 2, 3, 9]] == pytest.approx(place[[0, 2, 3, 9]], abs=1e-6)


def test_one_common_landmark_ties_if_both_know_its_heading() -> None:
    place, heading = building(12, 2)
    priors = surveyed(place, [0])
    for told, tied in ((NONE, False), (heading, True)):
        priors.heading_rad[0] = told[0]
        chart = tied_to_survey([seen_from(place, heading, [0, 1, 2], 1.0, 5j)], priors)
        assert chart.members.tolist() == [tied]


def test_walks_without_a_tie_stay_out() -> None:
    place, _ = building(12, 3)
    maps = [seen_from(place, NONE, [0, 1, 2], 1.0, 5j), seen_from(place, NONE, [2, 5, 6], 2.0, 1j)]
    chart = tied_to_survey(maps, surveyed(place, [0, 1]))
    assert chart.members.tolist() == [True, False]
    assert np.isnan(chart.position[[5, 6]]).all()


@given(st.integers(0, 200), ANGLE)
def test_a_moved_sheet_does_not_turn_the_others(seed: int, turn: float) -> None:
    place, _ = building(12, seed)
    moved = place.copy()
    moved[4] += 6 - 5j
    maps = [seen_from(place, NONE, list(range(8)), turn, 5j), seen_from(moved, NONE, list(range(2, 12)), 2.0, 1j)]
    chart = tied_to_survey(maps, surveyed(place, [0, 1, 2]))
    others = [i for i in range(12) if i != 4]
    assert np.abs(chart.position[others] - place[others]).max() < 0.5
