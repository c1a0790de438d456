"""Sheets whose left and right edge were shot: heading, and the centre where nobody shot that."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.registration.network import PlaneFit

LEAST_WIDTH_M = 0.05
"""Edges nearer than this give no direction."""


@dataclass(frozen=True)
class Sheet:
    """Where a landmark's sheet hangs: centre, its covariance (2, 2), m^2, and direction of its X axis where known."""

    place: complex
    covariance: FloatArray
    heading_rad: float | None = None
    heading_sigma_rad: float | None = None


def sheet_of(fit: PlaneFit, landmark: str) -> Sheet | None:
    """Take a landmark from the shots of its centre, or of its two edges; None where neither is there.

    The X axis points to the right for who looks at the sheet, from the left edge (shot as ``ID_L``) to the right one.
    """
    left, right = f"{landmark}_L", f"{landmark}_R"
    both = left in fit.places and right in fit.places
    heading, sigma = _heading(fit, left, right) if both else (None, None)
    if landmark in fit.places:
        return Sheet(fit.places[landmark], fit.covariance(landmark), heading, sigma)
    if not both:
        return None
    half = np.hstack((np.eye(2), np.eye(2))) / 2
    covariance = half @ fit.covariance(left, right) @ half.T
    return Sheet((fit.places[left] + fit.places[right]) / 2, covariance, heading, sigma)


def _heading(fit: PlaneFit, left: str, right: str) -> tuple[float | None, float | None]:
    across = fit.places[right] - fit.places[left]
    if abs(across) < LEAST_WIDTH_M:
        return None, None
    square = np.array((-across.imag, across.real)) / abs(across) ** 2
    change = np.concatenate((-square, square))
    sigma = math.sqrt(float(change @ fit.covariance(left, right) @ change))
    return math.atan2(across.imag, across.real), sigma
