"""Robust re-weighting: variances by Student's t, and an iteration that reports whether it converged.

Observations that may contain gross errors are weighted by their residuals in the last solution, and solved for again:
iteratively re-weighted least squares. For Student's t it is expectation maximisation (Lange, Little and Taylor 1989).
It converges linearly, in few rounds or in many.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, inf, log
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from vislam2tag.core.arrays import ComplexArray, FloatArray

_State = TypeVar("_State")
TRUSTED = 0.9
"""The smallest comparisons, up to this share, estimate the usual size of errors; faults are among the others."""
TRUSTED_MEAN_SQUARE = 2 - np.log(10) * 2 / 9
"""Mean of the square of two normal numbers, in units of their variance, below the quantile :data:`TRUSTED`."""
_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class IterationResult(Generic[_State]):
    """Where an iteration ended: its last ``state`` after a number of ``rounds``.

    ``remaining`` is the estimated distance from there to the limit, in the unit of the tolerance.
    """

    state: _State
    rounds: int
    remaining: float
    converged: bool

    @property
    def unreached(self) -> float:
        """``remaining``, or 0 if it converged."""
        return 0.0 if self.converged else self.remaining


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


LEAST_RATE = 0.5
"""Each step is taken to leave at least this share of the distance, whatever the last two steps look like."""
NEGLIGIBLE = 1e-6
"""A step below this share of the tolerance may be rounding, whose rate is about 1; the limit is reached."""
LONGEST = 8.0
"""Largest factor by which a step is lengthened: far enough to save rounds, too short to leave for another solution."""
STRAIGHT = 0.9
"""Steps are lengthened if the cosine between the last two is larger ..."""
SLOW = 0.3
"""... and the second is at least this long compared with the first."""


@dataclass(frozen=True, kw_only=True)
class StoppingRule:
    """When an iteration ends: after ``most_rounds``, or, not before ``least_rounds``, close to its limit.

    A small step does not mean that the limit is close: if each step is ``rate`` times as long as the one before, steps
    of the total length ``size * rate / (1 - rate)`` remain. The limit is close when that is below the ``tolerance``.
    The rate is that of the last two steps, or ``least_rate`` if that is larger; after one step it is ``first_rate`` (1:
    not known).
    """

    tolerance: float
    most_rounds: int
    least_rounds: int = 1
    """More than 1 where a first caution has yet to wear off."""
    least_rate: float = LEAST_RATE
    first_rate: float = 1.0


def iterate(
    what: str,
    start: _State,
    step: Callable[[_State, int], _State],
    moved: Callable[[_State, _State], float | FloatArray | ComplexArray],
    rule: StoppingRule,
    *,
    long_step: Callable[[_State, int, float], _State] | None = None,
    logged: bool = True,
) -> IterationResult[_State]:
    """Repeat ``step``, which takes a state and the number of the round (from 1), until the limit is close.

    ``moved`` gives the change from one state to the next, a number or an array (k,), in the unit of the tolerance.

    ``long_step`` takes a step that is a number of times as long. If it is given, every third step is made longer where
    the two before it point the same way. It never turns back or sideways, so it ends where short steps end, unlike a
    Newton step, which may end at a saddle point (SQUAREM, Varadhan and Roland 2008, with a limited length). What is
    left of a slow change after a long step hides behind faster ones, so its rate counts for the next two steps. Long
    steps after which changes turn back, or do not shrink as they did, are halved from then on, so that none goes in
    circles.

    Where it does not converge it says so in the log, by ``what`` is iterated, unless it is but a trial (``logged``).
    """
    last: _Movement | None = None
    state, remaining, slowest, pace = start, inf, rule.least_rate, _Pace()
    for number in range(1, rule.most_rounds + 1):
        if pace.times > 1 and long_step is not None:
            state, last = long_step(state, number, pace.times), None
            slowest, pace.times = max(rule.least_rate, 1 - 1 / pace.times), 1.0
            continue
        before, state = state, step(state, number)
        movement = _Movement.of(moved(before, state))
        if movement.size == inf:
            remaining, last = inf, None
            continue
        rate = max(slowest, rule.first_rate if last is None else movement.rate(last))
        remaining = movement.size * rate / (1 - rate) if rate < 1 else inf
        if movement.size < NEGLIGIBLE * rule.tolerance:
            remaining = movement.size
        if number >= rule.least_rounds and remaining < rule.tolerance:
            return IterationResult(state, number, remaining, converged=True)
        if last is not None:
            slowest = rule.least_rate
            if number >= rule.least_rounds:
                pace.adapt(last, movement, shrinking=rate < 1)
        last = movement if movement.size > NEGLIGIBLE * rule.tolerance else None
    if logged:
        _log.warning(
            "%s did not converge: %d iterations ended about %.2g from the limit", what, rule.most_rounds, remaining
        )
    return IterationResult(state, rule.most_rounds, remaining, converged=False)


@dataclass(frozen=True)
class _Movement:
    """A step (k,), its largest number, and its length."""

    change: FloatArray | ComplexArray
    size: float
    length: float

    @classmethod
    def of(cls, moved: float | FloatArray | ComplexArray) -> _Movement:
        change = np.atleast_1d(np.asarray(moved))
        size = float(np.abs(change).max(initial=0.0))
        return cls(change, size, float(np.vdot(change, change).real) ** 0.5 if size < inf else inf)

    def rate(self, last: _Movement) -> float:
        """Length in units of the step before, by the largest number or by all, whichever is greater."""
        return max(self.size / last.size, self.length / last.length)

    def follows(self, lengthened: _Movement, *, shrinking: bool) -> bool:
        """Whether it goes on in the direction of a step that was lengthened, and is shorter if steps were shrinking."""
        along = float(np.vdot(lengthened.change, self.change).real)
        return along > 0 and (self.length < lengthened.length or not shrinking)

    def times(self, last: _Movement) -> float:
        """Factor for the next step: to the limit if steps continue as these two, or :data:`LONGEST`."""
        rate = self.length / last.length
        along = float(np.vdot(last.change, self.change).real)
        if rate < SLOW or along < STRAIGHT * last.length * self.length:
            return 1.0
        return LONGEST if rate >= 1 else min(1 / (1 - rate), LONGEST)


@dataclass
class _Pace:
    """How many ``times`` as long the next step is, and how long it may be at most."""

    times: float = 1.0
    longest: float = LONGEST
    lengthened: _Movement | None = None
    """The last movement before a longer step, and whether movements were shrinking then."""
    shrinking: bool = True

    def adapt(self, last: _Movement, movement: _Movement, *, shrinking: bool) -> None:
        """Take the last two movements into account, after a longer step also whether it helped."""
        if self.lengthened is not None and not movement.follows(self.lengthened, shrinking=self.shrinking):
            self.longest = max(self.longest / 2, 1.0)
        self.times = min(movement.times(last), self.longest)
        self.lengthened, self.shrinking = movement if self.times > 1 else None, shrinking


def variance_factor(squares: npt.ArrayLike, dimensions: npt.ArrayLike, dof: float) -> FloatArray:
    """Factor by which observations' variance exceeds the usual, for Student's t with ``dof`` degrees of freedom.

    Of each observation, ``squares`` (...) is the sum of the squares of its ``dimensions`` (...) residuals in units of
    their usual standard deviations. An observation counts for the inverse of its factor.
    """
    return np.asarray((dof + np.asarray(squares)) / (dof + np.asarray(dimensions)), dtype=np.float64)


def trusted(squares: FloatArray) -> FloatArray:
    """The least of squares (n,), as many of them as are believed to be without a fault."""
    return np.asarray(np.sort(squares)[: int(TRUSTED * len(squares))])
