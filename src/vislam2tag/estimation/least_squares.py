"""Least squares for paths and for heights: on a chain with a border, and over differences of unknowns.

The normal equations have ``k`` states in a row (4 unknowns each, connected only to their neighbours) and ``b`` further
unknowns that may be connected to any of them. They are block tridiagonal with an arrow-shaped border. Eliminating the
states one by one and back (a Kalman smoother in information form) costs ``O(k b^2 + b^3)`` and gives every needed
covariance (:func:`solve`).

Differences of unknowns with some outliers have heavy tails (:func:`solve_robustly`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.robust import Caution, IterationResult, iterate, variance_factor

if TYPE_CHECKING:
    from scipy.sparse import csr_array


@dataclass(frozen=True)
class NormalEquations:
    """``diagonal`` (k, n, n), ``upper`` (k - 1, n, n) between neighbours, ``border`` (k, n, b), ``corner`` (b, b),
    right sides ``right`` (k, n) and ``corner_right`` (b,).
    """

    diagonal: FloatArray
    upper: FloatArray
    border: FloatArray
    corner: FloatArray
    right: FloatArray
    corner_right: FloatArray


@dataclass(frozen=True)
class Solution:
    """Most probable states and their joint covariances.

    ``state`` (k, n), ``covariance`` (k, n, n), ``next_covariance`` (k - 1, n, n) of each state with the one after it,
    ``border`` (b,), ``border_covariance`` (b, b), ``cross`` (k, n, b) of the states with the border.
    """

    state: FloatArray
    covariance: FloatArray
    next_covariance: FloatArray
    border: FloatArray
    border_covariance: FloatArray
    cross: FloatArray


def solve(equations: NormalEquations) -> Solution:
    """Solve positive definite normal equations; raises numpy.linalg.LinAlgError if they are singular."""
    count = len(equations.diagonal)
    inverse, gain, columns = _eliminate(equations)
    covariance = np.empty_like(equations.diagonal)
    cross_covariance = np.empty_like(equations.upper)
    covariance[-1] = inverse[-1]
    columns[-1] = inverse[-1] @ columns[-1]
    for k in range(count - 2, -1, -1):
        columns[k] = inverse[k] @ columns[k] - gain[k] @ columns[k + 1]
        cross_covariance[k] = -gain[k] @ covariance[k + 1]
        covariance[k] = inverse[k] - cross_covariance[k] @ gain[k].T
    return _with_border(equations, columns, covariance, cross_covariance)


def most_probable(equations: NormalEquations) -> tuple[FloatArray, float]:
    """States (k, n) of a chain without a border, and the logarithm of the equations' determinant, no covariances.

    Uses a banded Cholesky factor, about ten times faster than :func:`solve`.
    """
    from scipy.linalg import cho_solve_banded, cholesky_banded  # not needed for most sessions

    factor = cholesky_banded(_banded(equations), overwrite_ab=True, check_finite=False)
    state = cho_solve_banded((factor, False), equations.right.ravel(), check_finite=False)
    return np.asarray(state.reshape(equations.right.shape)), 2 * float(np.log(factor[-1]).sum())


def _banded(equations: NormalEquations) -> FloatArray:
    """Upper banded form (2 n, k n) of the chain, as SciPy wants it."""
    count, size = equations.right.shape
    width = 2 * size - 1
    banded = np.zeros((width + 1, count * size))
    for row in range(size):
        for column in range(row, size):
            banded[width - (column - row), column::size] = equations.diagonal[:, row, column]
        for column in range(size):
            banded[width - (size + column - row), size + column :: size] = equations.upper[:, row, column]
    return banded


def _eliminate(equations: NormalEquations) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Eliminate the states one by one: inverted pivots (k, n, n), gains (k - 1, n, n) and right sides (k, n, 1 + b)."""
    columns = np.concatenate((equations.right[:, :, None], equations.border), axis=2)
    pivot = equations.diagonal[0]
    inverse, gain = np.empty_like(equations.diagonal), np.empty_like(equations.upper)
    for k, upper in enumerate(equations.upper):
        inverse[k] = np.linalg.inv(pivot)
        gain[k] = inverse[k] @ upper
        columns[k + 1] -= gain[k].T @ columns[k]
        pivot = equations.diagonal[k + 1] - upper.T @ gain[k]
    inverse[-1] = np.linalg.inv(pivot)
    return inverse, gain, columns


