"""What page and server say to each other about preparing a survey, as JSON; metres unless a name says else."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from vislam2tag.common.records import FiniteRecord
from vislam2tag.studio.messages import Box
from vislam2tag.survey.site_file import FloorPart

Name = Annotated[str, Field(min_length=1, max_length=300)]


class FileQuery(FiniteRecord):
    """The name of a file that is brought."""

    name: Name


class DroppedFile(FiniteRecord):
    """A file that was brought; later requests name it by its number."""

    id: int
    name: str


class LookQuery(FiniteRecord):
    """Which part of a plan's file is looked at."""

    page: Annotated[int, Field(ge=1)] = 1
    level: str | None = None


class PlanLookView(FiniteRecord):
    """What a plan shows before it has a scale; boxes in its own coordinates."""

    name: str
    box: Box
    building: Box | None
    """Of a sheet of paper: the box around what is drawn in its frame."""
    is_picture: bool
    """Whether a part of it can be taken."""
    downwards: bool
    """Whether the file counts y downwards."""
    paper_m: float | None
    """Metres on paper a unit, where the file tells."""
    has_scale: bool
    """Whether the file itself tells how large it is."""


class FloorRequest(FiniteRecord):
    """A dropped plan that becomes a floor; ``whole``: all of its page, not only the building on it."""

    file: int
    part: FloorPart
    whole: bool = False


class AddedFloor(FiniteRecord):
    """The floor that was added, and what was decided about its plan."""

    floor: int
    notes: list[str]
