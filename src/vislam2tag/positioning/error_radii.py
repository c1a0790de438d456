"""Calibrated radii from the spread of a model's own guesses.

Circles follow the errors on scans left out in several ways: alone, with their walk, or with their place. It is unknown
which of these ways a new scan resembles, and radii for one way do not suit another. The scans of a walk show it
together. Whether their walk was learned is the same for all of them, so their evidence is added up, with less weight
for many scans, because they are not independent (design effect; Kish 1965).

The shares of the other ways are estimated like the shares of classes in data with other shares than in training
(Saerens et al. 2002). In each way the errors follow features by quantile regression (Koenker and Bassett 1978), which
conformal prediction calibrates (Romano et al. 2019); each left-out walk has the same weight (Dunn et al. 2023). The
radius is the quantile of their mixture.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.special import expit, logsumexp
from sklearn.linear_model import LogisticRegression, QuantileRegressor

from vislam2tag.core.arrays import AnyArray, BoolArray, FloatArray, IntArray
from vislam2tag.positioning.places import NINETY_FIVE, SIXTY_EIGHT
from vislam2tag.positioning.radio_scans import CheckedArrays, TextArray

SMALLEST_SCALE_M = 0.1
"""Smallest scale of an error, metres."""
UNKNOWN_M = 100.0
"""Base without any held-out error (a single training scan), metres."""


def conformal_quantile(ascending: FloatArray, share: float) -> float:
    """Return an upper bound of a further value with this probability, from values (n,); the greatest if they are
    few."""
    rank = int(np.ceil((len(ascending) + 1) * share))
    return float(ascending[min(rank, len(ascending)) - 1])


@dataclass(frozen=True)
class SpreadRadii:
    """Circles that grow with the spread of guesses, but not from zero, because guesses can agree and be wrong."""

    base_m: float
    """Median of the held-out errors; scale of the error if guesses do not spread."""
    factor_68: float
    """Factor on the scale for circles that contain 68 % of the errors."""
    factor_95: float

    def radii_m(self, spread_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the 68 % and 95 % radii (n,) of scans whose guesses spread this far, metres."""
        scale_m = np.maximum(np.hypot(self.base_m, spread_m), SMALLEST_SCALE_M)
        return self.factor_68 * scale_m, self.factor_95 * scale_m

    def array(self) -> FloatArray:
        """Return the three numbers (3,), for saving."""
        return np.array([self.base_m, self.factor_68, self.factor_95])

    @classmethod
    def restored(cls, arrays: CheckedArrays, name: str) -> Self:
        """Restore from the result of :meth:`array`; raises ValueError if it does not fit."""
        return cls(*map(float, arrays.floats(name, 3, least=0.0)))


def fitted_radii(error_m: FloatArray, spread_m: FloatArray) -> SpreadRadii:
    """Fit to held-out errors (n,) in the plane, metres, and the spread (n,) of the guesses behind them."""
    known = np.isfinite(error_m)
    if not (known & np.isfinite(spread_m)).any():
        return SpreadRadii(UNKNOWN_M, 1.0, 2.0)
    base_m = float(np.median(error_m[known]))
    ratio = error_m / np.maximum(np.hypot(base_m, spread_m), SMALLEST_SCALE_M)
    ratio = np.sort(ratio[np.isfinite(ratio)])
    return SpreadRadii(base_m, conformal_quantile(ratio, SIXTY_EIGHT), conformal_quantile(ratio, NINETY_FIVE))


SHARES = (SIXTY_EIGHT, NINETY_FIVE)
LEVELS = np.append(np.arange(1, 100) / 100, 0.995)
"""(l,) probabilities of the saved quantiles."""
PRIOR_SCANS = 5.0
"""Weight of the prior of equal ways, in scans of a walk."""
CORRELATED = 0.5
"""Correlation of the evidence of two scans of a walk on whether it was learned; 0.2 does as well
(docs/results/how-good.md)."""
LIKE = 0.99
"""A scan is unlike the training set if its nearest learned scan is farther than for this share of left-out scans."""
_ROUNDS, _HALVINGS = 30, 12
_LEAST_SPREAD = 1e-3
"""Features with a smaller spread carry no information about the way."""
_LINE_WITH = 500
"""Largest number of scans in a quantile regression; the coverage of circles does not depend on it."""


@dataclass(frozen=True)
class HeldOut:
    """Answers to ``n`` scans that were not in the training set."""

    error_m: FloatArray
    """(n,) in the plane."""
    features: FloatArray
    """(n, f) features that the error may depend on."""
    group: IntArray
    """(n,) walk; errors within a walk are not independent."""
    learned: bool
    """Whether other scans of the same walk were learned."""


