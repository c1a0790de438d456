"""Least squares with what surveyors ask of it: redundancy, sigma0, tests of single measurements, gross errors.

Everything is whitened: a residual is in units of its own standard deviation. With A the design and e the residuals of
the estimate, ``N = I - A (A'A)^-1 A'`` gives the residuals of any other measurement as ``N f``. So the sum of squares
after any change D of the measurements is known without a new adjustment (Baarda 1968; Teunissen, Testing Theory).

Which measurement is wrong, and how (left out, interchanged with another, mistyped): every hypothesis is judged by the
sum of squares that it leaves, plus what it costs to believe. Leaving a measurement out lets it be anything within
:data:`RANGE_M` (Occam's factor), a certain other value is one of as many as could have been. Hypotheses that are as
good as the best cannot be distinguished, and all are reported.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr, solve_triangular
from scipy.stats import chi2, f

from vislam2tag.core.arrays import FloatArray, IntArray

PRIOR_FREEDOM = 10.0
"""How many redundant measurements the stated standard deviations are worth: the fewer there really are, the less
the adjustment's own sigma0 says against them."""
FALSE_ALARM = 0.01
"""Probability that a survey without a gross error has a measurement called wrong."""
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
    each: int = 1
    """How many rows one measurement has."""

    def rows(self, measurement: int) -> IntArray:
        """Rows (each,) of a measurement."""
        return np.arange(self.each * measurement, self.each * (measurement + 1))

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
        """What covariances are multiplied by: sigma0 squared, drawn to the stated 1, worth :data:`PRIOR_FREEDOM`."""
        return (PRIOR_FREEDOM + self.square) / (PRIOR_FREEDOM + max(self.redundancy, 0))

    @property
    def noise_level(self) -> NoiseLevel:
        """The variance factor and what it rests on."""
        return NoiseLevel(self.variance_factor, PRIOR_FREEDOM + max(self.redundancy, 0))

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


def adjust(design: FloatArray, residual: FloatArray, each: int = 1) -> tuple[FloatArray, Adjusted]:
    """Solve ``design @ step = residual`` (n, u), (n,), whitened, for the step (u,) that leaves least squares.

    Raises SingularError where the measurements do not determine all unknowns.
    """
    scale = np.linalg.norm(design, axis=0)
    if len(design) < design.shape[1] or not np.all(scale > 0):
        raise SingularError("fewer measurements than unknowns")
    orthogonal, triangular = qr(design / scale, mode="economic")
    pivots = np.abs(np.diag(triangular))
    if not pivots.min(initial=1.0) > SINGULAR * pivots.max(initial=1.0):
        raise SingularError("the measurements do not determine all unknowns")
    projected = orthogonal.T @ residual
    step = solve_triangular(triangular, projected) / scale
    root = solve_triangular(triangular, np.eye(len(scale))) / scale[:, None]
    left = residual - orthogonal @ projected
    return step, Adjusted(left, orthogonal, np.asarray(root @ root.T), each)


def suspicious(adjusted: Adjusted, noise: NoiseLevel) -> list[int]:
    """Measurements that the others contradict, the worst first.

    An F test by ``noise``, at a level that all together exceed with probability :data:`FALSE_ALARM`.
    """
    count = len(adjusted.residual) // adjusted.each
    found: list[tuple[float, int]] = []
    for index in range(count):
        reduction, checks = adjusted.reduction_without(adjusted.rows(index))
        if checks and reduction / checks / noise.factor > f.ppf(1 - FALSE_ALARM / count, checks, noise.freedom):
            found.append((reduction, index))
    return [index for _, index in sorted(found, key=lambda one: -one[0])]


RANGE_M = 10.0
"""A wrong measurement may be off by so much."""
LEAST_TYPED_M = 0.09
"""Exchanged digits that change less would fit any small error."""
AMBIGUOUS = 6.0
"""Hypotheses whose scores differ by less (likelihoods by less than twentyfold) cannot be distinguished."""


@dataclass(frozen=True)
class ValueChange:
    """Another value for one or two measurements: what they would have to have been."""

    text: str
    measurements: tuple[int, ...]
    by: FloatArray
    """(k,) whitened change of the misclosures at their rows."""
    choices: int
    """How many such changes there are: one of so many fits by chance."""


@dataclass(frozen=True)
class Explanation:
    """What may be wrong: the measurements concerned, and what is said of it."""

    measurements: tuple[int, ...]
    text: str
    """Empty: a measurement is off, nothing more is known."""
    score: float


def explanations(
    adjusted: Adjusted,
    sigma_m: FloatArray,
    noise: NoiseLevel,
    suspects: Sequence[int],
    changes: Sequence[ValueChange] = (),
) -> list[Explanation]:
    """The best explanation of why the suspects do not fit, then those that are as good, best first.

    ``sigma_m`` (measurements,) says how exact each is. Of several for the same measurements the best is kept.
    """
    found = [_left_out(adjusted, float(sigma_m[i]), i, noise) for i in suspects]
    for change in changes:
        rows = np.concatenate([adjusted.rows(i) for i in change.measurements])
        score = adjusted.changed_square(rows, change.by) / noise.factor + 2 * math.log(change.choices)
        found.append(Explanation(change.measurements, change.text, score))
    found.sort(key=lambda one: one.score)
    close: dict[tuple[int, ...], Explanation] = {}
    for one in found:
        if one.score < found[0].score + AMBIGUOUS:
            close.setdefault(one.measurements, one)
    return list(close.values())


def _left_out(adjusted: Adjusted, sigma_m: float, measurement: int, noise: NoiseLevel) -> Explanation:
    """The hypothesis that a measurement is off by anything."""
    reduction, checks = adjusted.reduction_without(adjusted.rows(measurement))
    usual_m = sigma_m * math.sqrt(2 * math.pi * noise.factor)
    cost = 2 * checks * math.log(max(RANGE_M / usual_m, math.e))
    return Explanation((measurement,), "", (adjusted.square - reduction) / noise.factor + cost)


def mistyped(value: float, decimals: int) -> list[tuple[float, str]]:
    """Values that become ``value`` by one slip of who types them, with what to say of each.

    Two neighbouring digits exchanged, the sign forgotten, the decimal mark one place off, one digit of the whole
    metres wrong (smaller digits would fit any small error).
    """
    text = f"0{abs(value):.{decimals}f}"  # 10.5 may have become 01.5
    sign = -1.0 if value < 0 else 1.0
    found = {-value: "sign", value * 10: "decimal mark", value / 10: "decimal mark"}
    digits = [i for i, char in enumerate(text) if char.isdigit()]
    for one, other in itertools.pairwise(digits):
        swapped = list(text)
        swapped[one], swapped[other] = swapped[other], swapped[one]
        found.setdefault(sign * float("".join(swapped)), "digits exchanged")
    for place in digits[1 : len(digits) - decimals]:
        for digit in "0123456789":
            found.setdefault(sign * float(text[:place] + digit + text[place + 1 :]), "one digit wrong")
    return [(other, what) for other, what in found.items() if abs(other - value) >= LEAST_TYPED_M]


def listed(names: Sequence[str]) -> str:
    """Name things in a sentence."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def whitened(change: Sequence[complex], sigma_m: Sequence[float]) -> FloatArray:
    """Changes of the misclosures (2k,) of points in the plane."""
    values = np.array(change, dtype=np.complex128) / np.array(sigma_m)
    return np.column_stack((values.real, values.imag)).ravel()
