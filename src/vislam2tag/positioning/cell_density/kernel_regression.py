"""Ridge regression with kernels between scans.

Where there are more scans than can be solved for, a drawn part of them spans the solution (Williams and Seeger 2001).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, Self, TypeVar

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.cell_density.scan_kernels import ScanKernel

STOREY_RIDGE = 0.1
"""Of regressions onto storeys; by cross-validation on Tampere's training part, where storeys are hardest."""
_JITTER = 1e-6
"""Added to the equations' diagonal, so that equal scans among the centres leave them solvable."""
_AT_ONCE = 2048
LevelsAndTargets = tuple[FloatArray, FloatArray]
"""Levels (n, a) from 0 to 1, and what to answer for them (n, t)."""
KernelT = TypeVar("KernelT", bound=ScanKernel)


@dataclass(frozen=True)
class KernelRegression(Generic[KernelT]):
    """A function from levels (n, a) to ``t`` numbers, spanned by the kernels around ``m`` scans."""

    kernel: KernelT
    weight: FloatArray
    """(m, t)"""
    mean: FloatArray
    """(t,) what is answered far from all that was learned."""

    def __call__(self, level: FloatArray) -> FloatArray:
        """Evaluate at levels (n, a) from 0 to 1: (n, t)."""
        return np.asarray(self.kernel(level) @ self.weight + self.mean)


@dataclass
class KernelNormalEquations(Generic[KernelT]):
    """Least squares over any number of examples, for kernels around given scans; examples are added block by block."""

    kernel: KernelT
    mean: FloatArray
    """(t,)"""
    gram: FloatArray
    """(m, m)"""
    moment: FloatArray
    """(m, t)"""

    @classmethod
    def empty(cls, kernel: KernelT, mean: FloatArray, centres: int) -> Self:
        """Start with no example; ``mean`` (t,) is what the function answers far from all."""
        return cls(kernel, mean, np.zeros((centres, centres)), np.zeros((centres, len(mean))))

    def add(self, examples: Iterable[LevelsAndTargets]) -> Self:
        """Count in examples, part after part."""
        for level, target in examples:
            for rows in (slice(at, at + _AT_ONCE) for at in range(0, len(level), _AT_ONCE)):
                similarity = self.kernel(level[rows])
                self.gram += similarity.T @ similarity
                self.moment += similarity.T @ (target[rows] - self.mean)
        return self

    def normal(self, ridge: float) -> FloatArray:
        """Return the matrix (m, m) of the equations, smoothed by this much."""
        return np.asarray(self.gram + ridge * self.kernel.among_centres() + _JITTER * np.eye(len(self.gram)))

    def solved(self, ridges: Sequence[float]) -> list[KernelRegression[KernelT]]:
        """Return the function for each ridge."""
        weights = (cho_solve(cho_factor(self.normal(ridge)), self.moment) for ridge in ridges)
        return [KernelRegression(self.kernel, weight, self.mean) for weight in weights]