@dataclass(frozen=True)
class HeldOutRadii:
    """Models of the errors in ``w`` ways of leaving out."""

    likeness: FloatArray
    """(w, 1 + f) logarithm of the likelihood of features in a way, up to a common term: linear in features."""
    line: FloatArray
    """(2, w, 1 + f) logarithms of the 68 % and 95 % radius, metres: linear in features."""
    beyond: FloatArray
    """(2, w, l) quantiles of the logarithms of errors relative to these lines, at ``LEVELS``."""
    bounds: FloatArray
    """(2, f) smallest and largest training features; values beyond are clipped."""
    learned: BoolArray
    """(w,) whether other scans of the same walk were learned."""

    def radii_m(self, features: FloatArray, walk: TextArray) -> tuple[FloatArray, FloatArray]:
        """Return the 68 % and 95 % radii (n,), metres, of scans with these features (n, f) and walks (n,).

        A scan with an empty walk is treated alone.
        """
        within = np.clip(features, *self.bounds)
        share = self.shares(within, walk)
        smaller, larger = (
            _mixture_quantile(share, line[:, :1] + line[:, 1:] @ within.T, beyond, wanted)
            for line, beyond, wanted in zip(self.line, self.beyond, SHARES, strict=True)
        )
        return np.exp(smaller), np.exp(np.maximum(smaller, larger))

    def shares(self, features: FloatArray, walk: TextArray) -> FloatArray:
        """(n, w) probability of each way for scans with features (n, f) and walks (n,)."""
        log_likely = self.likeness[:, 0] + features @ self.likeness[:, 1:].T
        number = _walk_numbers(walk)
        if self.learned.all() or not self.learned.any():
            return _shares_of_walks(log_likely, number)
        share = np.empty_like(log_likely)
        evidence = _mean_likely(log_likely[:, self.learned]) - _mean_likely(log_likely[:, ~self.learned])
        of_walk = np.bincount(number, evidence) / (1 + (np.bincount(number) - 1) * CORRELATED)
        for kind, sign in ((self.learned, 1), (~self.learned, -1)):
            chance = expit(sign * of_walk)[number]
            share[:, kind] = chance[:, None] * _shares_of_walks(log_likely[:, kind], number)
        return share

    def arrays(self) -> dict[str, AnyArray]:
        """Return all numbers, for saving."""
        return {f"radius_{name}": getattr(self, name) for name in ("likeness", "line", "beyond", "bounds", "learned")}

    @classmethod
    def restored(cls, arrays: CheckedArrays) -> Self:
        """Restore from the result of :meth:`arrays`; raises ValueError if it does not fit."""
        bounds = arrays.floats("radius_bounds", 2, "features")
        columns = 1 + bounds.shape[1]
        likeness = arrays.floats("radius_likeness", "ways", columns)
        line = arrays.floats("radius_line", 2, "ways", columns)
        beyond = arrays.floats("radius_beyond", 2, "ways", len(LEVELS))
        return cls(likeness, line, beyond, bounds, arrays.booleans("radius_learned", "ways"))


def held_out_radii(ways: Sequence[HeldOut]) -> HeldOutRadii:
    """Fit to scans left out in one or several ways, the same scans in each."""
    features = np.concatenate([way.features for way in ways])
    if not len(features):
        flat = np.zeros(features.shape[1])
        line = np.array([[[np.log(UNKNOWN_M), *flat]], [[np.log(2 * UNKNOWN_M), *flat]]])
        beyond, unlearned = np.zeros((2, 1, len(LEVELS))), np.zeros(1, np.bool_)
        return HeldOutRadii(np.zeros((1, len(flat) + 1)), line, beyond, np.stack([flat, flat]), unlearned)
    fitted = [[_line(way, share) for way in ways] for share in SHARES]
    return HeldOutRadii(
        likeness=_likeness(ways),
        line=np.array([[line for line, _ in of_share] for of_share in fitted]),
        beyond=np.array([[beyond for _, beyond in of_share] for of_share in fitted]),
        bounds=np.stack([features.min(axis=0), features.max(axis=0)]),
        learned=np.array([way.learned for way in ways]),
    )


def group_quantiles(values: FloatArray, group: IntArray, shares: FloatArray) -> FloatArray:
    """Return upper bounds of a value of a further group with these probabilities (s,), from values (n,) of groups (n,).

    Each group has the same weight (Dunn et al. 2023). A guaranteed bound would add one more group; with 24 walks 95 %
    circles would then contain 99 % (``tests/positioning/test_error_radii.py``).
    """
    _, number, count = np.unique(group, return_inverse=True, return_counts=True)
    order = np.argsort(values)
    below = np.cumsum(1 / count[number[order]]) / len(count)
    return np.asarray(values[order][np.minimum(np.searchsorted(below, shares), len(values) - 1)])


