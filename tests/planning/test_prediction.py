"""What the smoother's own equations say of a walk before it is walked."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.estimation.noise import NoiseLevels
from vislam2tag.planning.prediction import (
    PassedLandmarks,
    expected_along,
    expected_on_walks,
    mean_error_m,
    passes_near,
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


def test_noisier_trackers_and_poorer_surveys_are_expected_to_label_worse() -> None:
    marks = sheets_at(10.0, 30.0, 50.0)
    usual = expected_on_walks([STRAIGHT], marks, 0.02)
    noisy = expected_along(STRAIGHT, marks, 0.02, NoiseLevels(position_m=0.05, sighting_m=0.3))
    assert noisy is not None
    assert mean_error_m([noisy]) > 1.5 * mean_error_m(usual)
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
    assert passes_near(STRAIGHT, np.array((20.0, 0.5)))
    assert not passes_near(STRAIGHT, np.array((20.0, 1.5)))


def test_landmarks_that_a_walk_does_not_pass_change_nothing() -> None:
    near = expected_along(STRAIGHT, sheets_at(10.0, 40.0), 0.02)
    aside = sheets_at(10.0, 40.0).with_one(np.array((20.0, 9.0)), np.array((20.0, 8.0)), 0.5)
    with_far = expected_along(STRAIGHT, aside, 0.02)
    assert near is not None
    assert with_far is not None
    assert with_far.covariance == pytest.approx(near.covariance)
