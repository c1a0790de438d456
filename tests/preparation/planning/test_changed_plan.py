"""Plans changed by hand: what is expected is what solving everything anew gives."""

from __future__ import annotations

import numpy as np
import pytest

from tests.preparation.planning.floors import nothing_given, ring
from vislam2tag.preparation.planning.changed_plan import ChangedPlan
from vislam2tag.preparation.planning.corridors import typical_walks
from vislam2tag.preparation.planning.floor import plan_floor
from vislam2tag.preparation.planning.prediction import expected_on_walks
from vislam2tag.preparation.planning.refine import sigma_map
from vislam2tag.preparation.planning.settings import PlanSettings

SETTINGS = PlanSettings(further=1)


@pytest.fixture(scope="module")
def changed() -> ChangedPlan:
    space, graph = ring()
    return ChangedPlan(plan_floor(space, graph, SETTINGS, nothing_given()), graph, SETTINGS)


def test_the_plan_as_it_is_is_expected_as_it_was(changed: ChangedPlan) -> None:
    found, design = changed.expectation(changed.design.place), changed.design
    assert np.array_equal(found.sigma.sigma_m, design.sigma.sigma_m, equal_nan=True)
    assert found.longest_m == design.longest_m
    again = changed.designed(design.place)
    assert np.array_equal(again.line_deviations_m, design.line_deviations_m)
    assert again.classes == design.classes
    assert np.array_equal(again.tour.visit, design.tour.visit)


def test_a_moved_landmark_is_expected_as_if_all_walks_were_solved_anew(changed: ChangedPlan) -> None:
    design = changed.design
    changed.expectation(design.place)
    others = design.place[1:]
    aside = design.places.position[design.place[0]] + (3.0, 0.5)
    place = np.array([changed.nearest_place(aside, others), *others])
    assert place[0] != design.place[0]
    assert np.linalg.norm(design.places.position[place[0]] - aside) < 2.0
    found = changed.expectation(place)
    whole = expected_on_walks(typical_walks(ring()[1]), changed.designed(place).landmarks, SETTINGS.survey_sigma_m)
    assert np.array_equal(found.sigma.sigma_m, sigma_map(design.space, whole).sigma_m, equal_nan=True)
    assert not np.array_equal(found.sigma.sigma_m, design.sigma.sigma_m, equal_nan=True)


def test_no_two_landmarks_hang_at_one_station(changed: ChangedPlan) -> None:
    design = changed.design
    taken = design.places.position[design.place[1]]
    nearest = changed.nearest_place(taken, design.place[1:])
    assert design.places.station[nearest] not in design.places.station[design.place[1:]]


def test_one_landmark_less_leaves_a_longer_way_and_one_more_a_smaller_error(changed: ChangedPlan) -> None:
    design = changed.design
    assert changed.expectation(design.place[1:]).longest_m > design.longest_m
    assert changed.further(design.place, 1) == [design.further[0].place]
