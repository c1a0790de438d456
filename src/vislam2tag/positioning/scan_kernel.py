"""Ridge regression with a Gaussian kernel on the direction of a scan's powed levels.

The direction of a scan's vector stays the same where a phone hears everything fainter by a factor. Where there are
more scans than can be solved for, a drawn part of them spans the solution (Williams and Seeger 2001).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from vislam2tag.core.arrays import FloatArray

EXPONENT = 1.7
"""Power of levels before their direction is taken; chosen by cross-validation (docs/positioning.md)."""
MOST_CENTRES = 1500
SMALLEST = 1e-9
_JITTER = 1e-6
_AT_ONCE = 2048
Pair = tuple[FloatArray, FloatArray]


@dataclass(frozen=True)
class ScanKernel:
    """A function from levels (n, a) to ``t`` numbers, spanned by the kernels around ``m`` scans."""

    centre: FloatArray
    """(m, a) directions."""
    weight: FloatArray
    """(m, t)"""
    mean: FloatArray
    """(t,) what is answered far from all that was learned."""
    sharpness: float

    def __call__(self, level: FloatArray) -> FloatArray:
        """Evaluate at levels (n, a) from 0 to 1: (n, t)."""
        return np.asarray(_likeness(level, self.centre, self.sharpness) @ self.weight + self.mean)


@dataclass
class NormalEquations:
    """Least squares over any number of examples, for kernels around given scans."""

    centre: FloatArray
    sharpness: float
    mean: FloatArray
    gram: FloatArray
    """(m, m)"""
    moment: FloatArray
    """(m, t)"""

    @classmethod
    def around(cls, level: FloatArray, sharpness: float, mean: FloatArray) -> Self:
        """Start with no example; kernels lie around these levels (m, a)."""
        m = len(level)
        return cls(directions(level), sharpness, mean, np.zeros((m, m)), np.zeros((m, len(mean))))

    def add(self, examples: Iterable[Pair]) -> Self:
        """Count in examples, part after part: levels (n, a) and what to answer (n, t)."""
        for level, target in examples:
            for rows in (slice(at, at + _AT_ONCE) for at in range(0, len(level), _AT_ONCE)):
                like = self.likeness(level[rows])
                self.gram += like.T @ like
                self.moment += like.T @ (target[rows] - self.mean)
        return self

    def likeness(self, level: FloatArray) -> FloatArray:
        """Return how like the centres scans of these levels (n, a) are: (n, m) from 0 to 1."""
        return _likeness(level, self.centre, self.sharpness)

    def normal(self, ridge: float) -> FloatArray:
        """Return the matrix (m, m) of the equations, smoothed by this much."""
        among = np.exp(2 * self.sharpness * (self.centre @ self.centre.T - 1))
        return np.asarray(self.gram + ridge * among + _JITTER * np.eye(len(among)))

    def solved(self, ridges: Sequence[float]) -> list[ScanKernel]:
        """Return the function for each ridge."""
        weights = (cho_solve(cho_factor(self.normal(ridge)), self.moment) for ridge in ridges)
        return [ScanKernel(self.centre, weight, self.mean, self.sharpness) for weight in weights]


def directions(level: FloatArray, exponent: float = EXPONENT) -> FloatArray:
    """Scale each scan's powed levels (n, a) to length 1."""
    powed = level**exponent
    return np.asarray(powed / np.maximum(np.linalg.norm(powed, axis=1, keepdims=True), SMALLEST))


def _likeness(level: FloatArray, centre: FloatArray, sharpness: float) -> FloatArray:
    """(n, m) from 0 to 1: the Gaussian of the distance between directions."""
    return np.asarray(np.exp(2 * sharpness * (directions(level) @ centre.T - 1)))
