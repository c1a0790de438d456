"""Ridge regression with kernels that tell how like two scans are.

The direction of a scan's vector stays the same where a phone hears everything fainter by a factor. Where there are
more scans than can be solved for, a drawn part of them spans the solution (Williams and Seeger 2001).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.scans.radio_scans import RadioScans
from vislam2tag.positioning.scans.representation import Representation, represented

EXPONENT = 1.7
"""Power of levels before their direction is taken; chosen by cross-validation (docs/positioning.md)."""
MOST_CENTRES = 1500
SMALLEST = 1e-9
_JITTER = 1e-6
_AT_ONCE = 2048
Pair = tuple[FloatArray, FloatArray]


class Likeness(Protocol):
    """How like ``m`` scans, the centres, others are; a positive definite kernel."""

    def __call__(self, level: FloatArray) -> FloatArray:
        """Compare scans of levels (n, a) from 0 to 1: (n, m)."""

    def among(self) -> FloatArray:
        """Compare the centres among themselves: (m, m)."""


LikenessT = TypeVar("LikenessT", bound=Likeness)


@dataclass(frozen=True)
class DirectionLikeness:
    """The Gaussian of the distance between the directions of powed levels: from 0 to 1."""

    centre: FloatArray
    """(m, a) directions."""
    sharpness: float

    def __call__(self, level: FloatArray) -> FloatArray:
        """Compare scans of levels (n, a): (n, m)."""
        return self._of(directions(level))

    def among(self) -> FloatArray:
        """Compare the centres among themselves: (m, m)."""
        return self._of(self.centre)

    def _of(self, direction: FloatArray) -> FloatArray:
        return np.asarray(np.exp(2 * self.sharpness * (direction @ self.centre.T - 1)))


@dataclass(frozen=True)
class ScanKernel(Generic[LikenessT]):
    """A function from levels (n, a) to ``t`` numbers, spanned by the kernels around ``m`` scans."""

    like: LikenessT
    weight: FloatArray
    """(m, t)"""
    mean: FloatArray
    """(t,) what is answered far from all that was learned."""

    def __call__(self, level: FloatArray) -> FloatArray:
        """Evaluate at levels (n, a) from 0 to 1: (n, t)."""
        return np.asarray(self.like(level) @ self.weight + self.mean)


@dataclass
class NormalEquations(Generic[LikenessT]):
    """Least squares over any number of examples, for kernels around given scans."""

    like: LikenessT
    mean: FloatArray
    gram: FloatArray
    """(m, m)"""
    moment: FloatArray
    """(m, t)"""

    @classmethod
    def empty(cls, like: LikenessT, mean: FloatArray, centres: int) -> Self:
        """Start with no example."""
        return cls(like, mean, np.zeros((centres, centres)), np.zeros((centres, len(mean))))

    def add(self, examples: Iterable[Pair]) -> Self:
        """Count in examples, part after part: levels (n, a) and what to answer (n, t)."""
        for level, target in examples:
            for rows in (slice(at, at + _AT_ONCE) for at in range(0, len(level), _AT_ONCE)):
                like = self.like(level[rows])
                self.gram += like.T @ like
                self.moment += like.T @ (target[rows] - self.mean)
        return self

    def normal(self, ridge: float) -> FloatArray:
        """Return the matrix (m, m) of the equations, smoothed by this much."""
        return np.asarray(self.gram + ridge * self.like.among() + _JITTER * np.eye(len(self.gram)))

    def solved(self, ridges: Sequence[float]) -> list[ScanKernel[LikenessT]]:
        """Return the function for each ridge."""
        weights = (cho_solve(cho_factor(self.normal(ridge)), self.moment) for ridge in ridges)
        return [ScanKernel(self.like, weight, self.mean) for weight in weights]


def directions(level: FloatArray, exponent: float = EXPONENT) -> FloatArray:
    """Scale each scan's powed levels (n, a) to length 1."""
    powed = level**exponent
    return np.asarray(powed / np.maximum(np.linalg.norm(powed, axis=1, keepdims=True), SMALLEST))


def levels(scans: RadioScans) -> FloatArray:
    """Make the (n, a) levels that all is learned from, 0 (not heard) to 1."""
    return represented(scans, Representation.POSITIVE)
