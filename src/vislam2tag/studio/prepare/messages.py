"""What page and server say to each other about preparing a survey, as JSON; metres unless a name says else."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from vislam2tag.common.records import FiniteRecord
from vislam2tag.preparation.registration.record import Registration
from vislam2tag.site.site_file import FloorPart
from vislam2tag.studio.messages import Box, Point

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
    levels: list[str]
    """Names of the file's levels, of which one is looked at; empty where it has none."""


class FloorRequest(FiniteRecord):
    """A dropped plan that becomes a floor; ``whole``: all of its page, not only the building on it."""

    file: int
    part: FloorPart
    whole: bool = False


class AddedFloor(FiniteRecord):
    """The floor that was added, and what was decided about its plan."""

    floor: int
    notes: list[str]


class PlanWish(FiniteRecord):
    """What a plan of a floor's landmarks is to be like; ``number``: so many at least, fixed ones among them."""

    floor: int
    spacing_m: Annotated[float, Field(ge=2, le=1000)]
    rooms: bool
    sheets: Annotated[list[str], Field(min_length=1, max_length=6)]
    number: Annotated[int, Field(ge=0, le=500)] | None = None


class HeldLandmark(FiniteRecord):
    """A planned landmark at one of the plan's places."""

    id: Name
    place: Annotated[int, Field(ge=0)]


class PlanChange(FiniteRecord):
    """Other landmarks of a plan: these, of which the one called ``moved`` goes ``to`` a point; a new one, if none."""

    plan: int
    landmarks: Annotated[list[HeldLandmark], Field(max_length=1000)]
    moved: Name | None = None
    to: Point | None = None


class PlannedMark(HeldLandmark):
    """Where it hangs, and on what paper."""

    x: float
    y: float
    sheet: str


class PlannedView(FiniteRecord):
    """Planned landmarks, and what labels are to be expected of walks past them and the ``fixed`` ones."""

    plan: int
    floor: int
    landmarks: list[PlannedMark]
    fixed: int
    fewest: int
    """New ones that meet all demands."""
    expected_error_m: float | None
    longest_m: float | None
    """Longest walk without a landmark; None where some demand cannot be met."""
    extent_m: Box
    rows: int
    columns: int
    sigma_cm: list[int]
    """Sigma per axis of labels, row by row from the lower edge, centimetres; -1 where nobody walks."""
    notes: list[str]


class Written(FiniteRecord):
    """How much was written, and where."""

    count: int
    where: str


class SheetsWish(FiniteRecord):
    """Sheets for all landmarks, or those of ``ids`` (1-40,lobby), on this paper where the site names none."""

    paper: str = "A4"
    ids: str | None = None
    tag: bool = False


class SheetsView(FiniteRecord):
    """Sheets that were made."""

    folder: str
    pages: int
    notes: list[str]


class RegisterRequest(FiniteRecord):
    """What is measured on a floor, by numbers of dropped files; ``known``: landmarks of the site that are known."""

    floor: int
    stations: Annotated[list[int], Field(max_length=20)] = []
    control: int | None = None
    tape: int | None = None
    targets: int | None = None
    clicks: int | None = None
    known: Annotated[list[Name], Field(max_length=1000)] = []
    landmark_names: Name = "*"
    free_scale: bool = False
    write: bool = False
    replace: bool = False


class RegistrationView(FiniteRecord):
    """What registering found, and the files of the survey that it wrote."""

    found: Registration
    written: list[str]


class Stroke(FiniteRecord):
    """A line of a brush, or a polygon, along which a floor is ``walkable`` or not."""

    walkable: bool
    shape: Literal["brush", "polygon"]
    points: Annotated[list[Point], Field(min_length=2, max_length=5000)]
    width_m: Annotated[float, Field(gt=0, le=50)] = 0.2


class WallsRequest(FiniteRecord):
    """Strokes over what is corrected of a floor already, or ``anew``."""

    floor: int
    strokes: Annotated[list[Stroke], Field(max_length=1000)] = []
    anew: bool = False
    write: bool = False


class WallsView(FiniteRecord):
    """Where a floor can be walked: ``rings`` about the space and its holes, the outer one first."""

    floor: int
    area_m2: float
    rings: list[list[Point]]
    corrected: bool
    """Whether there are corrections that were kept before."""
    notes: list[str]
