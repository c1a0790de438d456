"""Least squares for paths and for heights: on a chain with a border, and over differences of unknowns.

The normal equations have ``k`` states in a row (4 unknowns each, connected only to their neighbours) and ``b`` further
unknowns that may be connected to any of them. They are block tridiagonal with an arrow-shaped border. Every second
state is eliminated at once, then every second one of the rest, and so on (cyclic reduction, Hockney 1965). On the way
back each state's covariance with its neighbours follows. That costs ``O(k b^2 + b^3)`` in ``O(log k)`` array operations
(:func:`solve`).

Differences of unknowns with some outliers have heavy tails (:func:`solve_robustly`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.robust import Caution, IterationResult, StoppingRule, iterate, variance_factor

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


FEW_STATES = 8
"""So few states are solved for at once, which is faster."""


def solve(equations: NormalEquations) -> Solution:
    """Solve positive definite normal equations; raises numpy.linalg.LinAlgError if they are singular."""
    diagonal, upper = equations.diagonal, equations.upper
    columns = np.concatenate((equations.right[:, :, None], equations.border), axis=2)
    eliminated: list[_Eliminated] = []
    while len(diagonal) > FEW_STATES:
        odd = _Eliminated.of(diagonal, upper, columns)
        diagonal, upper, columns = odd.rest(diagonal, upper, columns)
        eliminated.append(odd)
    chain = _solved_at_once(diagonal, upper, columns)
    for odd in reversed(eliminated):
        chain = odd.back(chain)
    return _with_border(equations, chain.columns, chain.covariance, chain.next_covariance)


@dataclass(frozen=True)
class _SolvedChain:
    """Solved right sides ``columns`` (k, n, 1 + b) of a chain, its ``covariance`` (k, n, n) and ``next_covariance``
    (k - 1, n, n) of each state with the one after it.
    """

    columns: FloatArray
    covariance: FloatArray
    next_covariance: FloatArray


def _solved_at_once(diagonal: FloatArray, upper: FloatArray, columns: FloatArray) -> _SolvedChain:
    """A short chain by one dense inverse."""
    count, size, _ = diagonal.shape
    matrix, k = np.zeros((count, size, count, size)), np.arange(count)
    matrix[k, :, k] = diagonal
    matrix[k[:-1], :, k[1:]], matrix[k[1:], :, k[:-1]] = upper, upper.transpose(0, 2, 1)
    inverse: FloatArray = np.asarray(np.linalg.inv(matrix.reshape(count * size, -1)), dtype=np.float64)
    blocks = inverse.reshape(matrix.shape)
    solved = (inverse @ columns.reshape(count * size, -1)).reshape(columns.shape)
    return _SolvedChain(solved, blocks[k, :, k], blocks[k[:-1], :, k[1:]])


@dataclass(frozen=True)
class _Eliminated:
    """The ``o`` odd states of a chain, eliminated: their inverted pivots ``inverse`` (o, n, n), the dependence on their
    neighbours ``before`` (o, n, n) and ``after`` (o or o - 1, n, n), and right sides ``columns`` (o, n, 1 + b).
    """

    inverse: FloatArray
    before: FloatArray
    after: FloatArray
    columns: FloatArray

    @classmethod
    def of(cls, diagonal: FloatArray, upper: FloatArray, columns: FloatArray) -> _Eliminated:
        """Eliminate the odd states; the last one may have no neighbour after it."""
        inverse: FloatArray = np.asarray(np.linalg.inv(diagonal[1::2]), dtype=np.float64)
        after = inverse[: len(upper[1::2])] @ upper[1::2]
        return cls(inverse, inverse @ upper[::2].transpose(0, 2, 1), after, columns[1::2])

    def rest(
        self, diagonal: FloatArray, upper: FloatArray, columns: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Equations of the chain of the even states: ``diagonal``, ``upper`` and ``columns``."""
        odd, both = len(self.before), len(self.after)
        diagonal, columns = diagonal[::2].copy(), columns[::2].copy()
        diagonal[:odd] -= upper[::2] @ self.before
        diagonal[1:] -= upper[1::2].transpose(0, 2, 1) @ self.after
        columns[:odd] -= self.before.transpose(0, 2, 1) @ self.columns
        columns[1:] -= self.after.transpose(0, 2, 1) @ self.columns[:both]
        return diagonal, -upper[::2][:both] @ self.after, columns

    def back(self, even: _SolvedChain) -> _SolvedChain:
        """The whole chain from its even states."""
        odd, both = len(self.before), len(self.after)
        own = self.inverse @ self.columns - self.before @ even.columns[:odd]
        own[:both] -= self.after @ even.columns[1:]
        with_before = -self.before @ even.covariance[:odd]
        with_before[:both] -= self.after @ even.next_covariance.transpose(0, 2, 1)
        with_after = -self.before[:both] @ even.next_covariance - self.after @ even.covariance[1:]
        covariance = self.inverse - with_before @ self.before.transpose(0, 2, 1)
        covariance[:both] -= with_after @ self.after.transpose(0, 2, 1)
        return _SolvedChain(
            _alternating(even.columns, own),
            _alternating(even.covariance, covariance),
            _alternating(with_before.transpose(0, 2, 1), with_after),
        )


def _alternating(even: FloatArray, odd: FloatArray) -> FloatArray:
    """Arrays (e, ...) and (o, ...) in turn, the even ones first."""
    mixed = np.empty((len(even) + len(odd), *even.shape[1:]))
    mixed[::2], mixed[1::2] = even, odd
    return mixed


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
        StoppingRule(tolerance=SETTLED_M, most_rounds=MOST_ROUNDS, least_rounds=WIDENED.rounds),
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
