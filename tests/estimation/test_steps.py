"""What neighbouring steps lead to expect, and which steps no camera makes.

Stretches without tracking.

Jumps of the camera that undo each other.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.drifting import camera_track
from tests.walks import camera_on, log_of
from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.estimation.odometry import Odometry, continuous_odometry
from vislam2tag.estimation.steps import (
    FOUND_M_S,
    FOUND_SIGMA_M,
    FOUND_TURN_RAD,
    FROZEN_WALK_M,
    FROZEN_WALK_M_S,
    NEW_MAP_TURN_RAD,
    PLACE_SIGMA_M,
    UNSEEN_M_S,
    find_excursions,
    frozen_frames,
    implausible,
    loss_turn_rad,
    median_of,
    predicted,
    predicted_in_plane,
    prediction_sigma_m,
    returned,
    steps_over_loss,
    walkable_m,
)

NUMBERS = st.floats(-1e6, 1e6)


@given(st.integers(1, 9).flatmap(lambda k: arrays(np.float64, (k, 5), elements=NUMBERS)))
def test_a_median_of_few_arrays_is_numpys(rows: FloatArray) -> None:
    np.testing.assert_array_equal(median_of(list(rows)), np.median(rows, axis=0))


@given(arrays(np.float64, st.integers(7, 30), elements=NUMBERS))
def test_a_step_is_predicted_by_the_median_of_the_three_before_and_after(step: FloatArray) -> None:
    expected = predicted(step, np.ones(len(step)))
    for i in range(3, len(step) - 3):
        assert expected[i] == np.median(np.delete(step[i - 3 : i + 4], 3))


def test_predictions_go_by_the_time_that_a_step_takes() -> None:
    dt = np.where(np.arange(20) == 8, 0.5, 0.1)
    step = 1.3 * dt
    assert predicted(step, dt) == pytest.approx(step)
    turned = (step * (2 - 1j)).astype(np.complex128)
    assert predicted_in_plane(turned, dt) == pytest.approx(turned)
    assert len(predicted(np.empty(0), np.empty(0))) == 0


def test_one_spike_is_impossible_and_the_others_are_not() -> None:
    rng = np.random.default_rng(5)
    dt = np.full(400, 1 / 30)
    for dimensions in (1, 2):
        miss = np.linalg.norm(rng.normal(0, 0.01, (400, dimensions)), axis=1)
        miss[123] = 0.4
        spread = prediction_sigma_m(miss, dt, dimensions)
        assert spread == pytest.approx(0.01, rel=0.2)
        assert np.flatnonzero(implausible(miss, spread, dt, 3.0)).tolist() == [123]
        assert not implausible(miss, spread, dt, 15.0).any()


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


STEPS = 300
WAY_M = np.full(STEPS, 0.03)
NOWHERE = np.zeros(STEPS, dtype=bool)


def jumps(sizes: dict[int, complex]) -> ComplexArray:
    made = np.zeros(STEPS, dtype=np.complex128)
    for step, size in sizes.items():
        made[step] = size
    return made


def found(sizes: dict[int, complex], lost: int | None = None) -> list[tuple[int, int]]:
    jump, unknown = jumps(sizes), NOWHERE.copy()
    if lost is not None:
        unknown[lost] = True
    return [(away, back) for away, back, _ in find_excursions(jump, jump != 0, unknown, WAY_M)]


def test_a_jump_and_its_way_back_are_an_excursion() -> None:
    assert found({50: 20 + 5j, 150: -20.2 - 4.9j}) == [(50, 150)]
    assert found({50: 20j, 150: -20j, 200: 8, 250: -8}) == [(50, 150), (200, 250)]


def test_several_jumps_away_are_undone_by_one() -> None:
    assert found({50: 20, 80: 15j, 150: -20 - 15j}) == [(50, 150)]
    assert found({50: 20, 80: 15j, 110: -15j, 150: -20}) == [(80, 110)]


@pytest.mark.parametrize("back", [-10.0, -17.0, 20.0, -20 + 5j])
def test_a_jump_that_leads_back_in_part_undoes_nothing(back: complex) -> None:
    assert found({50: 20, 150: back}) == []


def test_small_jumps_undo_one_another_by_chance() -> None:
    assert found({50: 0.5, 150: -0.4}) == []


def test_nothing_is_known_across_a_loss() -> None:
    assert found({50: 20, 150: -20}, lost=100) == []


@given(st.integers(2, 40), st.floats(-1, 1), st.floats(-1, 1))
def test_the_way_over_an_excursion_is_what_the_log_says(count: int, x: float, y: float) -> None:
    step = np.full(count, 0.03 + 0.01j)
    led, variance = returned(complex(x, y), step)
    assert led.sum() == pytest.approx(step.sum() + complex(x, y))
    assert variance[-1] == 0
    assert np.all(variance[:-1] >= PLACE_SIGMA_M**2)


def test_an_excursion_of_no_length_is_no_division_by_zero() -> None:
    led, _ = returned(0.3 + 0j, np.zeros(3, dtype=np.complex128))
    assert led.sum() == pytest.approx(0.3)


def excursion(turn_rad: float) -> tuple[ComplexArray, Odometry]:
    """A straight walk of 20 m whose camera is 30 m off, and turned, from frame 200 to 350."""
    truth = np.asarray(np.arange(600) / 30.0, dtype=np.complex128)
    logged = truth.copy()
    away = slice(200, 350)
    logged[away] = 30j + truth[200] + (truth[away] - truth[200]) * np.exp(1j * turn_rad)
    camera = camera_on(np.column_stack((logged.real, logged.imag)))
    return truth, continuous_odometry(camera, log_of(camera, {"a": np.tile((5.0, 1.0, 1.0), (600, 1))}))


@pytest.mark.parametrize("turn_rad", [0.0, 0.1])
def test_after_an_excursion_the_path_is_where_the_log_is(turn_rad: float) -> None:
    truth, odometry = excursion(turn_rad)
    off = np.abs(odometry.path - truth)
    assert off[[0, 199, 350, 599]].max() < 0.05
    assert off.max() < 0.5
    assert odometry.aside_m2[[199, 350]].max() == 0
    assert odometry.aside_m2[275] > 0.1**2
    assert odometry.jump_m2.max() < 0.01**2
    assert odometry.jump_rad2.max() == 0
