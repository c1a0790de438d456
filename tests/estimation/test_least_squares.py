"""The chain solver against a dense one that knows nothing of chains.

Robust least squares over differences.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.estimation.dense import as_matrix
from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.least_squares import Differences, NormalEquations, Solution, solve, solve_robustly


def random_equations(seed: int, states: int, border: int, size: int) -> NormalEquations:
    """Positive definite normal equations of random observations of states, neighbours and border."""
    rng = np.random.default_rng(seed)
    unknowns = states * size + border
    matrix = 0.1 * np.eye(unknowns)
    for k in range(states):
        last = min(k + 2, states)
        row = np.zeros((size + 1, unknowns))
        row[:, k * size : last * size] = rng.normal(size=(size + 1, (last - k) * size))
        matrix += row.T @ row
        row = np.zeros((size, unknowns))
        row[:, k * size : (k + 1) * size] = rng.normal(size=(size, size))
        row[:, states * size :] = rng.normal(size=(size, border))
        matrix += row.T @ row
    right = rng.normal(size=unknowns)
    at = [slice(k * size, (k + 1) * size) for k in range(states)]
    rest = slice(states * size, None)
    return NormalEquations(
        diagonal=np.array([matrix[a, a] for a in at]),
        upper=np.array([matrix[a, b] for a, b in pairwise(at)]).reshape(-1, size, size),
        border=np.array([matrix[a, rest] for a in at]),
        corner=matrix[rest, rest],
        right=np.array([right[a] for a in at]),
        corner_right=right[rest],
    )


def from_dense(equations: NormalEquations) -> Solution:
    matrix, right = as_matrix(equations)
    inverse: FloatArray = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    value = inverse @ right
    states, size, _ = equations.border.shape
    rest = states * size
    blocks = inverse[:rest, :rest].reshape(states, size, states, size)
    k = np.arange(states)
    return Solution(
        state=value[:rest].reshape(states, size),
        covariance=blocks[k, :, k],
        next_covariance=blocks[k[:-1], :, k[1:]],
        border=value[rest:],
        border_covariance=inverse[rest:, rest:],
        cross=inverse[:rest, rest:].reshape(states, size, -1),
    )


@given(
    seed=st.integers(0, 2**32 - 1), states=st.integers(1, 40), border=st.integers(1, 6), size=st.sampled_from([1, 4])
)
def test_states_border_and_all_covariances_are_those_of_a_dense_solve(
    seed: int, states: int, border: int, size: int
) -> None:
    equations = random_equations(seed, states, border, size)
    ours, theirs = solve(equations), from_dense(equations)
    for name in Solution.__dataclass_fields__:
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=1e-6, atol=1e-8, err_msg=name)


def test_the_equations_are_left_as_they_were() -> None:
    equations = random_equations(1, 6, 3, 4)
    copies = {name: getattr(equations, name).copy() for name in NormalEquations.__dataclass_fields__}
    solve(equations)
    for name, before in copies.items():
        np.testing.assert_array_equal(getattr(equations, name), before)


def test_singular_equations_are_refused() -> None:
    equations = random_equations(2, 3, 1, 4)
    equations.diagonal[0] = 0
    equations.upper[0] = 0
    with pytest.raises(np.linalg.LinAlgError):
        solve(equations)


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
