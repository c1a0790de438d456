"""At which control point a press was made: by its label, and by written routes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.quality.evaluation.maps import floor_with, straight_walk, without
from vislam2tag.common.errors import SessionError, SurveyError
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.status import Status
from vislam2tag.quality.evaluation.paper import Cell, WalkErrors, summarise_walks, table_1
from vislam2tag.quality.evaluation.press_truth import (
    MIN_PRESSES,
    ROUTE_FILE,
    estimate_lead,
    identify_presses,
    is_faulty,
    nearest_point_errors,
    press_errors,
    press_truth,
    press_truth_findings,
    read_route,
    walk_error,
)
from vislam2tag.site.model import SessionKey

PLACES = np.array([[0.0, 0.0], [6.0, 0.0], [12.0, 0.0], [12.0, 6.0], [6.0, 8.0], [0.0, 7.0]])


def identified(labels: FloatArray, points: FloatArray, route: IntArray | None = None) -> list[int]:
    time_ns = np.arange(len(labels), dtype=np.int64) * 6_000_000_000
    found, _ = identify_presses(time_ns, labels, np.full(len(labels), np.nan), points, route)
    return [int(point) for point in found]


def test_good_labels_tell_their_points_in_any_order() -> None:
    order = [2, 1, 0, 5, 4, 1, 2, 3]
    assert identified(PLACES[order] + 0.4, PLACES) == order


def test_a_walk_that_lies_aside_finds_its_points_together() -> None:
    # 3.4 m to the right: for four of the points another one is nearer.
    order = [0, 1, 2, 3, 4, 5, 0]
    labels = PLACES[order] + (3.4, 0.0)
    nearest = np.linalg.norm(labels[:, None] - PLACES, axis=2).argmin(axis=1)
    assert (nearest != order).any()
    assert identified(labels, PLACES) == order


def test_labels_in_the_middle_are_ambiguous() -> None:
    points = np.array([[0.0, 1.0], [0.0, -1.0], [20.0, 0.0]])
    assert identified(np.array([[0.0, 0.05], [20.1, 0.0]]), points) == [-1, 2]


def test_a_press_without_a_label_is_told_by_the_route_alone() -> None:
    labels = PLACES[:4].copy()
    labels[2] = np.nan
    assert identified(labels, PLACES) == [0, 1, -1, 3]
    assert identified(labels, PLACES, np.arange(4)) == [0, 1, 2, 3]


def test_a_route_tells_points_that_stand_together() -> None:
    points = np.array([[0.0, 0.0], [5.0, 0.4], [5.0, -0.4], [10.0, 0.0]])
    labels = np.array([[0.1, 0.0], [5.0, 0.05], [10.2, 0.0]])
    assert identified(labels, points)[1] == -1
    assert identified(labels, points, np.array([0, 2, 3])) == [0, 2, 3]


def test_missing_and_double_presses_along_a_route() -> None:
    route = np.array([0, 1, 2, 3, 4, 5, 0, 1])
    order = [0, 1, 1, 2, 4, 5, 0, 1]
    assert identified(PLACES[order] + 0.3, PLACES, route) == order


def test_a_single_point_and_no_press() -> None:
    assert identified(np.array([[0.2, 0.0], [0.1, 0.1]]), PLACES[:1]) == [0, 0]
    assert identified(np.empty((0, 2)), PLACES) == []


def test_an_uncertain_label_is_clear_no_longer() -> None:
    time_ns = np.zeros(1, dtype=np.int64)
    label, points = np.array([[1.5, 0.0]]), PLACES[:2]
    sure, sure_probability = identify_presses(time_ns, label, np.array([0.1]), points)
    unsure, unsure_probability = identify_presses(time_ns, label, np.array([4.0]), points)
    assert (sure[0], unsure[0]) == (0, -1)
    assert 0.5 < unsure_probability[0] < sure_probability[0] <= 1


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1), st.floats(-np.pi, np.pi), st.floats(-1e4, 1e4))
def test_identity_does_not_depend_on_the_frame(seed: int, turn: float, shift: float) -> None:
    rng = np.random.default_rng(seed)
    order = rng.integers(0, len(PLACES), 10)
    labels = PLACES[order] + rng.normal(0, 1.5, (10, 2))
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    time_ns, unknown = np.arange(10, dtype=np.int64) * 6_000_000_000, np.full(10, np.nan)
    _, plain = identify_presses(time_ns, labels, unknown, PLACES)
    _, moved = identify_presses(time_ns, labels @ matrix.T + shift, unknown, PLACES @ matrix.T + shift)
    assert moved == pytest.approx(plain, abs=1e-6)


def test_stated_probabilities_come_true() -> None:
    rng = np.random.default_rng(1)
    right, stated = [], []
    for _ in range(150):
        order = rng.integers(0, len(PLACES), 8)
        labels = PLACES[order] + rng.normal(0, 2.0, (8, 2))
        found, probability = identify_presses(np.arange(8) * 6_000_000_000, labels, np.full(8, 2.0), PLACES)
        clear = found >= 0
        right += (found == order)[clear].tolist()
        stated += probability[clear].tolist()
    assert len(right) > 300
    assert np.mean(right) == pytest.approx(np.mean(stated), abs=0.05)


IDS = ("0", "1", "2")


@pytest.fixture
def session(tmp_path: Path) -> Path:
    folder = tmp_path / "floor_1" / "LG" / "a"
    folder.mkdir(parents=True)
    return folder


def test_the_sessions_route_counts_before_the_floors(tmp_path: Path, session: Path) -> None:
    assert read_route(tmp_path, session, IDS) is None
    (tmp_path / "floor_1" / ROUTE_FILE).write_text("point\n0\n1\n")
    found = read_route(tmp_path, session, IDS)
    assert found is not None
    assert found.tolist() == [0, 1]
    (session / ROUTE_FILE).write_text("\ufeffPoint\n2\n\n1\n2\n")
    found = read_route(tmp_path, session, IDS)
    assert found is not None
    assert found.tolist() == [2, 1, 2]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "expected the header 'point'"),
        ("0\n1\n", "expected the header 'point'"),
        ("point\n", "expected the header 'point'"),
        (
            "point\n0\n7\n",
            r"route\.csv:3: there is no control point '7' on this floor: refmarker.csv has 3 ids \(0, 1, 2\)",
        ),
    ],
)
def test_a_wrong_route_is_refused(tmp_path: Path, session: Path, content: str, message: str) -> None:
    (session / ROUTE_FILE).write_text(content)
    with pytest.raises(SurveyError, match=message):
        read_route(tmp_path, session, IDS)


POINTS = np.array([[2.0, 0.5], [6.0, -0.5]])


def presses(*seconds: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return (1_000_000_000 + np.array(seconds) * 1e9).astype(np.int64)


def test_error_is_to_the_nearest_point_at_the_interpolated_position() -> None:
    errors = nearest_point_errors(straight_walk(), presses(2.05, 5.6), floor_with(POINTS)).error_m
    np.testing.assert_allclose(errors, [np.hypot(0.05, 0.5), np.hypot(0.4, 0.5)])


def test_presses_outside_the_mapped_part_do_not_count() -> None:
    walk = without(straight_walk(), slice(40, 101), Status.AFTER_LAST_LANDMARK)
    errors = nearest_point_errors(walk, presses(2.0, 6.0, 30.0), floor_with(POINTS)).error_m
    np.testing.assert_array_equal(np.isfinite(errors), [True, False, False])
    assert walk_error(errors) == pytest.approx(0.5)
    assert np.isnan(walk_error(errors[1:]))


def corridor(count: int = 8) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Points three metres apart along x."""
    return np.column_stack((3.0 * np.arange(count), np.zeros(count)))


