"""Least squares with what surveyors ask of it: redundancy, sigma0, tests of single measurements.

Everything is whitened: a residual is in units of its own standard deviation. With A the design and e the residuals of
the estimate, ``N = I - A (A'A)^-1 A'`` gives the residuals of any other measurement as ``N f``; so the sum of squares
after any change D of the measurements is known without a new adjustment (Baarda 1968; Teunissen, Testing Theory).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr, solve_triangular
from scipy.stats import chi2, f

from vislam2tag.core.arrays import FloatArray, IntArray

SINGULAR = 1e-9
"""Least pivot, relative to the greatest, of unknowns that are determined."""
TESTABLE = 1e-6
"""Least redundancy of a measurement that others check at all."""


class SingularError(ValueError):
    """The measurements do not determine the unknowns."""


@dataclass(frozen=True)
class Adjusted:
    """An adjustment of ``n`` measurements with ``u`` unknowns, linearised at its solution."""

    residual: FloatArray
    """(n,) whitened."""
    orthogonal: FloatArray
    """(n, u) Q of the whitened design."""
    cofactor: FloatArray
    """(u, u) covariance of the unknowns where the standard deviations are as stated."""
    prior_freedom: float

    @property
    def redundancy(self) -> int:
        """Measurements beyond the necessary ones."""
        return len(self.residual) - int(self.orthogonal.shape[1])

    @property
    def square(self) -> float:
        """Sum of squared residuals."""
        return float(self.residual @ self.residual)

    @property
    def sigma0(self) -> float | None:
        """The residuals in terms of what was stated of the measurements, 1 on average; None without redundancy."""
        return float(np.sqrt(self.square / self.redundancy)) if self.redundancy > 0 else None

    @property
    def plausible(self) -> bool:
        """Whether the residuals are as small as stated (global test, one in a thousand)."""
        return self.redundancy <= 0 or self.square <= float(chi2.ppf(0.999, self.redundancy))

    @property
    def variance_factor(self) -> float:
        """What covariances are multiplied by: sigma0 squared, drawn to 1 the more the fewer redundant measurements."""
        return variance_factor(self.square, self.redundancy, self.prior_freedom)

    @property
    def noise_level(self) -> NoiseLevel:
        """The variance factor and what it rests on."""
        return NoiseLevel(self.variance_factor, self.prior_freedom + max(self.redundancy, 0))

    def kernel(self, rows: IntArray) -> FloatArray:
        """The block (k, k) of N at these rows: how much of each measurement is checked by others."""
        part = self.orthogonal[rows]
        return np.asarray(np.eye(len(rows)) - part @ part.T)

    def changed_square(self, rows: IntArray, change: FloatArray) -> float:
        """The sum of squares if these measurements' misclosures were changed by ``change`` (k,), whitened."""
        return self.square + float(2 * self.residual[rows] @ change + change @ self.kernel(rows) @ change)

    def reduction_without(self, rows: IntArray) -> tuple[float, int]:
        """By how much the sum of squares falls without the rows (k,), and how many checks go with them."""
        values, vectors = np.linalg.eigh(self.kernel(rows))
        kept = values > TESTABLE
        along = vectors.T[kept] @ self.residual[rows]
        return float(np.sum(along**2 / values[kept])), int(kept.sum())


@dataclass(frozen=True)
class NoiseLevel:
    """What the good measurements' variance is, in terms of the stated one, and how many they are."""

    factor: float
    freedom: float


def variance_factor(square: float, redundancy: int, prior_freedom: float) -> float:
    """Mean of the stated variance (1, worth ``prior_freedom`` measurements) and that of the residuals."""
    return (prior_freedom + square) / (prior_freedom + max(redundancy, 0))


def adjust(design: FloatArray, residual: FloatArray, prior_freedom: float) -> tuple[FloatArray, Adjusted]:
    """Solve ``design @ step = residual`` (n, u), (n,), whitened, for the step (u,) that leaves least squares.

    Raises SingularError where the measurements do not determine all unknowns.
    """
    scale = np.linalg.norm(design, axis=0)
    if len(design) < design.shape[1] or not np.all(scale > 0):
        raise SingularError("fewer measurements than unknowns")
    orthogonal, triangular = qr(design / scale, mode="economic")
    pivots = np.abs(np.diag(triangular))
    if not pivots.min(initial=1.0) > SINGULAR * pivots.max(initial=1.0):
        raise SingularError("the measurements leave something undetermined")
    projected = orthogonal.T @ residual
    step = solve_triangular(triangular, projected) / scale
    root = solve_triangular(triangular, np.eye(len(scale))) / scale[:, None]
    left = residual - orthogonal @ projected
    return step, Adjusted(left, orthogonal, np.asarray(root @ root.T), prior_freedom)


def suspicious(
    adjusted: Adjusted, groups: Sequence[IntArray], noise: NoiseLevel, false_alarm: float
) -> list[tuple[int, float]]:
    """Groups of rows, (k,) each (one measurement), that the others contradict, the worst first: index and reduction.

    An F test by ``noise``, at a level that all groups together exceed with probability ``false_alarm``.
    """
    found: list[tuple[int, float]] = []
    for index, rows in enumerate(groups):
        reduction, checks = adjusted.reduction_without(rows)
        if not checks:
            continue
        limit = float(f.ppf(1 - false_alarm / len(groups), checks, noise.freedom))
        if reduction / checks / noise.factor > limit:
            found.append((index, reduction))
    return sorted(found, key=lambda one: -one[1])
