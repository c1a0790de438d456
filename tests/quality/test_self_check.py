"""Labels checked without truth."""

from __future__ import annotations

from dataclasses import replace
from typing import Any
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.drifting import SURVEY_SIGMA_M, Drifting, loops
from vislam2tag.common.findings import Answer
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path, solve_walk
from vislam2tag.estimation.tracker_errors import NoiseLevels
from vislam2tag.quality import self_check
from vislam2tag.quality.self_check import (
    MOST_SOLUTIONS,
    Estimate,
    LeftOut,
    bad_landmarks,
    error_factor,
    estimate_accuracy,
    expected_error_m,
    judgement_of,
    leave_out,
    pooled,
)
from vislam2tag.quality.self_check_record import Fault, LeftOutMark, SessionCheck

TYPICAL = NoiseLevels(position_m=0.016, heading_rad=0.003, scale=0.002, sighting_m=0.09, sheet_rad=0.03)


def smoothed(walk: Drifting, surveyed: list[int] | None = None, headed: list[int] | None = None) -> SolvedWalk:
    found = solve_walk(walk.observations(), LandmarkPriors.of(walk.ids, walk.landmarks(surveyed, headed)))
    assert found is not None
    return found


def test_a_perfect_tracker_predicts_every_landmark() -> None:
    errors = leave_out(smoothed(loops(1, marks=6)))
    assert [error.landmark for error in errors] == [f"L{i}" for i in range(6)]
    assert [error.passes for error in errors] == [2] * 6
    assert max(error.size_m for error in errors) < 0.02


def test_a_mis_surveyed_landmark_is_told_and_not_its_neighbours() -> None:
    walk = loops(2, TYPICAL, marks=8)
    moved = walk.place.copy()
    moved[3] += 1.5 - 2j
    errors = {error.landmark: error for error in leave_out(smoothed(replace(walk, surveyed_at=moved)))}
    np.testing.assert_allclose(errors["L3"].offset_m, [-1.5, 2.0], atol=0.4)
    assert errors["L3"].squared_sigmas > 50
    assert all(error.squared_sigmas < 20 for name, error in errors.items() if name != "L3")


def test_unsurveyed_landmarks_are_not_left_out_and_two_cannot_tell_of_each_other() -> None:
    walk = loops(3, TYPICAL, marks=5)
    assert [error.landmark for error in leave_out(smoothed(walk, [0, 2, 4]))] == ["L0", "L2", "L4"]
    assert leave_out(smoothed(walk, [0, 2])) == ()
    with_heading = leave_out(smoothed(walk, [0, 2], headed=[2]))
    assert [error.landmark for error in with_heading] == ["L0"]


def test_many_landmarks_cost_a_limited_number_of_solutions() -> None:
    walk = smoothed(loops(4, TYPICAL, marks=40, laps=1.0, size_m=(60.0, 30.0)))
    with mock.patch.object(self_check, "solve_walk", wraps=solve_walk) as solved:
        errors = leave_out(walk)
    assert solved.call_count == MOST_SOLUTIONS
    assert [error.landmark for error in errors] == [f"L{i}" for i in range(40)]
    assert np.median([error.size_m for error in errors]) < 0.3


@pytest.mark.parametrize("level", [1.0, pytest.param(2.0, marks=pytest.mark.slow)])
def test_estimated_mean_errors_are_those_of_walks_drawn_from_the_model(level: float) -> None:
    names = ("position_m", "heading_rad", "scale", "sighting_m", "sheet_rad")
    noise = NoiseLevels(*(level * getattr(TYPICAL, name) for name in names))
    true, estimated = [], []
    for seed in range(12):
        walk = loops(100 + seed, noise, marks=10, laps=1.5, survey_m=SURVEY_SIGMA_M)
        solved = smoothed(walk)
        position, covariance, _ = mapped_path(solved)
        found = estimate_accuracy(covariance, leave_out(solved))
        assert found is not None
        true.append(np.linalg.norm(position - as_points(walk.truth), axis=1).mean())
        estimated.append(found.estimated_m)
    ratio = np.exp(np.mean(np.log(np.array(estimated) / np.array(true))))
    assert 0.75 < ratio < 1.33


SIGMAS = st.floats(0.01, 5.0)


def covariance(long_m: float, short_m: float, angle: float) -> FloatArray:
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return np.asarray(turn @ np.diag([long_m**2, short_m**2]) @ turn.T)


