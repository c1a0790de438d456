from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.evaluation.maps import floor_with, straight_walk, without
from vislam2tag.core.status import Status
from vislam2tag.evaluation.control_points.press_truth import nearest_point_errors
from vislam2tag.evaluation.residuals import covariances_at, residuals_at_presses, residuals_at_truth
from vislam2tag.evaluation.truth import Truth, errors_at_truth

POINTS = np.array([[2.0, 0.5], [6.0, -0.5]])


def at(*seconds: float) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    return (1_000_000_000 + np.array(seconds) * 1e9).astype(np.int64)


def test_errors_are_label_minus_truth() -> None:
    walk = without(straight_walk(shift=(0.3, 0.4)), slice(50, 60), Status.BREAK)
    truth = Truth(at(1.0, 2.55, 5.5, 20.0), np.column_stack(([1.0, 2.55, 5.5, 20.0], np.zeros(4))))
    residuals = residuals_at_truth(walk, truth)
    np.testing.assert_allclose(residuals.error_m, [[0.3, 0.4], [0.3, 0.4], [np.nan] * 2, [np.nan] * 2], atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(residuals.error_m, axis=1), errors_at_truth(walk, truth))


def test_presses_are_compared_with_the_nearest_point() -> None:
    walk = without(straight_walk(), slice(90, 101), Status.AFTER_LAST_LANDMARK)
    presses = at(2.05, 5.6, 9.5)
    residuals = residuals_at_presses(walk, presses, POINTS)
    np.testing.assert_allclose(residuals.error_m, [[0.05, -0.5], [-0.4, 0.5], [np.nan] * 2], atol=1e-9)
    np.testing.assert_allclose(
        np.linalg.norm(residuals.error_m, axis=1), nearest_point_errors(walk, presses, floor_with(POINTS)).error_m
    )


def test_covariances_are_linear_between_usable_frames() -> None:
    walk = straight_walk()
    covariance = np.arange(101.0)[:, None, None] * np.array([[2.0, -1.0], [-1.0, 3.0]])
    covariance[40:43] = np.nan
    status = walk.status.copy()
    status[40:43] = Status.INVALID
    status[60], covariance[60] = Status.BREAK, np.nan
    found = covariances_at(at(1.05, 4.1, 5.95, 6.0, 7.0), replace(walk, covariance_bcs=covariance, status=status))
    np.testing.assert_allclose(found[:, 0, 0], [21.0, 82.0, np.nan, np.nan, 140.0])
    np.testing.assert_allclose(found[:, 0, 1], found[:, 0, 0] / -2)
    np.testing.assert_allclose(found[:, 1, 1], found[:, 0, 0] * 1.5)
    np.testing.assert_array_equal(found[:, 1, 0], found[:, 0, 1])


def test_no_usable_frame_has_no_covariance() -> None:
    walk = straight_walk(3)
    walk.status[:] = Status.INVALID
    assert np.isnan(covariances_at(at(0.1), walk)).all()
