"""A walk reduced to a map of its landmarks.

Maps in unknown frames are put together where landmarks tie them.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.estimation.landmark_survey.local_maps import building, seen_from, surveyed
from tests.walks import corridor_walk
from vislam2tag.core.transforms import Similarity2
from vislam2tag.estimation.landmark_survey.local_map import LocalMap, tied_to_survey
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.smoother import solve_in_own_frame

STATIONS = {"a": (5.0, 0.5), "b": (15.0, -0.5), "c": (30.0, 0.6)}


@pytest.fixture(name="local", scope="module")
def _local() -> LocalMap:
    bcs_t_acs = Similarity2(complex(np.exp(0.7j)), 3 - 2j)
    camera, log, _, _ = corridor_walk(bcs_t_acs, STATIONS)
    return LocalMap.of(solve_in_own_frame(WalkObservations.of(camera, log, 6.0)))


def test_landmarks_lie_as_in_the_building_but_for_turn_and_place(local: LocalMap) -> None:
    true = np.array([complex(*place) for place in STATIONS.values()])
    assert np.abs(np.diff(local.position)) == pytest.approx(np.abs(np.diff(true)), abs=1e-3)
    assert local.passes.tolist() == [1, 1, 1]


def test_landmarks_farther_along_the_walk_are_less_certain(local: LocalMap) -> None:
    variance = np.diag(local.covariance)[:6].reshape(3, 2).sum(axis=1)
    assert variance[0] < variance[1] < variance[2]
    assert np.linalg.eigvalsh(local.covariance[:6, :6]).min() > 0


def test_a_selection_keeps_what_belongs_together(local: LocalMap) -> None:
    last = local.select(np.array([False, False, True]))
    assert last.position.tolist() == local.position[2:].tolist()
    assert last.covariance.tolist() == local.covariance[np.ix_([4, 5, 8], [4, 5, 8])].tolist()


def test_headings_that_nobody_logged_are_not_observed(local: LocalMap) -> None:
    unlogged = LocalMap(local.landmark, local.position, np.full(3, np.nan), local.covariance, local.passes)
    assert unlogged.observed.tolist() == list(range(6))


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
