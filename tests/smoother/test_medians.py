"""Medians of a few arrays."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import median_filter

from vislam2tag.core.arrays import FloatArray
from vislam2tag.smoother.medians import median_of, running_median

NUMBERS = st.floats(-1e6, 1e6)


@given(st.integers(1, 9).flatmap(lambda k: arrays(np.float64, (k, 5), elements=NUMBERS)))
def test_a_median_of_few_arrays_is_numpys(rows: FloatArray) -> None:
    np.testing.assert_array_equal(median_of(list(rows)), np.median(rows, axis=0))


@given(arrays(np.float64, st.integers(1, 30), elements=NUMBERS), st.sampled_from((1, 3, 7)))
def test_a_running_median_is_scipys(values: FloatArray, size: int) -> None:
    np.testing.assert_array_equal(running_median(values, size), median_filter(values, size=size, mode="nearest"))


def test_one_spike_is_not_seen() -> None:
    values = np.zeros(9)
    values[4] = 5.0
    assert running_median(values, 3) == pytest.approx(0.0)
