"""What neighbouring steps lead to expect, and which steps no camera makes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.steps import implausible, median_of, predicted, predicted_in_plane, prediction_sigma_m

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
