"""A mapped walk as others are told of it.

What a walk is told, rounded.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.context import PlaceTies
from vislam2tag.core.tracks import Trajectory
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.positioning.walk_traces import WalkTrace, rounded, rounded_covariance

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


def test_a_place_a_metre() -> None:
    trace = WalkTrace.of(round_a_square(), 0, NOTHING)
    assert trace is not None
    np.testing.assert_allclose(np.diff(trace.way_m[:-1]), 1, atol=0.06)
    assert trace.time_ns[-1] == round_a_square().time_ns[-1]
    assert trace.whole.all()
    np.testing.assert_allclose(trace.position_bcs[[3, 15, 25]], [(3, 0), (10, 5), (5, 10)], atol=0.11)
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


def test_where_the_walk_led_meanwhile_is_not_made_up() -> None:
    mapped = round_a_square()
    floor = np.zeros(600, dtype=np.int64)
    floor[150:290] = 1  # 1.4 s on another floor
    trace = WalkTrace.of(replace(mapped, floor=floor), 0, NOTHING)
    assert trace is not None
    asked = mapped.time_ns[[-1, 0, 140, 160, 280, 310, 599]] + np.array([10**9, 0, 0, 0, 0, 0, 0])
    np.testing.assert_array_equal(trace.knows(asked), [False, True, True, False, False, True, True])
    floor[170:290] = 0  # 0.2 s
    short = WalkTrace.of(replace(mapped, floor=floor), 0, NOTHING)
    assert short is not None
    assert short.whole.all()


def test_whoever_stands_is_told_of_where_he_stands() -> None:
    mapped = round_a_square()
    time_ns = mapped.time_ns.copy()
    time_ns[150:] += 20 * 10**9
    stands = replace(mapped, position_bcs=np.repeat(mapped.position_bcs[::20], 20, axis=0), time_ns=mapped.time_ns * 25)
    trace = WalkTrace.of(stands, 0, NOTHING)
    assert trace is not None
    middle = stands.time_ns[[110, 570]]
    np.testing.assert_allclose(trace.along(middle)[:, :2], stands.position_bcs[[110, 570], :2], atol=0.45)
    np.testing.assert_allclose(trace.along(stands.time_ns[[-1]])[:, :2], stands.position_bcs[[-1], :2])


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
