"""Stretches without tracking."""

from __future__ import annotations

import numpy as np
import pytest

from tests.drifting import camera_track
from vislam2tag.estimation.steps import (
    FOUND_M_S,
    FOUND_SIGMA_M,
    FOUND_TURN_RAD,
    FROZEN_WALK_M,
    FROZEN_WALK_M_S,
    NEW_MAP_TURN_RAD,
    UNSEEN_M_S,
    frozen_frames,
    loss_turn_rad,
    steps_over_loss,
    walkable_m,
)

DT = np.full(90, 1 / 30)


def frozen(found_m: complex) -> np.ndarray:
    """Three seconds in which the camera stands still, and is found this far away."""
    step = np.zeros(90, dtype=np.complex128)
    step[-1] = found_m
    return step


@pytest.mark.parametrize("found_m", [0.4, 3 + 2j, -10j])  # farther than anybody walks in the last step
def test_who_is_found_where_he_may_have_walked_is_in_the_same_map(found_m: complex) -> None:
    step, variance = steps_over_loss(frozen(found_m), DT)
    assert step.sum() == pytest.approx(found_m)
    assert variance.sum() == pytest.approx((FOUND_M_S * 3.0) ** 2)
    assert loss_turn_rad(frozen(found_m), DT) == FOUND_TURN_RAD


def test_who_is_found_farther_off_is_in_another_map_of_any_heading() -> None:
    assert loss_turn_rad(frozen(60 + 10j), DT) == NEW_MAP_TURN_RAD
    step, variance = steps_over_loss(frozen(60 + 10j), DT)
    assert step.sum() == 0
    assert variance.sum() == pytest.approx((UNSEEN_M_S * 3.0) ** 2)


def test_a_camera_that_only_walks_on_has_not_made_good_for_the_way() -> None:
    assert steps_over_loss(frozen(0.05), DT)[1].sum() == pytest.approx((UNSEEN_M_S * 3.0) ** 2)


def test_the_longer_frozen_the_farther_somebody_may_have_walked() -> None:
    mask = np.zeros(90, dtype=bool)
    mask[10:40] = mask[50:80] = True
    way_m = walkable_m(mask, np.where(np.arange(90) < 45, 1 / 30, 0.1))
    assert way_m[10:40] == pytest.approx(FROZEN_WALK_M + FROZEN_WALK_M_S)
    assert way_m[50:80] == pytest.approx(FROZEN_WALK_M + 3 * FROZEN_WALK_M_S)
    assert not way_m[~mask].any()


def test_a_position_that_stays_to_the_last_bit_is_none_where_it_stays_long() -> None:
    time_s = 100 + np.arange(90) / 30
    path = (np.arange(90) * 0.03).astype(np.complex128)
    path[10:15] = path[10]
    path[40:60] = path[40]
    frozen_at = np.flatnonzero(frozen_frames(camera_track(path, time_s), np.arange(90), time_s))
    assert frozen_at.tolist() == list(range(40, 60))


def test_a_tracker_that_goes_on_is_believed_but_for_its_jumps() -> None:
    walking = np.full(90, 0.03 + 0j)
    walking[40] = 20j
    step, variance = steps_over_loss(walking, DT)
    np.testing.assert_array_equal(step, np.where(np.arange(90) == 40, 0, walking))
    assert variance.sum() == pytest.approx(FOUND_SIGMA_M**2)


@pytest.mark.parametrize(("found_m", "turn_rad"), [(11.0, FOUND_TURN_RAD), (13.0, NEW_MAP_TURN_RAD)])
def test_no_one_walks_twelve_metres_in_three_seconds_and_the_one_before(found_m: float, turn_rad: float) -> None:
    assert loss_turn_rad(frozen(found_m), DT) == turn_rad
    assert steps_over_loss(frozen(found_m), DT)[0].sum() == pytest.approx(found_m if found_m < 12 else 0)


@pytest.mark.parametrize(("speed_m_s", "goes_on"), [(0.2, False), (0.4, True)])
def test_a_camera_that_hardly_moves_while_tracking_is_lost_is_frozen(speed_m_s: float, goes_on: bool) -> None:
    logged = np.where(np.arange(90) % 2, 0.0, 2 * speed_m_s / 30).astype(np.complex128)
    step, variance = steps_over_loss(logged, DT)
    np.testing.assert_allclose(step, logged if goes_on else logged.mean(), atol=1e-9)
    assert (variance.sum() < 0.2**2) == goes_on


@pytest.mark.parametrize(("size_m", "jumped"), [(0.25, False), (0.35, True)])
def test_a_step_of_a_foot_is_a_jump_of_a_tracker_that_goes_on(size_m: float, jumped: bool) -> None:
    walking = np.full(90, 0.03 + 0j)
    walking[40] = size_m * 1j
    assert steps_over_loss(walking, DT)[0][40] == (0 if jumped else size_m * 1j)
