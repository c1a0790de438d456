"""Each fix against all the others: how far off the path would be there without it, and which fixes are in doubt."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.similarity import as_points
from vislam2tag.estimation.dead_reckoning.equations import fix_errors
from vislam2tag.estimation.dead_reckoning.walk import ReckonedWalk

DOUBTFUL = 3.7
"""Standard deviations (per axis) beyond which one fix in a thousand lies by chance."""
LEAST_FREEDOM = 0.02
"""Where all but this of a fix's place is its own doing, the others say nothing of it."""


@dataclass(frozen=True)
class LeftOut:
    """Fixes (f,) left out one at a time, by the linear model about the path.

    ``error_m`` (f, 2) from the fix to where the others put the walker, metres in the BCS; ``sigma_m`` (f,) per axis,
    what that is expected to be; NaN at fixes of which the others say nothing.
    """

    error_m: FloatArray
    sigma_m: FloatArray

    @classmethod
    def of(cls, walk: ReckonedWalk) -> LeftOut:
        """Leave out each fix of a walk in turn, without solving again."""
        sigma, node = walk.path.fix_sigma_m, walk.ties.node
        error, weight = fix_errors(walk.path.state, replace(walk.ties, sigma_m=sigma))
        variance = np.trace(walk.path.covariance[node, :2, :2], axis1=1, axis2=2) / 2
        own = variance * weight
        freedom = np.where(own < 1 - LEAST_FREEDOM, 1 - own, np.nan)
        without = as_points(error) / freedom[:, None]
        return cls(without, np.sqrt(walk.fix_scatter_m**2 + variance / freedom))

    @property
    def doubtful(self) -> BoolArray:
        """Mask (f,) of the fixes that contradict the others."""
        return np.asarray(np.linalg.norm(self.error_m, axis=1) > DOUBTFUL * self.sigma_m)
