"""Preparing a survey in the browser: its messages, files dropped on the page, and positions of landmarks from them."""

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
from vislam2tag.pipeline.site.init import NewFloor, add_floor, settled_source
from vislam2tag.preparation.registration.record import Registration
from vislam2tag.site.model import portable_name
from vislam2tag.site.plans.load import look_at_plan, plan_called, plan_extent, unplaced_picture
from vislam2tag.site.plans.source import PlanSource
from vislam2tag.site.site_file import FloorPart, has_site_file, read_site_file
from vislam2tag.studio.messages import Box, Point, seen_as
from vislam2tag.studio.routing import Binary, endpoint
from vislam2tag.studio.workspace import Workspace

Name = Annotated[str, Field(min_length=1, max_length=300)]


class DroppedFile(FiniteRecord):
    """A file that was brought; later requests name it by its number."""

    id: int
    name: str


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


MOST_FILE = 200_000_000
"""Bytes of a file: no plan may have more."""
KEPT = 20
"""Files kept; the oldest goes."""
_FIRST_BELOW = 900_000_000
"""Where files' numbers begin at most: a number in a path has up to nine digits."""
_SIDE_PX = 2400
_UNSAFE = re.compile(r"[^\w. ()+-]")


class DroppedFiles:
    """Files by number, each in a folder of its own under the name that it had; used by several threads."""

    def __init__(self) -> None:
        """Keep nothing yet."""
        self._held = ExitStack()
        self._scratch = self._held.enter_context(scratch_folder())
        self._lock = threading.Lock()
        self._files: dict[int, Path] = {}
        self._numbers = count(secrets.randbelow(_FIRST_BELOW))  # a page's draft must not find a file of a later run

    def close(self) -> None:
        """Forget all files."""
        self._held.close()

    def keep(self, name: str, content: bytes) -> DroppedFile:
        """Keep a file; raises UsageError for an empty one, or a name that cannot be a file's."""
        plain = portable_name(_UNSAFE.sub("_", name.replace("\\", "/").rpartition("/")[2])[-100:])
        if not plain:
            raise UsageError(f"{name!r} is no name of a file; rename it")
        if not content:
            raise UsageError(f"{plain}: is empty; choose another file")
        with self._lock:
            number = next(self._numbers)
            self._scratch.write(f"{number}/{plain}", content)
            self._files[number] = self._scratch / f"{number}/{plain}"
            for old in list(self._files)[:-KEPT]:
                self._files.pop(old)
                self._scratch.remove_tree(str(old))
        return DroppedFile(id=number, name=plain)

    def path(self, number: int) -> Path:
        """Where a file lies; raises KeyError where there is none."""
        if number not in self._files:
            raise KeyError("file of that number")
        return self._files[number]


PlanPage: TypeAlias = Annotated[int, Field(ge=1)]


@endpoint("GET", "/api/prepare/files/{number:short}/look")
def look(
    workspace: Workspace, dropped: DroppedFiles, number: int, page: PlanPage = 1, level: str | None = None
) -> PlanLookView:
    """What a plan shows before it has a scale; raises SurveyError where it cannot be read."""
    path, source = dropped.path(number), PlanSource(file="plan", page=page, level=level)
    with plan_called(path.name):
        found = look_at_plan(path, source)
    return seen_as(PlanLookView, found, name=path.name, has_scale=_has_scale(path, source, workspace.root))


def _has_scale(path: Path, source: PlanSource, root: Path) -> bool:
    part = read_site_file(root).georeference if has_site_file(root) else None
    try:
        plan_extent(path, source, None if part is None else part.georeference())
    except OSError:
        return False
    return True


@endpoint("GET", "/api/prepare/files/{number:short}/picture")
def picture(dropped: DroppedFiles, number: int, page: PlanPage = 1, level: str | None = None) -> Binary:
    """The plan between its box as PNG; raises SurveyError where it cannot be drawn."""
    path, source = dropped.path(number), PlanSource(file="plan", page=page, level=level)
    buffer = io.BytesIO()
    with plan_called(path.name):
        unplaced_picture(path, source, _SIDE_PX).save(buffer, "png")
    return Binary(buffer.getvalue(), "image/png")


@endpoint("POST", "/api/prepare/floors")
def add_dropped(workspace: Workspace, dropped: DroppedFiles, body: FloorRequest) -> AddedFloor:
    """Make a dropped plan a floor as ``vislam2tag site init`` does; raises what that raises."""
    path = dropped.path(body.file)
    if body.part.plan is None:
        raise UsageError("say how the plan is to be read")
    asked = body.part.plan.model_copy(update={"file": path.name})
    source, notes = settled_source(path, asked, whole=body.whole)
    add_floor(workspace.root, NewFloor(path, body.part.model_copy(update={"plan": source})))
    workspace.refresh()
    return AddedFloor(floor=body.part.number, notes=notes)


@endpoint("POST", "/api/prepare/positions")
def registered(workspace: Workspace, dropped: DroppedFiles, body: RegisterRequest) -> RegistrationView:
    """Adjust what the files say, and write it into the site where that is asked for; raises what registering raises."""
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
