"""What heights and floors assume of phones and buildings."""

from __future__ import annotations

from typing import Self

from pydantic import Field, model_validator

from vislam2tag.common.records import FiniteRecord


class HeightSettings(FiniteRecord):
    """How height and floor of each frame are found (docs/explanation/heights.md)."""

    carried_m: float = Field(default=1.4, gt=0)
    """Usual height of the phone above the floor, and of a landmark whose height nobody measured, metres: in the hand of
    somebody who looks at it."""
    carried_range_m: tuple[float, float] = (0.9, 1.9)
    """Lowest and highest that a walk may carry the phone above the floor, metres."""
    surveyed_sigma_m: float = Field(default=0.05, gt=0)
    """Standard deviation of a landmark's surveyed height, metres: a tape from the floor."""
    storey_m: float = Field(default=3.5, gt=0)
    """Height of a storey where elevations are unknown, metres: tells floors apart, never heights."""

    @model_validator(mode="after")
    def _range_in_order(self) -> Self:
        if not self.carried_range_m[0] <= self.carried_m <= self.carried_range_m[1]:
            raise ValueError("carried_m must lie within carried_range_m")
        return self