def like_limit(nearest: FloatArray, group: IntArray) -> float:
    """Return the largest distance to the nearest learned scan for scans that resemble the training set.

    ``nearest`` (n,) are these distances, in any measure, of left-out scans of groups (n,); 0 without any.
    """
    return float(group_quantiles(nearest, group, np.array(LIKE))) if len(nearest) else 0.0


def _walk_numbers(walk: TextArray) -> IntArray:
    """(n,) a number for each walk (n,), and for each scan with an empty walk."""
    number = np.unique(walk, return_inverse=True)[1].reshape(-1)
    alone = np.flatnonzero(walk == "")
    number[alone] = len(walk) + np.arange(len(alone))
    return np.asarray(np.unique(number, return_inverse=True)[1].reshape(-1))


def _mean_likely(log_likely: FloatArray) -> FloatArray:
    """(n,) logarithm of the mean of likelihoods, from their logarithms (n, w)."""
    return np.asarray(logsumexp(log_likely, axis=1) - np.log(log_likely.shape[1]))


def _shares_of_walks(log_likely: FloatArray, number: IntArray) -> FloatArray:
    """(n, w) probability of each way, from logarithms of likelihoods (n, w), for scans of walks (n,)."""
    likely = np.exp(log_likely - log_likely.max(axis=1, keepdims=True, initial=-np.inf))
    count, ways = np.bincount(number)[:, None], log_likely.shape[1]
    of_walk = np.full((len(count), ways), 1 / ways)
    share = likely
    for _ in range(_ROUNDS):
        weight = likely * of_walk[number]
        share = weight / weight.sum(axis=1, keepdims=True)
        total = np.stack([np.bincount(number, one, minlength=len(count)) for one in share.T], axis=1)
        of_walk = (total + PRIOR_SCANS / ways) / (count + PRIOR_SCANS)
    return np.asarray(share)


def _line(way: HeldOut, share: float) -> tuple[FloatArray, FloatArray]:
    """Regress (1 + f,), and return the quantiles of errors relative to the line (l,)."""
    log_error = np.log(np.maximum(way.error_m, SMALLEST_SCALE_M))
    some = slice(None, None, -(-len(log_error) // _LINE_WITH))
    line = QuantileRegressor(quantile=share, alpha=0.0).fit(way.features[some], log_error[some])
    beyond = group_quantiles(log_error - line.predict(way.features), way.group, LEVELS)
    return np.array([line.intercept_, *line.coef_]), beyond


def _likeness(ways: Sequence[HeldOut]) -> FloatArray:
    """(w, 1 + f) logistic regression of the way on features, with equal prior frequencies."""
    features = np.concatenate([way.features for way in ways])
    if len(ways) == 1:
        return np.zeros((1, features.shape[1] + 1))
    mean, deviation = features.mean(axis=0), np.maximum(features.std(axis=0), _LEAST_SPREAD)
    which = np.repeat(np.arange(len(ways)), [len(way.error_m) for way in ways])
    found = LogisticRegression(class_weight="balanced", max_iter=500).fit((features - mean) / deviation, which)
    slope, level = found.coef_ / deviation, found.intercept_
    if len(ways) == 2:  # scikit-learn gives the second against the first
        slope, level = np.vstack([np.zeros_like(slope), slope]), np.append(0.0, level)
    return np.column_stack([level - slope @ mean, slope])


def _mixture_quantile(share: FloatArray, line: FloatArray, beyond: FloatArray, wanted: float) -> FloatArray:
    """(n,) the ``wanted`` quantile of the logarithms of errors: shares (n, w), lines (w, n), beyond (w, l).

    It is between the smallest and the largest quantile of the ways, and is found by bisection.
    """
    own = line + np.array([np.interp(wanted, LEVELS, one) for one in beyond])[:, None]
    least, greatest = own.min(axis=0), own.max(axis=0)
    for _ in range(_HALVINGS):
        middle = (least + greatest) / 2
        below = [np.interp(middle - at, one, LEVELS, left=0.0, right=1.0) for at, one in zip(line, beyond, strict=True)]
        too_small = (share.T * below).sum(axis=0) < wanted
        least, greatest = np.where(too_small, middle, least), np.where(too_small, greatest, middle)
    return np.asarray(greatest)
