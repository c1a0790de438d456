"""How readings are labelled, and all settings that labels follow from."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Self, TypedDict

from pydantic import Field, ValidationError, field_serializer

from vislam2tag.common.errors import UsageError
from vislam2tag.common.records import FiniteRecord
from vislam2tag.estimation.settings import WITHOUT_TRACKER, MappingSettings
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.site.settings import SurveySettings

if TYPE_CHECKING:
    from vislam2tag.estimation.strategy import Factory, MappingStrategy


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
    """No interpolation between frames further apart than this, seconds."""
    max_sigma_m: float = Field(default=0.5, gt=0, allow_inf_nan=True)
    """Frames and readings whose sigma (one standard deviation per axis) is greater are ``uncertain``, metres.

    Infinite: none is.
    """

    max_sigma_without_poses_m: float = Field(default=2.0, gt=0, allow_inf_nan=True)
    """Limit of sigma for sessions without poses, whose positions are less certain, metres."""

    def for_session(self, *, without_poses: bool) -> LabelSettings:
        """The settings with the limit of sigma for a session."""
        return self.model_copy(update={"max_sigma_m": self.max_sigma_without_poses_m}) if without_poses else self

    @field_serializer("max_sigma_m", "max_sigma_without_poses_m", when_used="json")
    def _as_json(self, value: float) -> float | str:
        """JSON has no infinity; as an option, ``inf`` is read back."""
        return value if math.isfinite(value) else "inf"


class TruthSettings(FiniteRecord):
    """How exactly true positions are known that labels are compared with, if they do not contain it themselves."""

    press_sigma_s: float = Field(default=0.35, ge=0)
    """Standard deviation of the time of a press at a control point, seconds. The distance walked in this time is the
    error of the truth.
    """
    press_sigma_m: float = Field(default=0.26, ge=0)
    """Standard deviation per axis of the phone's distance from the control point at a press, metres."""
    station_sigma_m: float = Field(default=0.02, ge=0)
    """Standard deviation per axis of a total station's track, metres, without the errors of its clock and prism."""
    file_sigma_m: float = Field(default=0.0, ge=0)
    """Standard deviation per axis of a truth file without ``sigma_m``, metres. The truth of the simulator is exact: 0.
    """


USUAL_TRUTH = TruthSettings()


class GivenSettings(TypedDict, total=False):
    """Settings as keyword arguments, with the names and defaults of :class:`ProcessSettings`.

    ``strategy`` is a name, ``NAME.py:CLASS``, or a class, a function or an object of your own
    (:class:`~vislam2tag.api.MappingStrategy`).
    """

    strategy: str | Factory | MappingStrategy
    together: bool
    survey: SurveySettings
    findings: FindingSettings
    mapping: MappingSettings
    labels: LabelSettings
    truth: TruthSettings


class ProcessSettings(FiniteRecord):
    """The settings that labels follow from: those of ``process`` and of all that maps sessions as it does."""

    strategy: str = "smoother"
    """Name of the mapping strategy, or NAME.py:CLASS for one of your own."""
    together: bool = False
    """Map the walks of a floor together: they share landmark priors, radio constraints and the noise of their device.
    """
    survey: SurveySettings = SurveySettings()
    findings: FindingSettings = FindingSettings()
    mapping: MappingSettings = MappingSettings()
    labels: LabelSettings = LabelSettings()
    truth: TruthSettings = USUAL_TRUTH

    def with_given(self, given: GivenSettings) -> Self:
        """A copy with the settings given by keyword; raises UsageError for a wrong value or an unknown name."""
        if not given:
            return self
        from vislam2tag.estimation.strategy import strategy_known_as

        own = {name: getattr(self, name) for name in type(self).model_fields}
        chosen = {"strategy": strategy_known_as(given["strategy"])} if "strategy" in given else {}
        try:
            return type(self).model_validate({**own, **given, **chosen})
        except ValidationError as error:
            problem = error.errors()[0]
            name = ".".join(map(str, problem["loc"]))
            raise UsageError(
                f"{name}: {problem['msg']}; settings by keyword are: {', '.join(ProcessSettings.model_fields)}"
            ) from error

    @property
    def inertial(self) -> bool:
        """Whether the strategy maps walks by their inertial sensors alone."""
        return self.strategy == WITHOUT_TRACKER

    def of_labels(self) -> dict[str, Any]:
        """Settings as JSON, without those of a derived class: kept with results."""
        return self.model_dump(mode="json", include=set(ProcessSettings.model_fields))
