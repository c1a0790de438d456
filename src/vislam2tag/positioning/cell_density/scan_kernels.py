"""Kernels between scans, which compare the directions of their vectors of levels, and regressions with them.

The direction of a scan's vector does not change if a phone hears everything fainter by a factor. Strong levels show the
place on a storey (:class:`DirectionKernel`). Faint ones also show the storey. The kernel for storeys therefore combines
the direction of powed levels with one of steps: whether an access point is heard, and whether it exceeds each quartile
of all levels (:class:`StoreyKernel`).

The regression is a ridge regression. If there are too many scans to solve for, a random part of them spans the solution
(Williams and Seeger 2001).

It also finds scans with a storey that all others contradict. People who tap on a plan forget to change the floor, and
phones report scans that are one flight of stairs old. A few such labels distort their surroundings. They are detected
by predicting each scan's storey from the others (leave-one-out residuals of a ridge regression have a closed form:
Allen 1974).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, Protocol, Self, TypeVar

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray, IntArray
from vislam2tag.core.robust import StoppingRule, iterate
from vislam2tag.positioning.radio_scans import CheckedArrays, RadioScans, Representation, represented

EXPONENT = 1.7
"""Exponent applied to levels before normalisation, from cross-validation (docs/explanation/positioning.md)."""
LEAST_LENGTH = 1e-9
"""Smallest length of a vector in normalisation."""
_QUARTILES = (0.25, 0.5, 0.75)


class ScanKernel(Protocol):
    """A positive definite kernel between any scans and ``m`` scans, the centres."""

    def __call__(self, level: FloatArray) -> FloatArray:
        """Compare scans of levels (n, a) from 0 to 1 with the centres: (n, m)."""

    def among_centres(self) -> FloatArray:
        """Compare the centres among themselves: (m, m)."""


@dataclass(frozen=True)
class DirectionKernel:
    """The Gaussian of the distance between the directions of powed levels, from 0 to 1."""

    centre: FloatArray
    """(m, a) directions."""
    sharpness: float

    def __call__(self, level: FloatArray) -> FloatArray:
        """Compare scans of levels (n, a) from 0 to 1 with the centres: (n, m)."""
        return self._of(directions(level))

    def among_centres(self) -> FloatArray:
        """Compare the centres among themselves: (m, m)."""
        return self._of(self.centre)

    def _of(self, direction: FloatArray) -> FloatArray:
        return np.asarray(np.exp(2 * self.sharpness * (direction @ self.centre.T - 1)))


@dataclass(frozen=True)
class StoreyKernel:
    """The sum of two Gaussians of distances between directions: of powed levels and of steps."""

    centre: FloatArray
    """(m, a) directions of powed levels."""
    threshold: FloatArray
    """(q,) thresholds of the steps, levels from 0 to 1; the first is 0: heard at all."""
    above: BoolArray
    """(m, a q) the centres' steps."""

    @classmethod
    def around(cls, level: FloatArray) -> Self:
        """Make the kernel around scans of levels (m, a) from 0 to 1."""
        heard = level[level > 0]
        threshold = np.array([0.0, *(np.quantile(heard, _QUARTILES) if len(heard) else ())])
        return cls(directions(level), threshold, _above(level, threshold))

    def __call__(self, level: FloatArray) -> FloatArray:
        """Compare scans of levels (n, a) from 0 to 1 with the centres: (n, m) from 0 to 2."""
        return self._of(directions(level), _unit_steps(_above(level, self.threshold)))

    def among_centres(self) -> FloatArray:
        """Compare the centres among themselves: (m, m)."""
        return self._of(self.centre, self.steps)

    @cached_property
    def steps(self) -> FloatArray:
        """(m, a q) the centres' steps, scaled to length 1."""
        return _unit_steps(self.above)

    def _of(self, direction: FloatArray, step: FloatArray) -> FloatArray:
        cosines = direction @ self.centre.T, step @ self.steps.T
        return np.asarray(sum(np.exp(2 * (cosine - 1)) for cosine in cosines))

    def arrays(self) -> dict[str, AnyArray]:
        """Return thresholds and steps, for saving; the directions are those of other kernels, too."""
        return {"storey_threshold": self.threshold, "storey_above": self.above}

    @classmethod
    def restored(cls, centre: FloatArray, arrays: CheckedArrays) -> Self:
        """Restore from the result of :meth:`arrays`, with the centres' directions (m, a).

        Raises ValueError if it does not fit.
        """
        threshold = arrays.floats("storey_threshold", "q")
        return cls(centre, threshold, arrays.booleans("storey_above", "m", centre.shape[1] * len(threshold)))


def directions(level: FloatArray, exponent: float = EXPONENT) -> FloatArray:
    """Scale each scan's powed levels (n, a) to length 1."""
    powed = level**exponent
    return np.asarray(powed / np.maximum(np.linalg.norm(powed, axis=1, keepdims=True), LEAST_LENGTH))


def levels(scans: RadioScans) -> FloatArray:
    """Make the (n, a) levels for learning, 0 (not heard) to 1."""
    return represented(scans, Representation.POSITIVE)


def _above(level: FloatArray, threshold: FloatArray) -> BoolArray:
    """(n, a q) which of the thresholds (q,) the levels (n, a) exceed."""
    return np.asarray((level[:, :, None] > threshold).reshape(len(level), level.shape[1] * len(threshold)))


def _unit_steps(above: BoolArray) -> FloatArray:
    """Scale steps (n, a q) to length 1."""
    return np.asarray(above / np.maximum(np.sqrt(above.sum(axis=1, keepdims=True)), LEAST_LENGTH))


