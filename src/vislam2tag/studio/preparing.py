"""Preparation of a survey in the browser: messages, dropped files, and positions of landmarks from them."""

from __future__ import annotations

import io
import re
import secrets
import threading
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from vislam2tag.common.errors import UsageError
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.records import FiniteRecord
from vislam2tag.pipeline.site.floor_fit import floor_fit_notes
from vislam2tag.pipeline.site.init import NewFloor, add_floor, settled_source
from vislam2tag.preparation.registration.record import Registration
from vislam2tag.site.model import portable_name
from vislam2tag.site.plans.load import look_at_plan, plan_called, plan_extent, unplaced_picture
from vislam2tag.site.plans.source import PlanSource, Side
from vislam2tag.site.site_file import FloorPart, has_site_file, read_site_file
from vislam2tag.studio.messages import Box, Point, seen_as
from vislam2tag.studio.routing import Binary, endpoint
from vislam2tag.studio.workspace import Workspace

Name = Annotated[str, Field(min_length=1, max_length=300)]


class DroppedFile(FiniteRecord):
    """An uploaded file; later requests refer to its number."""

    id: int
    name: str


class PlanLookView(FiniteRecord):
    """Properties of a plan without scale; boxes are in its own coordinates."""

    name: str
    box: Box
    building: Box | None
    """For a sheet of paper: the box around the drawing inside its frame."""
    is_picture: bool
    """Whether a part of it can be used."""
    downwards: bool
    """Whether y points down in the file."""
    paper_m: float | None
    """Metres on paper per unit, if the file specifies it."""
    size_m: Point | None
    """Width and height by the scale that the file contains; None if it contains none."""
    levels: list[str]
    """Names of the file's levels, one of which is shown; empty if it has none."""


class FloorRequest(FiniteRecord):
    """A dropped plan that becomes a floor; ``whole``: the complete page, not only the building on it."""

    file: int
    part: FloorPart
    whole: bool = False


class AddedFloor(FiniteRecord):
    """The added floor, and decisions about its plan."""

    floor: int
    notes: list[str]


class FloorChange(FiniteRecord):
    """Other properties of a floor; None: as before."""

    floor: int
    number: int | None = None
    name: Annotated[str, Field(max_length=80)] | None = None
    elevation_m: float | None = None
    width_m: Side | None = None
    """Width of the area that its plan shows; the height follows from the plan's shape."""


class ChangedFloor(FiniteRecord):
    """Sentences about a floor that was changed or removed: where its files are, and what to check."""

    notes: list[str]


class PlanWish(FiniteRecord):
    """Requirements of a landmark plan for a floor; ``number``: the minimum, including fixed ones."""

    floor: int
    spacing_m: Annotated[float, Field(ge=2, le=1000)]
    rooms: bool
    sheets: Annotated[list[str], Field(min_length=1, max_length=6)]
    number: Annotated[int, Field(ge=0, le=500)] | None = None
    restart: bool = False
    """Whether planned landmarks that were not measured are dropped."""


class HeldLandmark(FiniteRecord):
    """A planned landmark at one of the plan's places."""

    id: Name
    place: Annotated[int, Field(ge=0)]


class PlanChange(FiniteRecord):
    """Changed landmarks of a plan: the landmark ``moved`` goes ``to`` a point; None adds a new one."""

    plan: int
    landmarks: Annotated[list[HeldLandmark], Field(max_length=1000)]
    moved: Name | None = None
    to: Point | None = None


class PlannedMark(HeldLandmark):
    """Its position and paper."""

    x: float
    y: float
    sheet: str


class PlannedView(FiniteRecord):
    """Planned landmarks, and the expected labels of walks past them and the ``fixed`` ones."""

    plan: int
    floor: int
    landmarks: list[PlannedMark]
    fixed: int
    fewest: int
    """New landmarks that meet all requirements."""
    expected_error_m: float | None
    longest_m: float | None
    """Longest way without a landmark; None if a requirement cannot be met."""
    extent_m: Box
    rows: int
    columns: int
    sigma_cm: list[int]
    """Sigma of labels per axis, row by row from the lower edge, centimetres; -1 outside walkable space."""
    notes: list[str]


class Written(FiniteRecord):
    """Number of written items, and their place."""

    count: int
    where: str


class SheetsWish(FiniteRecord):
    """Sheets for all landmarks, or those of ``ids`` (1-40,lobby), on this paper if the site specifies none."""

    paper: str = "A4"
    ids: str | None = None
    tag: bool = False


class SheetsView(FiniteRecord):
    """Created sheets."""

    folder: str
    pages: int
    notes: list[str]


class RegisterRequest(FiniteRecord):
    """Measurements on a floor, by numbers of dropped files; ``known``: landmarks of the site as known points."""

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
    """Result of a registration, and the written files of the survey."""

    found: Registration
    written: list[str]


class Stroke(FiniteRecord):
    """A line of a brush, or a polygon, along which a floor is ``walkable`` or not."""

    walkable: bool
    shape: Literal["brush", "polygon"]
    points: Annotated[list[Point], Field(min_length=2, max_length=5000)]
    width_m: Annotated[float, Field(gt=0, le=50)] = 0.2


class WallsRequest(FiniteRecord):
    """Strokes over existing corrections of a floor, or ``anew`` without them."""

    floor: int
    strokes: Annotated[list[Stroke], Field(max_length=1000)] = []
    anew: bool = False
    write: bool = False


class RoomsRequest(FiniteRecord):
    """Rooms of a floor that tours leave out; with ``at``, the room there is left out, or counts again."""

    floor: int
    at: Point | None = None


class ExcludedRoom(FiniteRecord):
    """A room that tours leave out: its name, and ``rings`` around it, none if no one can walk into it."""

    name: str
    rings: list[list[Point]]


