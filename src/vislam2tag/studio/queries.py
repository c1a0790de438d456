"""What stands behind the question mark of the studio's addresses."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, field_validator

from vislam2tag.common.records import FiniteRecord
from vislam2tag.studio import survey_view, tracks
from vislam2tag.studio.outputs import LABELS
from vislam2tag.studio.radio.messages import RadioLayer

Text = Annotated[str, Field(max_length=300)]


class NoQuery(FiniteRecord):
    """An endpoint without parameters."""


class OfOutput(FiniteRecord):
    """Of which labels."""

    output: Text = LABELS


class WindowQuery(OfOutput):
    """Part of a floor, metres in its BCS; ``sessions``: indices with commas, absent: all; ``points`` at most."""

    floor: int
    left: float
    right: float
    low: float
    high: float
    sessions: list[int] | None = None
    points: Annotated[int, Field(ge=1000, le=tracks.WINDOW_POINTS)] = tracks.WINDOW_POINTS

    @field_validator("sessions", mode="before")
    @classmethod
    def _split(cls, value: object) -> object:
        return [part for part in value.split(",") if part] if isinstance(value, str) else value


class SeriesQuery(OfOutput):
    """A span of a walk, seconds after its first frame, and how many points of each series may come."""

    points: Annotated[int, Field(ge=2, le=100_000)] = 2000
    start: float = Field(default=-1e9, alias="from")
    end: float = Field(default=1e9, alias="to")


class PlanQuery(FiniteRecord):
    """Longer side of the picture, pixels; ``stamp`` is the plan's, for the browser to keep it."""

    side: Annotated[int, Field(ge=64, le=survey_view.MOST_PIXELS)] = 2048
    stamp: Text = ""


class CompareQuery(FiniteRecord):
    """Names of two outputs."""

    a: Text
    b: Text


class RadioQuery(FiniteRecord):
    """A layer of the radio maps of a floor; ``bssid`` where it is of one access point."""

    floor: int
    technology: Text
    layer: RadioLayer
    bssid: Text = ""


class FloorQuery(FiniteRecord):
    """A floor by its number."""

    floor: int
