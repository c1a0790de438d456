"""How a reference, the survey of a landmark or what walks saw of it, fits what all others say of that landmark."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.landmark_survey.other_walks import GREATEST_SIGMA_M

USUAL_SIGMAS, SIGHT_SIGMAS = 4.0, 4.5
"""A survey or a day, or a walk's sight, contradicts the others where they put it so many standard deviations away. Of
20 surveys and 80 sights by normal errors 2 % would have one beyond 3.7 and 4.1; real ones have heavier tails ..."""
LEAST_M = 0.15
"""... and at least this far."""


class Verdict(Enum):
    """What the others say of a reference."""

    AGREES = "agrees"
    CONTRADICTS = "contradicts"
    NOTHING = "nothing to compare"


@dataclass(frozen=True)
class Comparison:
    """A reference against all others: the survey of a landmark, or what one walk, or all walks of a day, saw of it.

    Of a survey ``walk`` and ``day`` are None. ``offset`` from where the others have it, complex metres in the BCS;
    ``sigma_m``, the usual size of that (one standard deviation per axis), and ``sigmas``, how many it is: NaN where
    nothing can be compared.
    """

    landmark: int
    walk: int | None
    offset: complex = complex(np.nan, np.nan)
    sigma_m: float = np.nan
    sigmas: float = np.nan
    day: str | None = None

    @property
    def of_survey(self) -> bool:
        """Whether it is a surveyed place."""
        return self.walk is None and self.day is None

    @property
    def size_m(self) -> float:
        """How far it is from where the others have it."""
        return abs(self.offset)

    @property
    def excess(self) -> float:
        """How many standard deviations it is off, over how many are asked for."""
        return self.sigmas / (USUAL_SIGMAS if self.walk is None else SIGHT_SIGMAS)

    @property
    def verdict(self) -> Verdict:
        """Whether it fits the others."""
        if not self.sigma_m <= GREATEST_SIGMA_M:
            return Verdict.NOTHING
        return Verdict.CONTRADICTS if self.excess > 1 and self.size_m > LEAST_M else Verdict.AGREES

    @classmethod
    def of(cls, landmark: int, walk: int | None, offset: FloatArray, covariance: FloatArray) -> Comparison:
        """Compare by an offset (2,), metres, and its covariance (2, 2)."""
        sigmas = max(float(offset @ np.linalg.solve(covariance, offset)), 0.0) ** 0.5
        sigma_m = float(np.sqrt(np.trace(covariance) / 2))
        return cls(landmark, walk, complex(*offset), sigma_m, sigmas)

    def in_units_of(self, scale: float) -> Comparison:
        """The same where offsets are usually so many times as stated."""
        return replace(self, sigma_m=self.sigma_m * scale, sigmas=self.sigmas / scale)
