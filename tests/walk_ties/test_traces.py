"""A mapped walk as others are told of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.tracks import Trajectory
from vislam2tag.smoother.landmark_priors import LandmarkPriors
from vislam2tag.walk_ties.traces import WalkTrace

NOTHING = LandmarkPriors.nothing(2)


def round_a_square() -> Trajectory:
    """Once round a square of 10 m, 20 frames a metre."""
    side, nothing = np.arange(0, 10, 0.05), np.zeros(200)
    place = np.concatenate(
        [np.column_stack(pair) for pair in ((side, nothing), (nothing + 10, side), (10 - side, nothing + 10))]
    )
    count = len(place)
    return Trajectory(
        time_ns=np.arange(count) * 10**7,
        position_bcs=np.column_stack((place, np.full(count, 1.4))),
        orientation_bcs=np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)),
        covariance_bcs=np.tile(np.eye(2) * 0.04, (count, 1, 1)),
        status=np.zeros(count, dtype=np.int8),
        segments=(),
        visits=(),
    )


def test_a_place_a_metre_with_its_course() -> None:
    trace = WalkTrace.of(round_a_square(), 0, NOTHING)
    assert trace is not None
    np.testing.assert_allclose(np.diff(trace.way_m), 1, atol=0.06)
    np.testing.assert_allclose(trace.position_bcs[[3, 15, 25]], [(3, 0), (10, 5), (5, 10)], atol=0.11)
    np.testing.assert_allclose(np.exp(1j * trace.course_rad[[3, 15, 25]]), [1, 1j, -1], atol=0.01)
    np.testing.assert_array_equal(trace.covariance_bcs[0], np.eye(2) * 0.04)


def test_only_what_is_mapped_on_the_floor_is_told() -> None:
    mapped = round_a_square()
    covariance = mapped.covariance_bcs.copy()
    covariance[:200] = np.nan
    trace = WalkTrace.of(replace(mapped, covariance_bcs=covariance, floor=np.repeat([0, 0, 1], 200)), 0, NOTHING)
    assert trace is not None
    assert trace.position_bcs[:, 0].min() > 9.9
    assert trace.position_bcs[:, 1].max() < 10
    nowhere = replace(mapped, covariance_bcs=np.full_like(covariance, np.nan))
    assert WalkTrace.of(nowhere, 0, NOTHING) is None


def test_what_landmarks_share_is_no_error_of_the_walks_own() -> None:
    shared = np.zeros((6, 6))
    shared[:4, :4] = np.kron(np.ones((2, 2)), np.diag([0.03, 0.01])) + 1e-9 * np.eye(4)
    unknown = np.full(2, np.nan)
    landmarks = LandmarkPriors(np.array([0, 10 + 10j]), np.tile(np.eye(2), (2, 1, 1)), unknown, unknown, shared)
    trace = WalkTrace.of(round_a_square(), 0, landmarks)
    assert trace is not None
    np.testing.assert_allclose(
        trace.covariance_bcs, np.tile(np.diag([0.01, 0.03]), (len(trace.way_m), 1, 1)), atol=1e-6
    )
