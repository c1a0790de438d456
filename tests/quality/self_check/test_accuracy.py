"""The estimate of a session's accuracy, from errors drawn as stated, better and worse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vislam2tag.core.arrays import FloatArray
from vislam2tag.quality.self_check.accuracy import Estimate, error_factor, estimate_accuracy, expected_error_m
from vislam2tag.quality.self_check.left_out import LeftOut

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
