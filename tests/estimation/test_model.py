"""The linear model against what it linearises."""

from __future__ import annotations

import numpy as np
import pytest

from tests.drifting import loops
from tests.estimation.test_equations import bent, linearised
from vislam2tag.estimation.noise import USUAL, DriftSource


@pytest.mark.parametrize("which", range(4))
def test_a_small_error_of_the_state_moves_the_landmark_as_stated(which: int) -> None:
    model = linearised(loops(1, USUAL, marks=5, laps=1))
    small = np.zeros(4)
    small[which] = 1e-6
    x, y, scale, heading = small
    camera = model.path[model.observations.passes.at] + x + 1j * y
    moved = camera + model.offset * (1 + scale) * np.exp(1j * heading) - model.seen_at
    stated = model.sight @ small
    np.testing.assert_allclose(moved, stated[:, 0] + 1j * stated[:, 1], atol=1e-11)


def test_the_reference_sees_landmarks_where_they_are() -> None:
    walk = loops(2, marks=5, laps=2, drifted=False)
    model = linearised(walk)
    landmark = model.observations.passes.landmark
    np.testing.assert_allclose(model.seen_at, walk.place[landmark], atol=1e-9)
    np.testing.assert_allclose(np.exp(1j * model.heading_rad), np.exp(1j * walk.heading_rad[landmark]), atol=1e-9)


def test_sheets_tell_nothing_while_the_heading_is_not_known_roughly() -> None:
    walk = loops(3, marks=5, laps=1)
    assert linearised(walk).headed.all()
    assert not linearised(walk, rough=True).headed.any()


def test_each_source_has_as_many_numbers_as_its_drift() -> None:
    ranks = linearised(loops(4, marks=5, laps=1)).ranks
    assert set(ranks[DriftSource.POSITION]) == {2}
    assert ranks[DriftSource.HEADING].min() >= 1
    assert ranks[DriftSource.HEADING].max() <= 3
    assert set(ranks[DriftSource.JUMP]) == {0}


def test_heading_and_scale_drift_alike_in_a_rough_model() -> None:
    model = linearised(loops(5, marks=5, laps=1), rough=True)
    stretch = model.stretches[DriftSource.HEADING][2]
    assert stretch[2, 2] == pytest.approx(stretch[3, 3])
    assert stretch[0, 0] == pytest.approx(stretch[1, 1])
    assert not model.stretches[DriftSource.SCALE].any()


def test_the_drift_that_a_reference_already_has_is_the_sum_of_its_turns() -> None:
    model = bent(linearised(loops(6, marks=5, laps=1)))
    a, b = 70, 400
    turned = np.diff(np.angle(model.turn / model.turn[0]))[a:b]
    led = np.sum(1j * turned * (model.path[b] - model.path[a + 1 : b + 1]))
    had = model.drifted(np.array([a]), np.array([b]))[0]
    np.testing.assert_allclose(had, (led.real, led.imag, 0, turned.sum()), atol=1e-9)
    assert not linearised(loops(6, marks=5, laps=1)).drifted(np.array([a]), np.array([b])).any()
