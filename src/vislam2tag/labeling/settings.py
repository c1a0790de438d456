"""How readings are labelled."""

from __future__ import annotations

import math
from enum import StrEnum

from pydantic import Field, field_serializer

from vislam2tag.common.records import FiniteRecord


class LabelRule(StrEnum):
    """How a reading between two frames gets its position."""

    INTERPOLATE = "interpolate"
    """Linear interpolation between the two neighbouring frames."""
    NEXT_FRAME = "next-frame"
    """The paper's rule: the first frame whose time is not before the reading's."""


class LabelSettings(FiniteRecord):
    """How time-stamped readings are labelled."""

    rule: LabelRule = LabelRule.INTERPOLATE
    """How a reading gets its position: interpolate between its two frames, or take the next-frame (the paper)."""
    max_gap_s: float = Field(default=1.0, gt=0)
    """No interpolation between frames farther apart than this, seconds."""
    max_sigma_m: float = Field(default=0.5, gt=0, allow_inf_nan=True)
    """Frames and readings whose sigma (one standard deviation per axis) is greater are ``uncertain``, metres.

    Infinite: none is.
    """

    @field_serializer("max_sigma_m", when_used="json")
    def _as_json(self, value: float) -> float | str:
        """JSON has no infinity; as an option, ``inf`` is read back."""
        return value if math.isfinite(value) else "inf"
