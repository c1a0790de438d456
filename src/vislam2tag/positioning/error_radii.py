"""From how far a model's own guesses lie apart to radii that hold what they promise."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.checked_arrays import CheckedArrays
from vislam2tag.positioning.scans.places import NINETY_FIVE, SIXTY_EIGHT

SMALLEST_SCALE_M = 0.1
"""No model is surer than this, metres."""
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
