"""What a walk is told, rounded."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.context import PlaceTies
from vislam2tag.positioning.walk_traces import rounded, rounded_covariance


def test_what_is_told_can_be_mapped_with_where_landmarks_share_nearly_all_of_their_error() -> None:
    shared_m2, own_m2, heading_rad2 = 0.35**2, 1e-6, 2e-5
    covariance = np.zeros((60, 60))
    covariance[:40, :40] = np.kron(np.full((20, 20), shared_m2), np.eye(2)) + own_m2 * np.eye(40)
    covariance[40:, 40:] = heading_rad2 * np.eye(20)
    unit = np.concatenate((np.full(40, 1e-2), np.full(20, 1e-3)))
    stated = rounded_covariance(covariance, unit)
    np.linalg.cholesky(stated)
    np.testing.assert_allclose(stated, covariance, atol=1e-4)
    np.testing.assert_array_equal(rounded_covariance(covariance + 1e-13, unit), stated)


def test_a_hardly_different_tale_is_rounded_to_the_same() -> None:
    ties = PlaceTies(np.array([10, 30]), np.array([(1.001, 2), (3, 4)]), np.eye(4) * 4 + 1)
    other = PlaceTies(ties.time_ns, ties.position_bcs + 1e-4, ties.covariance_m2 + 1e-5)
    np.testing.assert_array_equal(rounded(ties).position_bcs, rounded(other).position_bcs)
    np.testing.assert_array_equal(rounded(ties).covariance_m2, rounded(other).covariance_m2)
