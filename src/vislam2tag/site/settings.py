"""What is taken for granted of landmarks, and where a survey has its settings."""

from __future__ import annotations

from pydantic import Field

from vislam2tag.common.records import FiniteRecord

SETTINGS_FILE = "vislam2tag.toml"
"""In a survey's folder: settings of the commands that read it."""


class SurveySettings(FiniteRecord):
    """What is taken for granted of landmarks."""

    landmark_sigma_m: float = Field(default=0.02, gt=0)
    """Standard deviation per axis of a surveyed landmark whose file gives none, metres: a total station's, with a sheet
    hung by hand."""
    use_planned: bool = False
    """Use positions of landmarks that are planned and not yet measured, with a sigma of 0.1 m."""
