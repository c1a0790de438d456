"""A whole plan of one floor.

Plans changed by hand: what is expected is what solving everything anew gives.

Which sheet is recognised from where.
"""

from __future__ import annotations

from dataclasses import replace
from math import radians, tan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.preparation.planning.floors import graph_of, nothing_given, ring
from vislam2tag.common.errors import SurveyError
from vislam2tag.preparation.planning.corridors import typical_walks
from vislam2tag.preparation.planning.demands import broken_spacing
from vislam2tag.preparation.planning.floor import STEPS, ChangedPlan, FloorConstraints, FloorDesign, plan_floor
from vislam2tag.preparation.planning.prediction import expected_on_walks, mean_error_m
from vislam2tag.preparation.planning.records import COLUMNS, PlanSummary, floor_summary, landmarks_text, new_ids
from vislam2tag.preparation.planning.refine import further_landmarks, sigma_map
from vislam2tag.preparation.planning.settings import ASIDE_M, CameraSettings, PlanSettings
from vislam2tag.preparation.sheets.settings import SHEET_SIZES

SETTINGS = PlanSettings(further=1)


@pytest.fixture(scope="module")
def design() -> FloorDesign:
    return plan_floor(*ring(), SETTINGS, nothing_given())


def chosen_of(design: FloorDesign) -> np.ndarray:
    held = design.fixed_station[design.fixed_station >= 0]
    return np.isin(np.arange(len(design.stations.corridor)), [*design.places.station[design.place], *held])


def test_a_ring_has_a_landmark_after_each_turn_and_none_too_far(design: FloorDesign) -> None:
    chosen = chosen_of(design)
    everywhere = np.ones(len(chosen), dtype=np.bool_)
    assert not broken_spacing(design.corridors, design.stations, everywhere, chosen, SETTINGS.spacing_m)
    assert {int(way) for way in design.stations.corridor[chosen]} == {0, 1, 2, 3}
    assert len(design.place) == design.cover.bound == 6
    assert 14.0 < design.longest_m <= 15.0
    assert broken_spacing(design.corridors, design.stations, everywhere, chosen, design.longest_m - 0.2)


def test_landmarks_lie_off_one_line_and_are_numbered_along_the_tour(design: FloorDesign) -> None:
    assert design.line_deviations_m.min() > 0.3
    met = list(dict.fromkeys(design.tour.visit.tolist()))
    assert met == list(range(len(design.place)))
    for landmark, at in zip(design.tour.visit.tolist(), design.tour.visit_m.tolist(), strict=True):
        arc = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(design.tour.line, axis=0), axis=1))))
        here = [np.interp(at, arc, design.tour.line[:, axis]) for axis in (0, 1)]
        assert np.linalg.norm(here - design.stations.point[design.places.station[design.place[landmark]]]) < 0.01


def test_a_floor_of_rooms_only_is_planned_through_its_rooms() -> None:
    space, graph = ring()
    rooms = replace(graph, in_room=np.ones_like(graph.in_room))
    found = plan_floor(space, rooms, SETTINGS.model_copy(update={"further": 0}), nothing_given())
    assert len(found.corridors.lines) == 4


def test_every_step_is_told_once() -> None:
    told: list[tuple[str, int]] = []
    settings = SETTINGS.model_copy(update={"further": 0})
    plan_floor(*ring(), settings, nothing_given(), lambda step, total: told.append((step, total)))
    assert told == [(step, len(STEPS)) for step in STEPS]


def test_a_plan_with_its_own_landmarks_fixed_needs_no_more(design: FloorDesign) -> None:
    positions = design.places.position[design.place]
    fixed = FloorConstraints(positions, tuple(str(i) for i in range(len(positions))), np.empty((0, 4)))
    again = plan_floor(*ring(), SETTINGS, fixed)
    assert len(again.place) == 0
    assert (again.fixed_station >= 0).all()
    assert again.expected[0].covariance.shape == design.expected[0].covariance.shape


def test_fixed_landmarks_count_and_hidden_ones_do_not(design: FloorDesign) -> None:
    fixed = FloorConstraints(np.array([(10.0, 0.0), (2.5, 8.0)]), ("a", "b"), np.empty((0, 4)))
    found = plan_floor(*ring(), SETTINGS, fixed)
    assert found.fixed_station[0] >= 0
    assert found.fixed_station[1] >= 0 or len(found.place) == len(design.place) - 1
    assert len(found.place) < len(design.place) + 1


def test_a_fixed_landmark_outside_is_told() -> None:
    outside = FloorConstraints(np.array([(15.0, 8.0)]), ("12",), np.empty((0, 4)))
    with pytest.raises(SurveyError, match=r"landmark 12 at \(15.00, 8.00\) is more than 1 m outside the walkable"):
        plan_floor(*ring(), SETTINGS, outside)


def test_a_floor_without_ways_or_walls_is_told() -> None:
    space, graph = ring()
    with pytest.raises(SurveyError, match="has no walkable path"):
        plan_floor(space, graph_of([(1.0, 1.0)], []), SETTINGS, nothing_given())
    everything = replace(nothing_given(), forbidden=np.array([(-1.0, -1.0, 40.0, 40.0)]))
    with pytest.raises(SurveyError, match="has no wall for a sheet"):
        plan_floor(space, graph, SETTINGS, everything)


