"""What a walk is told, put together and rounded."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.context import PlaceTies
from vislam2tag.walk_ties.told import rounded, rounded_covariance, told_together


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


def test_ties_of_two_kinds_stand_in_time_order_each_with_its_own_covariance() -> None:
    radio = PlaceTies(np.array([10, 30]), np.array([(1.0, 2), (3, 4)]), np.eye(4) * 4 + 1)
    corridor = PlaceTies(np.array([20]), np.array([(5.0, 6)]), np.diag([100.0, 0.25]))
    told = told_together([radio, None, corridor])
    assert told is not None
    np.testing.assert_array_equal(told.time_ns, [10, 20, 30])
    np.testing.assert_array_equal(told.position_bcs, [(1, 2), (5, 6), (3, 4)])
    np.testing.assert_array_equal(np.diag(told.covariance_m2), [5, 5, 100, 0.25, 5, 5])
    np.testing.assert_array_equal(told.covariance_m2[0], [5, 1, 0, 0, 1, 1])
    assert told_together([None, None]) is None


def test_a_hardly_different_tale_is_rounded_to_the_same() -> None:
    ties = PlaceTies(np.array([10, 30]), np.array([(1.001, 2), (3, 4)]), np.eye(4) * 4 + 1)
    other = PlaceTies(ties.time_ns, ties.position_bcs + 1e-4, ties.covariance_m2 + 1e-5)
    np.testing.assert_array_equal(rounded(ties).position_bcs, rounded(other).position_bcs)
    np.testing.assert_array_equal(rounded(ties).covariance_m2, rounded(other).covariance_m2)
