"""What is known of the landmarks that a log names."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.walks import landmarks_at
from vislam2tag.estimation.landmark_priors import LandmarkPriors, landmark_shares

SURVEY = replace(
    landmarks_at({"a": (1.0, 2.0), "b": (3.0, 4.0), "c": (5.0, 6.0)}, sigma_m=0.1),
    heading_rad=np.array([0.5, 1.0, np.nan]),
    heading_sigma_rad=np.array([0.01, np.nan, 0.01]),
)


def test_landmarks_come_in_the_order_of_the_log() -> None:
    priors = LandmarkPriors.of(("c", "a"), SURVEY)
    np.testing.assert_array_equal(priors.position, [5 + 6j, 1 + 2j])
    np.testing.assert_allclose(priors.covariance, np.tile(0.01 * np.eye(2), (2, 1, 1)))
    assert priors.surveyed.tolist() == [True, True]


def test_ids_that_the_survey_does_not_have_are_not_surveyed() -> None:
    priors = LandmarkPriors.of(("x", "b", "y"), SURVEY)
    assert priors.surveyed.tolist() == [False, True, False]
    assert np.isnan(priors.heading_rad[[0, 2]]).all()


def test_a_listed_landmark_without_a_position_is_not_surveyed() -> None:
    two_of_three = replace(SURVEY, position_bcs=np.array([[1.0, 2.0], [np.nan, np.nan], [5.0, 6.0]]))
    assert LandmarkPriors.of(("a", "b", "c"), two_of_three).surveyed.tolist() == [True, False, True]


def test_a_heading_counts_only_with_its_sigma() -> None:
    priors = LandmarkPriors.of(("a", "b", "c"), SURVEY)
    np.testing.assert_array_equal(priors.heading_rad, [0.5, np.nan, np.nan])
    np.testing.assert_array_equal(priors.heading_sigma_rad, [0.01, np.nan, np.nan])


def test_forgetting_one_landmark_leaves_the_others() -> None:
    priors = LandmarkPriors.of(("a", "b", "c"), SURVEY)
    fewer = priors.without(0)
    assert fewer.surveyed.tolist() == [False, True, True]
    assert np.isnan(fewer.heading_rad[0])
    np.testing.assert_array_equal(fewer.position[1:], priors.position[1:])
    assert priors.surveyed.all()


def test_nothing_known() -> None:
    assert not LandmarkPriors.nothing(3).surveyed.any()
    assert len(LandmarkPriors.of((), SURVEY).position) == 0


def test_errors_that_landmarks_share_come_in_the_order_of_the_log() -> None:
    joint = np.diag(np.arange(1.0, 10.0))
    joint[0, 4] = joint[4, 0] = 0.5  # x of a and x of c
    priors = LandmarkPriors.of(("c", "x", "a"), replace(SURVEY, joint_covariance=joint))
    assert priors.joint is not None
    known = [0, 1, 4, 5, 6, 8]
    expected = np.diag([5.0, 6, 1, 2, 9, 7])
    expected[0, 2] = expected[2, 0] = 0.5
    np.testing.assert_array_equal(priors.joint[np.ix_(known, known)], expected)


def test_places_follow_the_landmarks_around_them() -> None:
    priors = replace(LandmarkPriors.nothing(3), position=np.array([0, 20, np.nan], dtype=np.complex128))
    share = landmark_shares(priors, np.array([0, 10, 20], dtype=np.complex128))
    np.testing.assert_allclose(share[::2, ::2].sum(axis=1), 1)
    np.testing.assert_allclose(share[2:4], np.hstack([np.eye(2) * 0.5, np.eye(2) * 0.5, np.zeros((2, 2))]))
    assert share[0, 0] > 0.98


def test_what_places_share_with_landmarks_is_known_with_and_without_a_joint_covariance() -> None:
    nan = np.nan
    covariance = np.array([np.eye(2) * 0.1, [[0.3, 0.1], [0.1, 0.5]], np.full((2, 2), nan)])
    apart = LandmarkPriors(np.array([0, 20, nan]), covariance, np.full(3, nan), np.full(3, nan))
    between = apart.shared_covariance(np.array([10 + 0j]))[0]
    np.testing.assert_allclose(between, (covariance[0] + covariance[1]) / 4)
    joint = np.full((9, 9), nan)
    joint[:4, :4] = np.kron(np.ones((2, 2)), covariance[1])
    np.testing.assert_allclose(replace(apart, joint=joint).shared_covariance(np.array([10 + 0j]))[0], covariance[1])
