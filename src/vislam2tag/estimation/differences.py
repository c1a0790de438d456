"""Least squares over differences of unknowns, with heavy tails for what may be quite wrong."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.robust import Caution, IterationResult, iterate, variance_factor

if TYPE_CHECKING:
    from scipy.sparse import csr_array


WIDENED = Caution(4.0, 0.88)
"""The tails are wider at first, so that the first guess does not decide what is wrong."""
SETTLED_M = 0.001
"""Re-weighting has converged when no unknown moves any more by this."""
MOST_ROUNDS = 200
"""Far more than any takes that converges: a limit, not a number of rounds."""
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
    """Find all unknowns (u,), metres, by re-weighted least squares from a first guess; the tails narrow at first.

    The measurements must leave no unknown free. Sparse: cost grows linearly where each unknown has few neighbours.
    """
    # Only walks through buildings whose heights matter come here; the others need not wait for these to load.
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
