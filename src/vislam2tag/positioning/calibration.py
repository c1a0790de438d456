"""Radii that hold what they promise: a model's own scale of its errors, stretched by errors it made on held-out scans.

Split conformal prediction (Lei et al. 2018, "Distribution-free predictive inference for regression"), normalised by
the model's scale.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.places import NINETY_FIVE, SIXTY_EIGHT

SMALLEST_SCALE_M = 0.1
"""No model is surer than this, metres."""


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
    """Return what a further value falls below with this probability; the greatest value where there are too few."""
    rank = int(np.ceil((len(ascending) + 1) * share))
    return float(ascending[min(rank, len(ascending)) - 1])