def test_nearest_flatters_where_identity_does_not() -> None:
    # All labels lie 1.8 m ahead, so that the next point is nearer than the one pressed at; at the last press the walk
    # has left the row of points, and all presses together tell.
    walk, floor = straight_walk(frames=301, shift=(1.8, 0.0)), floor_with(corridor(8))
    moments = presses(*(3.0 * np.arange(8)))
    truth = press_truth(walk, moments, floor, route=np.arange(8))
    np.testing.assert_allclose(press_errors(walk, truth).error_m, 1.8)
    assert nearest_point_errors(walk, moments, floor).error_m[:-1] == pytest.approx(1.2)


def test_along_and_across_are_by_the_direction_of_walking() -> None:
    walk, floor = straight_walk(shift=(0.3, -0.2)), floor_with(corridor(3))
    errors = press_errors(walk, press_truth(walk, presses(0.0, 3.0, 6.0), floor))
    np.testing.assert_allclose(errors.along_m, 0.3)
    np.testing.assert_allclose(errors.across_m, -0.2)


def test_a_late_finger_shows_as_lead_and_can_be_left_out() -> None:
    walk, floor = straight_walk(frames=301), floor_with(corridor(8))
    truth = press_truth(walk, presses(*(3.0 * np.arange(8) + 0.4)), floor)
    assert truth.lead.lead_s == pytest.approx(0.4)
    np.testing.assert_allclose(press_errors(walk, truth).along_m, 0.4)
    np.testing.assert_allclose(press_errors(walk, truth, without_lead=True).error_m, 0.0, atol=1e-9)


def test_without_enough_presses_no_error_is_without_lead() -> None:
    walk, floor = straight_walk(), floor_with(corridor(3))
    truth = press_truth(walk, presses(0.4, 3.4), floor)
    assert np.isnan(truth.lead.lead_s)
    assert not press_errors(walk, truth, without_lead=True).labelled.any()
    assert press_errors(walk, truth).labelled.all()