def drawn(count: int, factor: float, seed: int = 1) -> list[LeftOut]:
    """Left-out errors that exceed what is stated of them by a factor."""
    rng = np.random.default_rng(seed)
    errors = []
    for i in range(count):
        stated = covariance(rng.uniform(0.05, 1.0), rng.uniform(0.05, 1.0), rng.uniform(0, np.pi))
        errors.append(LeftOut(str(i), 1, factor * rng.multivariate_normal(np.zeros(2), stated), stated))
    return errors


def estimate(left_out: list[LeftOut], labels: int = 100) -> Estimate:
    found = estimate_accuracy(np.tile(np.eye(2) * 0.04, (labels, 1, 1)), left_out)
    assert found is not None
    return found


@settings(max_examples=50)
@given(SIGMAS, SIGMAS, st.floats(0, np.pi))
def test_expected_error_is_the_mean_length_of_drawn_errors(long_m: float, short_m: float, angle: float) -> None:
    stated = covariance(long_m, short_m, angle)
    # Directions evenly spread and lengths averaged exactly: no chance in the comparison.
    around = np.linspace(0, 2 * np.pi, 501)[:-1]
    unit = np.linalg.cholesky(stated) @ np.stack((np.cos(around), np.sin(around)))
    expected = np.sqrt(np.pi / 2) * np.linalg.norm(unit, axis=0).mean()
    assert expected_error_m(stated[None])[0] == pytest.approx(expected, rel=1e-4)


def test_expected_error_on_a_line_and_of_nothing() -> None:
    stated = np.array([np.diag([0.09, 0.0]), np.zeros((2, 2))])
    np.testing.assert_allclose(expected_error_m(stated), [0.3 * np.sqrt(2 / np.pi), 0.0])


@pytest.mark.parametrize("factor", [0.2, 0.5, 1.0, 1.2])
def test_factor_is_right_where_landmarks_are_many(factor: float) -> None:
    assert error_factor(drawn(1500, factor)) == pytest.approx(factor, rel=0.06)


def test_without_left_out_landmarks_the_estimate_is_what_is_stated() -> None:
    found = estimate([])
    assert found.estimated_m == found.stated_m == pytest.approx(0.2 * np.sqrt(np.pi / 2))
    assert found.high_m > 2 * found.stated_m
    assert not found.well_founded


def test_few_landmarks_change_little_and_leave_a_wide_interval() -> None:
    few, many = estimate(drawn(3, 0.2)), estimate(drawn(60, 0.2))
    assert few.stated_m > few.estimated_m > 2 * many.estimated_m
    assert few.high_m / few.low_m > many.high_m / many.low_m
    assert few.well_founded


def test_one_bad_landmark_does_not_spoil_the_estimate() -> None:
    errors = drawn(10, 1.0)
    bad = LeftOut("bad", 1, np.array([30.0, 0.0]), np.eye(2) * 0.01)
    assert error_factor([*errors, bad]) < 1.15 * error_factor(errors)


def test_without_labels_there_is_no_estimate() -> None:
    assert estimate_accuracy(np.empty((0, 2, 2)), drawn(5, 1.0)) is None


def test_sizes_of_a_left_out_error() -> None:
    error = LeftOut("7", 2, np.array([0.3, -0.4]), np.diag([0.09, 0.16]))
    assert error.size_m == pytest.approx(0.5)
    assert error.squared_sigmas == pytest.approx(2.0)


SURVEY_M, OWN_M = 0.02, 0.15


def sessions(
    count: int, shift: dict[str, tuple[float, float]] | None = None, *, seed: int = 1, own_m: float = OWN_M
) -> list[SessionCheck]:
    """Sessions that predict each landmark with their own errors; ``shift`` adds to all offsets of a landmark."""
    rng, shift = np.random.default_rng(seed), shift or {}
    return [
        predicting(f"s{number}", {i: rng.normal(0, own_m, 2) + shift.get(i, (0.0, 0.0)) for i in map(str, range(8))})
        for number in range(count)
    ]


def predicting(name: str, offsets: dict[str, FloatArray], **details: Any) -> SessionCheck:
    marks = [mark(landmark, offset) for landmark, offset in offsets.items()]
    who: dict[str, Any] = {"slug": name, "floor": 1, "device": "LG", "session": name}
    return SessionCheck(**who, left_out=marks, well_founded=len(marks) >= 3, **details)


