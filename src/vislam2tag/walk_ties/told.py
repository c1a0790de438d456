"""What a walk is told of where it was, rounded."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import PlaceTies

ROUNDED_M, ROUNDED_SIGMA_M = 0.01, 0.05
"""Places are rounded to this, and their covariance to the square of this; no direction is known better."""


def rounded(ties: PlaceTies) -> PlaceTies:
    """The same in numbers that change only where others tell something new."""
    return PlaceTies(
        ties.time_ns,
        ROUNDED_M * np.round(ties.position_bcs / ROUNDED_M),
        rounded_covariance(ties.covariance_m2, np.full(len(ties.covariance_m2), ROUNDED_SIGMA_M)),
    )


def rounded_covariance(covariance: FloatArray, unit: FloatArray) -> FloatArray:
    """Round a covariance (n, n) to squares and products of units (n,); positive definite again.

    Rounded entry by entry alone, what hardly varies in one direction could vary by less than nothing.
    """
    squared = np.outer(unit, unit)
    rounded = np.round(covariance / squared)
    values, vectors = np.linalg.eigh(rounded)
    if values.size and values[0] < 1:
        rounded = (vectors * np.maximum(values, 1.0)) @ vectors.T
        rounded = (rounded + rounded.T) / 2
    return np.asarray(squared * rounded)
