"""How good a session's labels are, without any truth: what is stated of them, scaled by how true that proved.

The smoother states a covariance for every frame, from which the mean error to expect follows. Whether this is too large
or too small the left-out landmarks tell (:mod:`vislam2tag.quality.self_check.left_out`): their errors are scaled by
what is stated of *them*, doubled gaps included. The same factor is applied to the labels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ellipe

from vislam2tag.core.arrays import FloatArray
from vislam2tag.quality.self_check.left_out import LeftOut

PRIOR_LANDMARKS = 3.0
"""What the smoother states counts as much as this many landmarks whose errors are just as stated."""
GREATEST_SHARE = 4.0
"""A left-out error counts at most as this many times the stated variance: a mis-surveyed landmark spoils the prediction
of itself, not the labels."""
FACTOR_SIGMA = 0.25
"""Labels and left-out landmarks need not exceed what is stated by the same factor: one sigma of its logarithm."""
LENGTH_VARIANCE = 4 / np.pi - 1
"""Variance of the length of a Gaussian error in units of its squared mean."""
NORMAL_90 = 1.645
"""Standard deviations on both sides that hold 90 % of a Gaussian."""
FEWEST = 3
"""With fewer left-out errors than this an estimate says hardly more than what the smoother states."""


@dataclass(frozen=True)
class Estimate:
    """Mean error of a session's labels, metres: ``stated_m`` by the smoother, ``estimated_m`` after the check.

    The true mean error lies between ``low_m`` and ``high_m`` in about nine of ten sessions. ``checked`` is the number
    of left-out landmarks that speak for it; without any the estimate is what is stated, with a wide interval.
    """

    stated_m: float
    estimated_m: float
    low_m: float
    high_m: float
    checked: int

    @property
    def well_founded(self) -> bool:
        """Whether enough landmarks could be left out to say more than the smoother states."""
        return self.checked >= FEWEST

    def rounded(self) -> dict[str, float | bool]:
        """The numbers under their names in the record of a session."""
        lengths = {name: round(getattr(self, name), 4) for name in ("stated_m", "estimated_m", "low_m", "high_m")}
        return {**lengths, "well_founded": self.well_founded}


def estimate_accuracy(covariance_m2: FloatArray, left_out: Sequence[LeftOut]) -> Estimate | None:
    """Estimate the mean error of labels with covariances (n, 2, 2); None where there are none."""
    if len(covariance_m2) == 0:
        return None
    stated_m = float(expected_error_m(covariance_m2).mean())
    estimated_m = stated_m * error_factor(left_out)
    spread = float(np.exp(NORMAL_90 * _sigma_of_logarithm(len(left_out))))
    return Estimate(stated_m, estimated_m, estimated_m / spread, estimated_m * spread, len(left_out))


def error_factor(left_out: Sequence[LeftOut]) -> float:
    """By what factor errors exceed what is stated: root of a mean square, pulled to 1 where landmarks are few.

    ``squared_sigmas / 2`` has mean 1 where what is stated is true. Capped at :data:`GREATEST_SHARE`, its mean is still
    0.98 for Gaussian errors, and one bad landmark among ten adds at most an eighth to the factor.
    """
    return float(np.sqrt(excess(np.array([error.squared_sigmas for error in left_out]))))


def excess(squared_sigmas: FloatArray) -> float:
    """By what factor variances exceed what is stated, from squared Mahalanobis distances (k,), k may be 0."""
    shares = np.minimum(squared_sigmas / 2, GREATEST_SHARE)
    return float((PRIOR_LANDMARKS + shares.sum()) / (PRIOR_LANDMARKS + len(shares)))


def expected_error_m(covariance_m2: FloatArray) -> FloatArray:
    """Mean length (n,) of errors drawn from N(0, P), for covariances P (n, 2, 2): an elliptic integral."""
    half = np.trace(covariance_m2, axis1=1, axis2=2) / 2
    apart = np.hypot((covariance_m2[:, 0, 0] - covariance_m2[:, 1, 1]) / 2, covariance_m2[:, 0, 1])
    greatest = np.maximum(half + apart, 0.0)
    eccentricity = np.clip(2 * apart / np.where(greatest > 0, greatest, 1.0), 0.0, 1.0)
    return np.asarray(np.sqrt(2 * greatest / np.pi) * ellipe(eccentricity))


def _sigma_of_logarithm(checked: int) -> float:
    """Standard deviation of the logarithm of the estimate over the true mean error.

    The factor's own (mean of so many exponential shares, root), that of a mean over as many independent stretches as
    there are gaps between landmarks, and what labels and landmarks need not have in common.
    """
    factor = 1 / (4 * (PRIOR_LANDMARKS + checked))
    stretches = LENGTH_VARIANCE / (1 + checked)
    return float(np.sqrt(factor + stretches + FACTOR_SIGMA**2))