def test_a_spacing_that_cannot_be_met_is_told_with_its_place() -> None:
    south = replace(nothing_given(), forbidden=np.array([(3.5, -1.0, 26.5, 3.0)]))
    found = plan_floor(*ring(), SETTINGS.model_copy(update={"further": 0}), south)
    (gap,) = found.demands.gaps
    assert gap.kind == "spacing"
    assert 23.0 < gap.length_m < 26.0
    assert gap.start[1] == gap.stop[1] == 1.0
    summary = floor_summary(found, 3, "Third", new_ids(len(found.place), 1, ()))
    assert summary.longest_m is None
    assert "a walk of 2" in summary.unmet[0].message


def test_one_landmark_more_gains_what_is_told(design: FloorDesign) -> None:
    ((place, gain_m),) = design.further
    assert gain_m > 0
    paths = typical_walks(ring()[1])
    before = mean_error_m(expected_on_walks(paths, design.landmarks, SETTINGS.survey_sigma_m))
    foot = design.stations.point[design.places.station[place]]
    more = design.landmarks.with_one(design.places.position[place], foot, float(design.places.pass_m[place]))
    after = mean_error_m(expected_on_walks(paths, more, SETTINGS.survey_sigma_m))
    assert before - after == pytest.approx(gain_m)
    none = np.zeros(len(design.places.station), dtype=np.bool_)
    assert further_landmarks(paths, design.landmarks, design.places, design.stations, none, 2, 0.02) == []


def test_the_summary_says_what_the_plan_is(design: FloorDesign) -> None:
    ids = new_ids(6, 5, ("7", "x"))
    assert ids == ["5", "6", "8", "9", "10", "11"]
    summary = floor_summary(design, 2, "Second", ids)
    assert (summary.number, summary.bound, summary.above_bound) == (6, 6, 0.0)
    assert summary.unmet == ()
    assert [landmark.id for landmark in summary.landmarks] == ids
    assert summary.tour.visits[0] == "5"
    for landmark, row in zip(summary.landmarks, design.place.tolist(), strict=True):
        right = np.array((np.cos(landmark.heading_rad), np.sin(landmark.heading_rad)))
        assert right @ design.places.normal[row] == pytest.approx(0.0, abs=1e-3)
        # Who faces the sheet looks along -normal and has the X axis on the right.
        looking = -design.places.normal[row]
        assert looking[0] * right[1] - looking[1] * right[0] == pytest.approx(-1.0, abs=1e-3)
    lines = landmarks_text(PlanSummary(version="", settings=SETTINGS, floors=(summary,), findings=())).splitlines()
    assert lines[0] == ",".join(COLUMNS)
    assert len(lines) == 7
    assert lines[1].startswith("5,2,")


@pytest.fixture(scope="module")
def changed() -> ChangedPlan:
    space, graph = ring()
    return ChangedPlan(plan_floor(space, graph, SETTINGS, nothing_given()), graph)


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
    assert changed.further(design.place, 1) == [design.further[0][0]]


CAMERA = CameraSettings()
ALL = tuple(SHEET_SIZES)


def test_the_camera_sees_what_the_command_says_it_does_by_default() -> None:
    assert CAMERA.field_of_view_rad == tuple(round(radians(angle), 4) for angle in (67, 53))


@pytest.mark.parametrize("name", ALL)
def test_from_its_distance_a_sheet_fills_a_quarter_of_the_picture(name: str) -> None:
    distance = CAMERA.fill_distance_m(SHEET_SIZES[name])
    width, height = (2 * distance * tan(angle / 2) for angle in CAMERA.field_of_view_rad)
    assert SHEET_SIZES[name].image_m ** 2 / (width * height) == pytest.approx(0.25)


@given(st.floats(0.1, 6.0))
def test_the_smallest_sheet_that_is_recognised_without_a_detour_is_taken(line_m: float) -> None:
    found = CAMERA.sheet_for(line_m, ALL, 3.6)
    easy_m = max(line_m - ASIDE_M, CAMERA.nearest_m)
    large_enough = [name for name in ALL if CAMERA.fill_distance_m(SHEET_SIZES[name]) >= easy_m]
    if large_enough:
        assert found is not None
        assert found[0].name == large_enough[0]
        assert found[1] == easy_m
    elif found is not None:
        assert found[0].name == "A0"
        assert line_m - found[1] <= 3.6


def test_walls_too_far_off_and_sheets_too_small_to_be_neared_are_no_place() -> None:
    assert CAMERA.sheet_for(8.0, ("A4", "A3"), 3.6) is None
    assert CAMERA.model_copy(update={"nearest_m": 0.5}).sheet_for(1.0, ("A4",), 3.6) is None


def test_a_wider_lens_asks_for_larger_sheets() -> None:
    wide = CAMERA.model_copy(update={"field_of_view_rad": (1.9, 1.5)})
    assert wide.fill_distance_m(SHEET_SIZES["A4"]) < CAMERA.fill_distance_m(SHEET_SIZES["A4"])