STOREY_RIDGE = 0.1
"""Ridge of regressions onto storeys, from cross-validation on Tampere's training set, where storeys are hardest."""
_JITTER = 1e-6
"""Added to the diagonal, so that equal scans among the centres leave the equations solvable."""
_AT_ONCE = 2048
LevelsAndTargets = tuple[FloatArray, FloatArray]
"""Levels (n, a) from 0 to 1, and their targets (n, t)."""
KernelT = TypeVar("KernelT", bound=ScanKernel)


@dataclass(frozen=True)
class KernelRegression(Generic[KernelT]):
    """A function from levels (n, a) to ``t`` numbers, spanned by the kernels around ``m`` scans."""

    kernel: KernelT
    weight: FloatArray
    """(m, t)"""
    mean: FloatArray
    """(t,) answer far from all training scans."""

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
        """Start without examples; ``mean`` (t,) is the function's value far from all."""
        return cls(kernel, mean, np.zeros((centres, centres)), np.zeros((centres, len(mean))))

    def add(self, examples: Iterable[LevelsAndTargets]) -> Self:
        """Add examples, part after part."""
        for level, target in examples:
            for rows in (slice(at, at + _AT_ONCE) for at in range(0, len(level), _AT_ONCE)):
                similarity = self.kernel(level[rows])
                self.gram += similarity.T @ similarity
                self.moment += similarity.T @ (target[rows] - self.mean)
        return self

    def normal(self, ridge: float) -> FloatArray:
        """Return the matrix (m, m) of the equations with this ridge."""
        return np.asarray(self.gram + ridge * self.kernel.among_centres() + _JITTER * np.eye(len(self.gram)))

    def solved(self, ridges: Sequence[float]) -> list[KernelRegression[KernelT]]:
        """Return the function for each ridge."""
        weights = (cho_solve(cho_factor(self.normal(ridge)), self.moment) for ridge in ridges)
        return [KernelRegression(self.kernel, weight, self.mean) for weight in weights]


LEAD = 0.5
"""Margin by which another storey's probability must exceed that of the labelled one."""
MOST_OF_STOREY = 0.1
"""Largest share of a storey's scans that is removed; with more, the storey is probably just hard to predict."""
_MOST_ROUNDS = 3
"""Largest number of rounds; removed scans no longer contradict others, so all are tested again."""
_LEAST = 1e-3
"""Lower limit of storey probabilities, and of the remaining weight of a scan."""
_DOUBTED_AT_ONCE = 1024


def mislabelled(scans: RadioScans, storey: IntArray, centres: IntArray) -> BoolArray:
    """Return which of the scans (n,), labelled with these storeys (n,), are contradicted by the others.

    The kernels' centres are the scans ``centres`` (m,), by index.
    """
    one_hot = np.eye(int(storey.max()) + 1)[storey]

    def step(doubted: BoolArray, _round: int) -> BoolArray:
        predicted = _leave_one_out(scans, one_hot, ~doubted, centres)
        return _most_contradicted((predicted - one_hot).max(axis=1) - (predicted * one_hot).sum(axis=1), storey)

    undoubted = np.zeros(len(scans), dtype=np.bool_)
    return iterate(
        "the search for scans that others contradict",
        undoubted,
        step,
        _changed,
        StoppingRule(tolerance=1, most_rounds=_MOST_ROUNDS),
    ).state


def _changed(before: BoolArray, after: BoolArray) -> int:
    """Return the number of scans (n,) with a changed result."""
    return int((before != after).sum())


def _leave_one_out(scans: RadioScans, one_hot: FloatArray, believed: BoolArray, centres: IntArray) -> FloatArray:
    """Predict storey probabilities (n, s) of each scan from the other ``believed`` (n,) ones and labels (n, s)."""
    mean = one_hot[believed].mean(axis=0)
    equations = KernelNormalEquations.empty(StoreyKernel.around(levels(scans[centres])), mean, len(centres))
    equations.add((levels(scans[rows]), one_hot[rows]) for rows in _blocks(np.flatnonzero(believed)))
    factor = cho_factor(equations.normal(STOREY_RIDGE))
    weight = cho_solve(factor, equations.moment)
    score = np.empty_like(one_hot)
    for rows in _blocks(np.arange(len(scans))):
        similarity = equations.kernel(levels(scans[rows]))
        own_share = believed[rows] * (similarity * cho_solve(factor, similarity.T).T).sum(axis=1)
        by_others = similarity @ weight - own_share[:, None] * (one_hot[rows] - mean)
        score[rows] = by_others / np.maximum(1 - own_share, _LEAST)[:, None] + mean
    score = np.maximum(score, _LEAST)
    return np.asarray(score / score.sum(axis=1, keepdims=True))


def _most_contradicted(lead: FloatArray, storey: IntArray) -> BoolArray:
    """Return which leads (n,) are large, for each storey at most its share, the largest first."""
    chosen = np.zeros(len(lead), dtype=np.bool_)
    for number in np.unique(storey):
        rows = np.flatnonzero(storey == number)
        most = rows[np.argsort(-lead[rows], kind="stable")][: int(MOST_OF_STOREY * len(rows))]
        chosen[most] = lead[most] > LEAD
    return chosen


def _blocks(rows: IntArray) -> Iterator[IntArray]:
    """Cut rows (n,) into blocks."""
    return (rows[start : start + _DOUBTED_AT_ONCE] for start in range(0, len(rows), _DOUBTED_AT_ONCE))