def test_presses_that_are_not_scored_are_counted() -> None:
    walk, floor = straight_walk(), floor_with(np.array([[2.0, 0.0], [6.0, 0.8], [6.0, -0.8]]))
    truth = press_truth(walk, presses(2.0, 6.0, 30.0), floor)
    assert (truth.ambiguous, truth.outside, truth.elsewhere) == (1, 1, 0)
    assert len(press_errors(walk, truth)) == 1
    assert "add a route.csv to settle it" in press_truth_findings(truth)[0].message
    routed = press_truth(walk, presses(2.0, 6.0, 30.0), floor, route=np.array([0, 1]))
    assert (routed.by_route, routed.ambiguous) == (True, 0)
    assert {f.kind: f.count for f in press_truth_findings(truth)} == {"ambiguous_presses": 1, "presses_outside_walk": 1}


def test_presses_on_another_floor_are_not_compared() -> None:
    walk = straight_walk()
    climbed = replace(walk, floor=np.where(np.arange(101) < 50, 1, 2))
    truth = press_truth(climbed, presses(0.0, 3.0, 6.0), floor_with(corridor(3)))
    assert (len(truth.time_ns), truth.elsewhere) == (2, 1)
    assert len(nearest_point_errors(climbed, presses(0.0, 3.0, 6.0), floor_with(corridor(3)))) == 2


def test_what_is_missing_is_said() -> None:
    walk, floor = straight_walk(), floor_with(corridor())
    with pytest.raises(SessionError, match=r"floor 1 has no control points: add its refmarker\.csv"):
        press_truth(walk, presses(1.0), floor_with(np.empty((0, 2))))
    with pytest.raises(SessionError, match=r"refMarker\.csv \(ControlPoint\.csv of the app\) is missing or has none"):
        press_truth(walk, presses(), floor)
    with pytest.raises(SessionError, match="none of the 2 presses is within the walk: they are 7191 s after it ends"):
        press_truth(walk, presses(7201.0, 7205.0), floor)


def test_faulty_means_that_corrected_keeps_less_than_local() -> None:
    local = without(straight_walk(), slice(90, 101), Status.AFTER_LAST_LANDMARK)
    assert not is_faulty(local, local)
    assert is_faulty(local, without(local, slice(50, 60), Status.BREAK))


def test_statistics_over_walks_leave_out_unlabelled_and_faulty_ones() -> None:
    key = SessionKey(1, "LG_ref", "a")
    walks = [WalkErrors(key, {"local": e}, e > 2) for e in (0.4, 0.6, 5.0)] + [
        WalkErrors(key, {"local": float("nan")}, False)
    ]
    everything = summarise_walks(walks, "local")
    assert (everything.walks, everything.mean_m, everything.median_m, everything.max_m) == (3, 2.0, 0.6, 5.0)
    last = table_1(walks, ("local",)).rows[-1]
    assert (last.selection, last.metric) == ("non-faulty trajectories", "maximum")
    assert last.cells == (Cell("local", 0.6, 0.72, 2),)
    assert summarise_walks([], "local").walks == 0


@given(st.floats(-2, 2), st.lists(st.floats(0.4, 2.5), min_size=MIN_PRESSES + 1, max_size=30))
def test_a_constant_lead_is_found_at_any_speed(lead_s: float, speeds: list[float]) -> None:
    speed = np.array(speeds)
    lead = estimate_lead(lead_s * speed, speed)
    assert lead.lead_s == pytest.approx(lead_s, abs=1e-9)
    assert lead.sigma_s == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(lead.without_s, lead_s, atol=1e-9)


def test_a_third_of_wild_labels_does_not_matter() -> None:
    speed = np.full(12, 1.0)
    along = np.where(np.arange(12) < 4, 9.0, 0.3)
    assert estimate_lead(along, speed).lead_s == pytest.approx(0.3)


def test_standing_jumping_and_unlabelled_presses_say_nothing() -> None:
    along = np.array([0.2, 0.2, 0.2, 0.2, 5.0, 5.0, 5.0, np.nan])
    speed = np.array([1.0, 1.0, 1.0, 1.0, 0.1, 30.0, np.nan, 1.0])
    assert estimate_lead(along, speed).lead_s == pytest.approx(0.2)


def test_no_press_corrects_itself() -> None:
    along, speed = np.array([0.1, 0.2, 0.3, 0.4, 3.0]), np.ones(5)
    lead = estimate_lead(along, speed)
    assert lead.without_s[4] == pytest.approx(0.25)
    assert lead.lead_s == pytest.approx(0.3)


def test_too_few_presses_have_no_lead() -> None:
    lead = estimate_lead(np.full(3, 0.2), np.ones(3))
    assert np.isnan(lead.lead_s)
    assert np.isnan(lead.without_s).all()


def test_the_stated_sigma_is_the_scatter_over_sessions() -> None:
    rng = np.random.default_rng(5)
    speed = rng.uniform(0.6, 1.6, (400, 15))
    leads = [estimate_lead(0.3 * one + rng.normal(0, 0.4, 15), one) for one in speed]
    assert np.mean([lead.lead_s for lead in leads]) == pytest.approx(0.3, abs=0.02)
    assert np.mean([lead.sigma_s for lead in leads]) == pytest.approx(np.std([lead.lead_s for lead in leads]), rel=0.2)
