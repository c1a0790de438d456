"""Robust re-weighting: variances by Student's t, and an iteration that reports whether it converged.

Observations that may contain gross errors are weighted by their residuals in the last solution, and solved for again:
iteratively re-weighted least squares. For Student's t it is expectation maximisation (Lange, Little and Taylor 1989).
It converges linearly, in few rounds or in many.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, log
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import FloatArray

_State = TypeVar("_State")
TRUSTED = 0.9
"""The smallest comparisons, up to this share, estimate the usual size of errors; faults are among the others."""
TRUSTED_MEAN_SQUARE = 2 - np.log(10) * 2 / 9
"""Mean of the square of two normal numbers, in units of their variance, below the quantile :data:`TRUSTED`."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class IterationResult(Generic[_State]):
    """Where an iteration ended: its last ``state``, and by how much the last of its ``rounds`` ``moved`` it."""

    state: _State
    rounds: int
    moved: float
    converged: bool


@dataclass(frozen=True)
class Caution:
    """The first rounds take observations for less certain, by a ``factor`` of their variance that each round lowers.

    Graduated, so that a bad observation shows as such before it can bend the solution (Yang et al. 2020).
    """

    factor: float = 1.0
    relaxation: float = 0.5
    """What is left of the factor after each round."""

    def at(self, number: int) -> float:
        """Factor of the variance in the round of this number (from 0)."""
        return max(self.factor * self.relaxation**number, 1.0)

    @property
    def rounds(self) -> int:
        """So many rounds are cautious, and one more, at least."""
        return 1 + ceil(log(self.factor) / -log(self.relaxation))


def iterate(
    what: str,
    start: _State,
    step: Callable[[_State, int], _State],
    moved: Callable[[_State, _State], float],
    *,
    tolerance: float,
    most_rounds: int,
    least_rounds: int = 1,
    logged: bool = True,
) -> IterationResult[_State]:
    """Repeat ``step``, which takes a state and the number of the round (from 1), until it hardly moves the state.

    ``moved`` gives the size of the change from one state to the next, in the unit of ``tolerance``; the iteration has
    converged once that is less. Before ``least_rounds``, as where a first caution has yet to wear off, no one asks.
    Where it does not converge it says so in the log, by ``what`` is iterated, unless it is but a trial (``logged``).
    """
    state, size = start, float("inf")
    for number in range(1, most_rounds + 1):
        before, state = state, step(state, number)
        size = moved(before, state)
        if number >= least_rounds and size < tolerance:
            return IterationResult(state, number, size, converged=True)
    if logged:
        _log.warning("%s did not converge: after %d iterations it still changes by %g", what, most_rounds, size)
    return IterationResult(state, most_rounds, size, converged=False)


def variance_factor(squares: npt.ArrayLike, dimensions: npt.ArrayLike, dof: float) -> FloatArray:
    """Factor by which observations' variance exceeds the usual, for Student's t with ``dof`` degrees of freedom.

    Of each observation, ``squares`` (...) is the sum of the squares of its ``dimensions`` (...) residuals in units of
    their usual standard deviations. An observation counts for the inverse of its factor.
    """
    return np.asarray((dof + np.asarray(squares)) / (dof + np.asarray(dimensions)), dtype=np.float64)


def trusted(squares: FloatArray) -> FloatArray:
    """The least of squares (n,), as many of them as are believed to be without a fault."""
    return np.asarray(np.sort(squares)[: int(TRUSTED * len(squares))])
