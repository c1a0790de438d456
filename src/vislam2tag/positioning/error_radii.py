"""From how far a model's own guesses lie apart to radii that hold what they promise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from sklearn.linear_model import QuantileRegressor

from vislam2tag.core.arrays import AnyArray, FloatArray, IntArray
from vislam2tag.positioning.checked_arrays import CheckedArrays
from vislam2tag.positioning.scans.places import NINETY_FIVE, SIXTY_EIGHT

SMALLEST_SCALE_M = 0.1
"""No model is surer than this, metres."""
_WEIGHTS = (2.0, 1.0, 1.0)
"""Of kinds of held-out scans."""
UNKNOWN_M = 100.0
"""Base where no held-out error is known (one lone scan was learned from), metres: nothing is promised."""


@dataclass(frozen=True)
class RadiusScale:
    """By how much a model's scale must be stretched for circles to hold 68 % and 95 % of its errors."""

    factor_68: float
    factor_95: float

    def radii_m(self, scale_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the 68 % and 95 % radii (n,) of scans with these scales (n,), metres."""
        scale_m = np.maximum(scale_m, SMALLEST_SCALE_M)
        return self.factor_68 * scale_m, self.factor_95 * scale_m


def radius_scale(error_m: FloatArray, scale_m: FloatArray) -> RadiusScale:
    """Fit the factors to held-out errors (n,) in the plane and the scales (n,) that the model stated for them.

    Raises ValueError without any finite error.
    """
    ratio = np.sort(error_m / np.maximum(scale_m, SMALLEST_SCALE_M))
    ratio = ratio[np.isfinite(ratio)]
    if not len(ratio):
        raise ValueError("no held-out error to calibrate with")
    return RadiusScale(conformal_quantile(ratio, SIXTY_EIGHT), conformal_quantile(ratio, NINETY_FIVE))


def conformal_quantile(ascending: FloatArray, share: float) -> float:
    """Return what a further value is below with this probability, by values (n,); the greatest if these are few."""
    rank = int(np.ceil((len(ascending) + 1) * share))
    return float(ascending[min(rank, len(ascending)) - 1])


@dataclass(frozen=True)
class SpreadRadii:
    """Circles that grow with the spread of guesses, but not from nothing: guesses can agree and be wrong."""

    base_m: float
    """Median of the held-out errors; scale of the error where guesses do not spread."""
    scale: RadiusScale

    def radii_m(self, spread_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the 68 % and 95 % radii (n,) of scans whose guesses spread this far, metres."""
        return self.scale.radii_m(np.hypot(self.base_m, spread_m))

    def array(self) -> FloatArray:
        """Return the three numbers (3,), for saving."""
        return np.array([self.base_m, self.scale.factor_68, self.scale.factor_95])

    @classmethod
    def restored(cls, arrays: CheckedArrays, name: str) -> Self:
        """Take back what :meth:`array` gave; raises ValueError where it does not fit."""
        base_m, factor_68, factor_95 = (float(number) for number in arrays.floats(name, 3, least=0.0))
        return cls(base_m, RadiusScale(factor_68, factor_95))


def fitted_radii(error_m: FloatArray, spread_m: FloatArray) -> SpreadRadii:
    """Fit to held-out errors (n,) in the plane, metres, and the spread (n,) of the guesses that made them."""
    known = np.isfinite(error_m)
    if not known.any():
        return SpreadRadii(UNKNOWN_M, RadiusScale(1.0, 2.0))
    base_m = float(np.median(error_m[known]))
    return SpreadRadii(base_m, radius_scale(error_m, np.hypot(base_m, spread_m)))


@dataclass(frozen=True)
class HeldOut:
    """What a model said of ``n`` scans that it did not learn from."""

    error_m: FloatArray
    """(n,) in the plane."""
    features: FloatArray
    """(n, f) what the error may follow."""
    group: IntArray
    """(n,) walk: errors of one are not independent."""


@dataclass(frozen=True)
class QuantileRadii:
    """Circles whose radius is the exponential of a linear function of features (Koenker and Bassett 1978).

    They are made to hold their share by conformal prediction (Romano et al. 2019), in which each walk counts the same
    (Dunn et al. 2023).
    """

    coefficients: FloatArray
    """(2, 1 + f) of the 68 % and the 95 % radius, metres."""
    bounds: FloatArray
    """(2, f) least and greatest features that were seen; beyond, these count."""

    def radii_m(self, features: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the 68 % and 95 % radii (n,), metres, of scans with these features (n, f)."""
        within = np.clip(features, *self.bounds)
        log_68, log_95 = self.coefficients[:, :1] + self.coefficients[:, 1:] @ within.T
        return np.exp(log_68), np.exp(np.maximum(log_68, log_95))

    def arrays(self) -> dict[str, AnyArray]:
        """Return all numbers, for saving."""
        return {"radius_coefficients": self.coefficients, "radius_bounds": self.bounds}

    @classmethod
    def restored(cls, arrays: CheckedArrays) -> Self:
        """Take back what :meth:`arrays` gave; raises ValueError where it does not fit."""
        bounds = arrays.floats("radius_bounds", 2, "features")
        return cls(arrays.floats("radius_coefficients", 2, 1 + bounds.shape[1]), bounds)


def fitted_quantile_radii(kinds: Sequence[HeldOut]) -> QuantileRadii:
    """Fit to kinds of held-out scans, such as of walks that were left out and of scans left out alone.

    Features tell the kinds apart where they can; where they cannot, the first counts twice.
    """
    features = np.concatenate([kind.features for kind in kinds])
    if not len(features):
        flat = np.zeros((2, features.shape[1]))
        return QuantileRadii(np.column_stack([np.log([UNKNOWN_M, 2 * UNKNOWN_M]), flat]), flat)
    error_m = np.concatenate([kind.error_m for kind in kinds])
    weight = np.concatenate([np.full(len(kind.error_m), 1 / len(kind.error_m)) for kind in kinds])
    log_error = np.log(np.maximum(error_m, SMALLEST_SCALE_M))
    coefficients = []
    for share in (SIXTY_EIGHT, NINETY_FIVE):
        line = QuantileRegressor(quantile=share, alpha=0.0).fit(features, log_error, sample_weight=weight * len(weight))
        exceeded = [_exceeded(kind, line, share) for kind in kinds]
        coefficients.append([line.intercept_ + np.average(exceeded, weights=_WEIGHTS[: len(kinds)]), *line.coef_])
    return QuantileRadii(np.array(coefficients), np.stack([features.min(axis=0), features.max(axis=0)]))


def _exceeded(kind: HeldOut, line: QuantileRegressor, share: float) -> float:
    """Return by how much log errors exceed the line at most with this probability."""
    over = np.log(np.maximum(kind.error_m, SMALLEST_SCALE_M)) - line.predict(kind.features)
    return group_quantile(over, kind.group, share)


def group_quantile(values: FloatArray, group: IntArray, share: float) -> float:
    """Return what a value of a further group is below with this probability, by values (n,) of groups (n,).

    Each group counts the same (Dunn et al. 2023); the greatest value if they are few.
    """
    _, number, count = np.unique(group, return_inverse=True, return_counts=True)
    order = np.argsort(values)
    below = np.cumsum(1 / count[number[order]]) / (len(count) + 1)
    return float(values[order][min(int(np.searchsorted(below, share)), len(values) - 1)])
