"""Settings of the mapping strategies."""

from __future__ import annotations

from pydantic import Field

from vislam2tag.common.records import FiniteRecord
from vislam2tag.estimation.dead_reckoning.settings import DeadReckoningSettings
from vislam2tag.estimation.settings import SmootherSettings
from vislam2tag.heights.settings import HeightSettings

WITHOUT_TRACKER = "dead-reckoning"
"""The strategy of sessions without poses, which the smoother hands them to; it maps no others."""


class MappingSettings(FiniteRecord):
    """How sessions are mapped; a strategy takes what it needs of it."""

    visit_radius_m: float = Field(default=1.0, gt=0)
    """A landmark is visited where the camera comes within this distance in space, metres (paper, section V-B)."""
    max_step_m: float = Field(default=5.0, gt=0)
    """``local-corrected`` discards a segment with a longer step between neighbouring mapped frames, metres."""
    smoother: SmootherSettings = SmootherSettings()
    dead_reckoning: DeadReckoningSettings = DeadReckoningSettings()
    heights: HeightSettings = HeightSettings()
