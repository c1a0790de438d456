"""Jumps of the camera that undo each other."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.walks import camera_on, log_of
from vislam2tag.core.arrays import ComplexArray
from vislam2tag.estimation.odometry import Odometry, continuous_odometry
from vislam2tag.estimation.steps import PLACE_SIGMA_M, Excursion, find_excursions, returned

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
    return [(trip.away, trip.back) for trip in find_excursions(jump, jump != 0, unknown, WAY_M)]


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
    led, variance = returned(Excursion(0, count - 1, complex(x, y)), step)
    assert led.sum() == pytest.approx(step.sum() + complex(x, y))
    assert variance[-1] == 0
    assert np.all(variance[:-1] >= PLACE_SIGMA_M**2)


def test_an_excursion_of_no_length_is_no_division_by_zero() -> None:
    led, _ = returned(Excursion(0, 2, 0.3 + 0j), np.zeros(3, dtype=np.complex128))
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
