"""All settings in one tree; each part is defined beside what it is for."""

from __future__ import annotations

from vislam2tag.common.records import FiniteRecord
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.survey.settings import SurveySettings


class Settings(FiniteRecord):
    """The resolved settings of a run."""

    strategy: str = "smoother"
    """Name of the mapping strategy."""
    survey: SurveySettings = SurveySettings()
    findings: FindingSettings = FindingSettings()
    mapping: MappingSettings = MappingSettings()
    labels: LabelSettings = LabelSettings()
