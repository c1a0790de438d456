"""Poses at the times of their stamps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.core.orientation import camera_to_bcs
from vislam2tag.smoother.exposure import ExposureInterpolation

TIME_S = np.arange(100) / 30.0
UPRIGHT = np.tile((0.0, 0.0, 0.0, 1.0), (100, 1))


@given(st.floats(-0.4, 0.4))
def test_a_walker_is_where_he_was_at_the_stamp(lag_s: float) -> None:
    stamped_late = TIME_S + lag_s
    at_stamps = ExposureInterpolation.of(stamped_late, lag_s).blend(np.column_stack((TIME_S, -2 * TIME_S)))
    inside = (stamped_late >= TIME_S[0]) & (stamped_late <= TIME_S[-1])
    np.testing.assert_allclose(at_stamps[inside], np.column_stack((stamped_late, -2 * stamped_late))[inside], atol=1e-9)


def test_without_a_lag_nothing_changes() -> None:
    values = np.random.default_rng(1).standard_normal((100, 2, 2))
    np.testing.assert_allclose(ExposureInterpolation.of(TIME_S, 0.0).blend(values), values)


def test_beyond_the_last_exposure_the_pose_stands_still() -> None:
    at_stamps = ExposureInterpolation.of(TIME_S, 0.2).blend(TIME_S)
    np.testing.assert_allclose(at_stamps[-6:], TIME_S[-1])


def test_what_is_not_known_stays_so_and_spoils_no_neighbour() -> None:
    height = np.where(np.arange(100) < 50, np.nan, 3.0)
    np.testing.assert_array_equal(ExposureInterpolation.of(TIME_S, 0.05).blend(height), height)


@pytest.mark.parametrize("lag_s", [0.05, -0.05])
def test_orientations_turn_with_the_walk(lag_s: float) -> None:
    heading = camera_to_bcs(UPRIGHT, 4.0 * TIME_S)  # more than a turn: the sign of w changes on the way
    wanted = camera_to_bcs(UPRIGHT, 4.0 * (TIME_S + lag_s))
    found = ExposureInterpolation.of(TIME_S + lag_s, lag_s).blend_quaternions(heading)
    np.testing.assert_allclose(found[5:-5], wanted[5:-5], atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1)
    assert np.all(found[:, 3] >= 0)
