"""From how far a model's own guesses lie apart to radii that hold what they promise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from vislam2tag.core.arrays import AnyArray, FloatArray
from vislam2tag.positioning.calibration import RadiusScale, radius_scale

UNKNOWN_M = 100.0
"""Base where no held-out error is known (one lone scan was learned from), metres: nothing is promised."""


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
        """Return the three numbers, for saving."""
        return np.array([self.base_m, self.scale.factor_68, self.scale.factor_95])

    @classmethod
    def restored(cls, arrays: Mapping[str, AnyArray], name: str) -> Self:
        """Take back what :meth:`array` gave."""
        base_m, factor_68, factor_95 = (float(number) for number in arrays[name])
        return cls(base_m, RadiusScale(factor_68, factor_95))


def fitted_radii(error_m: FloatArray, spread_m: FloatArray) -> SpreadRadii:
    """Fit to held-out errors (n,) in the plane, metres, and the spread (n,) of the guesses that made them."""
    known = np.isfinite(error_m)
    if not known.any():
        return SpreadRadii(UNKNOWN_M, RadiusScale(1.0, 2.0))
    base_m = float(np.median(error_m[known]))
    return SpreadRadii(base_m, radius_scale(error_m, np.hypot(base_m, spread_m)))