def mark(name: str, offset: FloatArray) -> LeftOutMark:
    variance = OWN_M**2 + SURVEY_M**2
    return LeftOutMark(
        floor=1,
        landmark=name,
        passes=1,
        surveyed_m=(3.0, 4.0),
        offset_m=(float(offset[0]), float(offset[1])),
        covariance_m2=(variance, 0.0, variance),
        survey_covariance_m2=(SURVEY_M**2, 0.0, SURVEY_M**2),
    )


def test_nothing_is_said_of_good_landmarks() -> None:
    assert [bad_landmarks(sessions(6, seed=seed)) for seed in range(20)] == [[]] * 20


@pytest.mark.parametrize("seed", range(5))
def test_a_landmark_that_all_sessions_put_elsewhere_is_named_with_where(seed: int) -> None:
    (bad,) = bad_landmarks(sessions(6, {"3": (0.4, -0.5)}, seed=seed))
    assert (bad.landmark, bad.fault, bad.sessions, bad.surveyed_m) == ("3", Fault.OFFSET, 6, (3.0, 4.0))
    assert bad.offset_m == pytest.approx((0.4, -0.5), abs=0.2)
    assert 0.03 < bad.sigma_m < 0.12


def test_a_landmark_that_moved_between_the_sessions_scatters() -> None:
    early, late = sessions(3, {"2": (0.0, 3.0)}), sessions(3, {"2": (4.0, -3.0)}, seed=2)
    (bad,) = bad_landmarks([*early, *late])
    assert (bad.landmark, bad.fault) == ("2", Fault.SCATTER)
    assert bad.size_m > 2


def test_one_session_alone_leaves_a_doubt() -> None:
    (bad,) = bad_landmarks(sessions(1, {"5": (2.0, 0.0)}))
    assert (bad.landmark, bad.fault) == ("5", Fault.DOUBT)


def test_one_session_that_strays_does_not_accuse_a_landmark_that_others_know() -> None:
    assert bad_landmarks([*sessions(6), *sessions(1, {"5": (2.0, 0.0)}, seed=9)]) == []


def test_a_session_whose_landmarks_are_all_off_accuses_none() -> None:
    assert bad_landmarks(sessions(1, own_m=4 * OWN_M)) == []


def test_sessions_with_too_few_landmarks_are_not_asked() -> None:
    unsure = [session.model_copy(update={"well_founded": False}) for session in sessions(4, {"3": (2.0, 0.0)})]
    assert bad_landmarks(unsure) == []


def test_pooling_gains_certainty_with_sessions_but_not_beyond_the_survey() -> None:
    rng = np.random.default_rng(3)
    survey = np.eye(2) * SURVEY_M**2
    sigmas = []
    for count in (4, 16, 64):
        offset = rng.normal(0, OWN_M, (count, 2)) + np.array([0.3, 0.0])
        together = pooled(offset, np.tile(np.eye(2) * OWN_M**2 + survey, (count, 1, 1)), survey)
        sigmas.append(np.sqrt(together.covariance[0, 0]))
    assert OWN_M > sigmas[0] > sigmas[1] > sigmas[2] > SURVEY_M
    assert sigmas[1] == pytest.approx(np.hypot(SURVEY_M, OWN_M / 4), rel=0.5)


def session(name: str, *landmarks: str, **details: Any) -> SessionCheck:
    return predicting(name, dict.fromkeys(landmarks, np.zeros(2)), **details)


def test_each_landmark_counts_once() -> None:
    found = judgement_of([session("a", "1", "2", "3"), session("b", "2", "3", "4"), session("c", "1")], bad=0)
    assert found.answer is Answer.NOTHING_WRONG
    assert found.looked_at == "4 landmarks in 2 sessions"
    assert found.why == "1 session could not judge any"


def test_known_positions_are_counted_beside_landmarks() -> None:
    found = judgement_of([session("a", "1", "2", "3"), session("b", "x", "y", "z", fixes=3)], bad=1)
    assert (found.answer, found.looked_at) == (Answer.WRONG, "3 landmarks and 3 known positions in 2 sessions")


def test_too_few_none_read_and_none_there_differ() -> None:
    assert judgement_of([session("a", "1")], bad=0).answer is Answer.NOT_JUDGED
    failed = [session(name, error="no frames") for name in "ab"]
    assert judgement_of(failed, bad=0).why == "none of 2 sessions can be read or mapped"
    assert judgement_of(failed[:1], bad=0).why == "the session cannot be read or mapped"
    assert judgement_of([], bad=0).answer is Answer.NOT_LOOKED_AT