def _with_border(
    equations: NormalEquations, columns: FloatArray, covariance: FloatArray, cross_covariance: FloatArray
) -> Solution:
    """Solve for the border (b,) by its Schur complement and add its uncertainty to the states' (k, n, n)."""
    free, response = columns[:, :, 0], columns[:, :, 1:]
    flat = equations.border.reshape(free.size, equations.border.shape[2])
    schur = equations.corner - flat.T @ response.reshape(flat.shape)
    border_covariance: FloatArray = np.asarray(np.linalg.inv((schur + schur.T) / 2), dtype=np.float64)
    border = border_covariance @ (equations.corner_right - flat.T @ free.reshape(-1))
    cross = -response @ border_covariance
    return Solution(
        state=free - response @ border,
        covariance=covariance - cross @ response.transpose(0, 2, 1),
        next_covariance=cross_covariance - cross[:-1] @ response[1:].transpose(0, 2, 1),
        border=border,
        border_covariance=border_covariance,
        cross=cross,
    )


WIDENED = Caution(4.0, 0.88)
"""Wider tails at first, so that the first guess does not decide what is an outlier."""
SETTLED_M = 0.001
"""Re-weighting has converged when no unknown moves by more than this."""
MOST_ROUNDS = 200
"""Iteration limit, far above the usual number."""
FREEDOM = 4.0
"""Degrees of freedom of Student's t."""


@dataclass(frozen=True)
class Differences:
    """Measurements ``unknown[first] - unknown[second] = value`` (r,), each with a standard deviation ``sigma`` (r,).

    ``second`` is -1 for a measurement of one unknown. ``tailed`` ones follow Student's t, the others Gauss.
    """

    first: IntArray
    second: IntArray
    value: FloatArray
    sigma: FloatArray
    tailed: bool = True


def solve_robustly(measurements: Sequence[Differences], start: FloatArray) -> IterationResult[FloatArray]:
    """Find all unknowns (u,), metres, by re-weighted least squares from a first guess, with wider tails at first.

    The measurements must determine all unknowns. The cost is linear if each unknown has few neighbours.
    """
    # Imported here, because only walks through buildings with several heights need them.
    from scipy.sparse import diags_array
    from scipy.sparse.linalg import spsolve

    matrix, value = _whitened(measurements, len(start))
    tailed = np.concatenate([np.full(len(group.value), group.tailed) for group in measurements])

    def step(solution: FloatArray, number: int) -> FloatArray:
        residual = (matrix @ solution - value) / WIDENED.at(number - 1)
        weight = np.where(tailed, 1 / variance_factor(residual**2, 1, FREEDOM), 1.0)
        weighted = matrix.T @ diags_array(weight)
        return np.asarray(spsolve((weighted @ matrix).tocsc(), weighted @ value))

    return iterate(
        "the walk's height",
        start,
        step,
        lambda before, after: float(np.abs(after - before).max(initial=0.0)),
        tolerance=SETTLED_M,
        most_rounds=MOST_ROUNDS,
        least_rounds=WIDENED.rounds,
    )


def _whitened(measurements: Sequence[Differences], unknowns: int) -> tuple[csr_array, FloatArray]:
    """All rows divided by their sigma: a sparse matrix (r, unknowns) and a right-hand side (r,)."""
    from scipy.sparse import csr_array

    first = np.concatenate([group.first for group in measurements])
    second = np.concatenate([group.second for group in measurements])
    weight = 1.0 / np.concatenate([group.sigma for group in measurements])
    rows, both = np.arange(len(first)), second >= 0
    values = np.concatenate((weight, -weight[both]))
    places = np.concatenate((rows, rows[both])), np.concatenate((first, second[both]))
    matrix = csr_array((values, places), shape=(len(rows), unknowns))
    return matrix, np.concatenate([group.value for group in measurements]) * weight
