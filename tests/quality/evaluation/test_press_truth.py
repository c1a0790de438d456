from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.quality.evaluation.maps import floor_with, straight_walk, without
from vislam2tag.common.errors import SessionError
from vislam2tag.core.status import Status
from vislam2tag.quality.evaluation.paper import WalkErrors, summarise_walks, table_1
from vislam2tag.quality.evaluation.press_truth import (
    MIN_PRESSES,
    estimate_lead,
    is_faulty,
    nearest_point_errors,
    press_errors,
    press_truth,
    press_truth_findings,
    walk_error,
)
from vislam2tag.site.model import SessionKey

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
    assert "a route.csv would tell" in press_truth_findings(truth)[0].message
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
    with pytest.raises(SessionError, match=r"refMarker\.csv is missing or empty"):
        press_truth(walk, presses(), floor)
    with pytest.raises(
        SessionError, match="none of the 2 presses lies within the walk: they come 7191 s after it ends"
    ):
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
    assert table_1(walks, ("local",)).rows[-1][0] == ("non-faulty trajectories", "maximum", "local", 2, 0.6, 0.72)
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
