"""A landmark as its file has it."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class SurveyedLandmark:
    """One row of a landmark file; NaN where a value is unknown."""

    landmark: str
    floor: int
    x_m: float
    y_m: float
    z_m: float
    sigma_m: float
    heading_rad: float
    heading_sigma_rad: float
    source: str
    """File and 1-based line, ``floor_1/marker_dict.csv:3``."""
    sigma_given: bool = True
    """Whether the row has a sigma of its own."""
    planned: bool = False
    """Whether the position was only planned."""

    @property
    def line(self) -> int:
        """1-based line of the file."""
        return int(self.source.rpartition(":")[2])

    @property
    def is_surveyed(self) -> bool:
        """Whether there is a position."""
        return math.isfinite(self.x_m) and math.isfinite(self.y_m)

    def distance_m(self, other: SurveyedLandmark) -> float:
        """How far two landmarks of a floor are from one another; NaN without a position."""
        return math.hypot(self.x_m - other.x_m, self.y_m - other.y_m)