class RoomsView(FiniteRecord):
    """Rooms of a floor that tours leave out."""

    floor: int
    excluded: list[ExcludedRoom]


class WallsView(FiniteRecord):
    """Walkable space of a floor: ``rings`` around it and its holes, the outer one first."""

    floor: int
    area_m2: float
    rings: list[list[Point]]
    corrected: bool
    """Whether there are saved corrections."""
    notes: list[str]


MOST_FILE = 200_000_000
"""Maximum bytes of a file."""
KEPT = 20
"""Maximum number of files; the oldest is removed."""
_FIRST_BELOW = 900_000_000
"""Maximum first number of files, because numbers in paths have up to nine digits."""
_SIDE_PX = 2400
_UNSAFE = re.compile(r"[^\w. ()+-]")


class DroppedFiles:
    """Files by number, each in its own folder under its original name; used by several threads."""

    def __init__(self) -> None:
        """Start without files."""
        self._held = ExitStack()
        self._scratch = self._held.enter_context(scratch_folder())
        self._lock = threading.Lock()
        self._files: dict[int, Path] = {}
        self._numbers = count(
            secrets.randbelow(_FIRST_BELOW)
        )  # drafts of a page must not refer to a file of a later run

    def close(self) -> None:
        """Remove all files."""
        self._held.close()

    def keep(self, name: str, content: bytes) -> DroppedFile:
        """Store a file; raises UsageError for an empty file or an invalid name."""
        plain = portable_name(_UNSAFE.sub("_", name.replace("\\", "/").rpartition("/")[2])[-100:])
        if not plain:
            raise UsageError(f"{name!r} is not a valid file name; rename the file")
        if not content:
            raise UsageError(f"{plain}: the file is empty; choose another file")
        with self._lock:
            number = next(self._numbers)
            self._scratch.write(f"{number}/{plain}", content)
            self._files[number] = self._scratch / f"{number}/{plain}"
            for old in list(self._files)[:-KEPT]:
                self._files.pop(old)
                self._scratch.remove_tree(str(old))
        return DroppedFile(id=number, name=plain)

    def path(self, number: int) -> Path:
        """The path of a file; raises KeyError if there is none."""
        if number not in self._files:
            raise KeyError("the file of this number")
        return self._files[number]


PlanPage: TypeAlias = Annotated[int, Field(ge=1)]


@endpoint("GET", "/api/prepare/files/{number:short}/look")
def look(
    workspace: Workspace, dropped: DroppedFiles, number: int, page: PlanPage = 1, level: str | None = None
) -> PlanLookView:
    """Properties of a plan without scale; raises SurveyError if it cannot be read."""
    path, source = dropped.path(number), PlanSource(file="plan", page=page, level=level)
    with plan_called(path.name):
        found = look_at_plan(path, source)
    return seen_as(PlanLookView, found, name=path.name, size_m=_size_m(path, source, workspace.root))


def _size_m(path: Path, source: PlanSource, root: Path) -> Point | None:
    part = read_site_file(root).georeference if has_site_file(root) else None
    try:
        left, right, low, high = plan_extent(path, source, None if part is None else part.georeference())
    except OSError:
        return None
    return right - left, high - low


@endpoint("GET", "/api/prepare/files/{number:short}/picture")
def picture(dropped: DroppedFiles, number: int, page: PlanPage = 1, level: str | None = None) -> Binary:
    """The plan between its box as PNG; raises SurveyError if it cannot be drawn."""
    path, source = dropped.path(number), PlanSource(file="plan", page=page, level=level)
    buffer = io.BytesIO()
    with plan_called(path.name):
        unplaced_picture(path, source, _SIDE_PX).save(buffer, "png")
    return Binary(buffer.getvalue(), "image/png")


@endpoint("POST", "/api/prepare/floors")
def add_dropped(workspace: Workspace, dropped: DroppedFiles, body: FloorRequest) -> AddedFloor:
    """Add a dropped plan as a floor, as ``vislam2tag site init`` does; raises its errors."""
    path = dropped.path(body.file)
    if body.part.plan is None:
        raise UsageError("specify how to read the plan")
    asked = body.part.plan.model_copy(update={"file": path.name})
    source, notes = settled_source(path, asked, whole=body.whole)
    add_floor(workspace.root, NewFloor(path, body.part.model_copy(update={"plan": source})))
    workspace.refresh()
    return AddedFloor(floor=body.part.number, notes=[*notes, *floor_fit_notes(workspace.root, body.part.number)])


@endpoint("POST", "/api/prepare/positions")
def registered(workspace: Workspace, dropped: DroppedFiles, body: RegisterRequest) -> RegistrationView:
    """Adjust the measurements, and write the result to the site if requested; raises errors of registering."""
    from vislam2tag.pipeline.site.register import FloorFiles, floor_of, register, write_into_site
    from vislam2tag.preparation.registration.names import NameRules

    site, floor = floor_of(workspace.root, body.floor)

    def path(number: int | None) -> Path | None:
        return None if number is None else dropped.path(number)

    sources = FloorFiles(
        stations=[dropped.path(number) for number in body.stations],
        control=path(body.control),
        known=body.known,
        tape=path(body.tape),
        targets=path(body.targets),
        clicks=path(body.clicks),
        rules=NameRules(landmarks=body.landmark_names),
        free_scale=body.free_scale,
    )
    found = register(site, floor, sources, workspace.settings.registration)
    written = write_into_site(workspace.root, floor, found, replace=body.replace) if body.write else []
    if body.write:
        workspace.refresh()
    return RegistrationView(found=found, written=[path.relative_to(workspace.root).as_posix() for path in written])
