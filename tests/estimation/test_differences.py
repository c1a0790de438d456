"""Robust least squares over differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from vislam2tag.estimation.differences import Differences, solve_robustly


def chain(values: np.ndarray, tailed: bool) -> list[Differences]:
    """A first value that is known, and all steps from each to the next."""
    k = len(values)
    steps = Differences(np.arange(1, k), np.arange(k - 1), np.diff(values), np.full(k - 1, 0.1), tailed)
    return [Differences(np.zeros(1, np.int64), np.full(1, -1), values[:1], np.full(1, 0.01), False), steps]


@given(arrays(np.float64, st.integers(2, 30), elements=st.floats(-100, 100)), st.booleans())
def test_consistent_measurements_are_met_exactly(values: np.ndarray, tailed: bool) -> None:
    found = solve_robustly(chain(values, tailed), np.zeros(len(values)))
    assert found.converged
    assert found.state == pytest.approx(values, abs=1e-6)


def test_one_wrong_measurement_among_many_is_outvoted_where_it_is_tailed() -> None:
    first, second = np.zeros(9, np.int64), np.full(9, -1)
    value = np.array([1.0] * 8 + [50.0])
    wrong = [Differences(first, second, value, np.full(9, 0.1), tailed) for tailed in (True, False)]
    robust, plain = (solve_robustly([part], np.zeros(1)).state[0] for part in wrong)
    assert robust == pytest.approx(1.0, abs=0.02)
    assert plain == pytest.approx(value.mean())
