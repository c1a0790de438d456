"""Planned landmarks, corrected walls and sheets, by the functions of ``plan``, ``site walkable`` and ``sheets``."""

from __future__ import annotations

import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw

from vislam2tag import __version__
from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import read_bytes
from vislam2tag.core.arrays import IntArray
from vislam2tag.pipeline.site.change import FloorChanges, change_site, floor_part, remove_floor, renumber_floor
from vislam2tag.pipeline.site.plan import (
    PlanRequest,
    add_to_site,
    constraints_of,
    designed,
    ids_in_use,
    planned_landmarks_of,
    without_landmarks,
)
from vislam2tag.pipeline.site.register import floor_of
from vislam2tag.preparation.planning.floor import ChangedPlan
from vislam2tag.preparation.planning.prediction import mean_error_m
from vislam2tag.preparation.planning.records import PlanSummary, floor_summary, new_ids
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.preparation.sheets.settings import SheetSettings, sheet_size
from vislam2tag.preparation.sheets.sheet_folder import PDF_FILE, SheetOptions, is_sheets, make_sheets
from vislam2tag.settings import Settings
from vislam2tag.site.discover import read_site
from vislam2tag.site.floors import MASK_FILE
from vislam2tag.site.links import write_in_survey
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.source import SCALES, Extent, FloorPlan, PlanSource
from vislam2tag.site.rooms import FloorRooms, rooms_of
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.site_file import SITE_FILE, FloorPart, read_site_file
from vislam2tag.site.walkable.drawn_cells import plan_grid
from vislam2tag.site.walkable.painted_cells import GREEN, RED, floor_mask
from vislam2tag.site.walkable.space import WalkableSpace, walkable_space, wall_segments
from vislam2tag.studio import preparing
from vislam2tag.studio.layers.walkable import rings_of
from vislam2tag.studio.messages import Point
from vislam2tag.studio.workspace import beside, plan_stamp

KEPT = 4
"""Maximum number of cached plans; the oldest is removed."""


class _Plan:
    """A floor's plan with its editable landmarks."""

    def __init__(self, root: Path, wish: preparing.PlanWish, settings: Settings) -> None:
        """Plan the floor of a survey; raises SurveyError or UsageError as ``vislam2tag plan`` does."""
        site, _ = read_site(root, follow_links=True)
        self.floor: Floor = site.floor(wish.floor)
        asked: dict[str, object] = {"spacing_m": wish.spacing_m, "rooms": wish.rooms, "further": 0}
        asked |= {"sheets": tuple(sheet_size(name).name for name in wish.sheets)}
        self.settings = PlanSettings.model_validate(settings.plan.model_dump() | asked)
        self.dropped = planned_landmarks_of(site, [wish.floor]) if wish.restart else {}
        kept = without_landmarks(site, self.dropped)
        given = constraints_of(kept, self.floor)
        design, graph, self.rooms = designed(self.floor, PlanRequest(walkable=settings.walkable), self.settings, given)
        self.changed = ChangedPlan(design, graph)
        self.taken = ids_in_use(root, kept, site.landmarks.ids)
        self.fewest = len(design.place)
        ids = self.ids(self.fewest, [])
        self.record = floor_summary(design, self.floor.number, self.floor.name, ids, self.rooms)

    def ids(self, count: int, held: list[preparing.HeldLandmark]) -> list[str]:
        """Ids for ``count`` new landmarks."""
        return new_ids(count, 1, (*self.taken, *(one.id for one in held)))

    def view(self, number: int, held: list[preparing.HeldLandmark]) -> preparing.PlannedView:
        """The page's data of the plan with these landmarks."""
        design, place = self.changed.design, _places(held)
        found = self.changed.expectation(place)
        error_m, grid = mean_error_m(found.expected), found.sigma.grid
        cm = np.nan_to_num(np.round(100 * found.sigma.sigma_m), nan=-1).astype(int)
        positions = design.places.position[place].round(3).tolist()
        return preparing.PlannedView(
            plan=number,
            floor=self.floor.number,
            landmarks=[
                preparing.PlannedMark(id=one.id, place=one.place, x=x, y=y, sheet=design.places.sheet[one.place])
                for one, (x, y) in zip(held, positions, strict=True)
            ],
            fixed=len(design.constraints.names),
            fewest=self.fewest,
            expected_error_m=None if np.isnan(error_m) else error_m,
            longest_m=None if design.demands.gaps else found.longest_m,
            extent_m=grid.extent_m,
            rows=grid.rows,
            columns=grid.columns,
            sigma_cm=cm.ravel().tolist(),
            notes=[*(one.message for one in self.record.findings), *(one.message for one in self.record.unmet)],
        )

    def written(self, held: list[preparing.HeldLandmark]) -> PlanSummary:
        """The plan with these landmarks as ``vislam2tag plan`` writes it."""
        design = self.changed.designed(_places(held))
        ids = [one.id for one in held]
        record = floor_summary(design, self.floor.number, self.floor.name, ids, self.rooms)
        record = record.model_copy(update={"dropped": self.dropped.get(self.floor.number, ())})
        return PlanSummary(version=__version__, settings=self.settings, floors=(record,), findings=())


_plans: dict[int, _Plan] = {}


def _places(held: list[preparing.HeldLandmark]) -> IntArray:
    return np.array([one.place for one in held], dtype=np.int64)


def make_plan(number: int, root: Path, wish: preparing.PlanWish, settings: Settings) -> preparing.PlannedView:
    """Plan a floor, and remember the plan by a number."""
    plan = _Plan(root, wish, settings)
    place = plan.changed.design.place.tolist()
    more = (wish.number or 0) - len(place) - int((plan.changed.design.fixed_station >= 0).sum())
    if more > 0:
        place += plan.changed.further(np.array(place, dtype=np.int64), more)
    held = [preparing.HeldLandmark(id=id, place=at) for id, at in zip(plan.ids(len(place), []), place, strict=True)]
    _plans[number] = plan
    for old in list(_plans)[:-KEPT]:
        del _plans[old]
    return plan.view(number, held)


def change_plan(change: preparing.PlanChange) -> preparing.PlannedView:
    """The plan with changed landmarks, or with one moved to or added at the place nearest to a point."""
    plan, held = _plan(change.plan), list(change.landmarks)
    if max((one.place for one in held), default=0) >= len(plan.changed.design.places.station):
        raise UsageError("this place does not exist; plan again")
    if change.to is not None:
        others = [one for one in held if one.id != change.moved]
        place = plan.changed.nearest_place(np.array(change.to), _places(others))
        moved = preparing.HeldLandmark(id=change.moved or plan.ids(1, held)[0], place=place)
        held = [moved if one.id == change.moved else one for one in held]
        held += [] if change.moved else [moved]
    return plan.view(change.plan, held)


def write_plan(change: preparing.PlanChange, root: Path) -> int:
    """Add the landmarks to the floor's own file; returns how many."""
    summary = _plan(change.plan).written(list(change.landmarks))
    add_to_site(root, summary)
    return len(summary.landmarks)


def _plan(number: int) -> _Plan:
    if number not in _plans:
        raise OutputError("the plan is no longer available; plan again")
    return _plans[number]


def excluded_rooms(root: Path, request: preparing.RoomsRequest, settings: WalkableSettings) -> preparing.RoomsView:
    """The excluded rooms of a floor, after the room at a point was excluded or included.

    Raises UsageError if there is no room with a name, OutputError if the site cannot be written.
    """
    _, floor = floor_of(root, request.floor)
    names = floor.excluded_rooms
    if request.at is None and not names:
        return preparing.RoomsView(floor=floor.number, excluded=[])
    rooms = rooms_of(floor, settings)
    if request.at is not None:
        name = _room_at(rooms, request.at)
        same = tuple(each for each in names if rooms.called((each,))[rooms.areas.at(np.array(request.at))].any())
        change_site(root, floor.number, FloorChanges(exclude_rooms=() if same else (name,), include_rooms=same))
        names = tuple(each for each in names if each not in same) + (() if same else (name,))
    excluded = [preparing.ExcludedRoom(name=name, rings=_rings(rooms, name)) for name in names]
    return preparing.RoomsView(floor=floor.number, excluded=excluded)


def _room_at(rooms: FloorRooms, place_m: Point) -> str:
    """The name of the room at a place; raises UsageError if there is none."""
    area = int(rooms.areas.at(np.array(place_m))[0])
    if area < 0 or not rooms.areas.is_room[area]:
        raise UsageError("there is no room behind a door at this place; click inside a room")
    if not rooms.areas.names[area]:
        raise UsageError("this room has no name; write name, x and y of it into rooms.csv of the floor, then try again")
    return rooms.areas.names[area]


def _rings(rooms: FloorRooms, name: str) -> list[list[Point]]:
    mask = rooms.areas.space.area.mask & np.isin(rooms.areas.number, np.flatnonzero(rooms.called((name,))))
    area = replace(rooms.areas.space.area, mask=mask)
    return rings_of(WalkableSpace(area, wall_segments(area))) if mask.any() else []


def changed_floor(root: Path, change: preparing.FloorChange) -> preparing.ChangedFloor:
    """Change a floor as ``site set`` and ``site renumber`` do; raises their errors; a refusal changes nothing."""
    part = floor_part(root, read_site_file(root), change.floor)
    before, notes = read_bytes(root / SITE_FILE), list[str]()
    plan = None if change.width_m is None else _with_width(root, part, change.width_m)
    changes = FloorChanges(change.name, change.elevation_m, plan)
    if changes != FloorChanges():
        notes += change_site(root, part.number, changes).notes
    if change.number not in (None, part.number):
        try:
            notes += renumber_floor(root, part.number, change.number).notes
        except (SurveyError, UsageError):  # before it has written anything
            write_in_survey(root, root / SITE_FILE, before)
            raise
    _plans.clear()  # they would be written to the floor as it was
    return preparing.ChangedFloor(notes=notes)


def _with_width(root: Path, part: FloorPart, width_m: float) -> PlanSource:
    """How to read a floor's plan with another width and the same lower left corner."""
    if part.plan is None:
        raise UsageError(f"floor {part.number} has no plan, so it has no width; add its plan")
    left, _, low, _ = read_site(root, follow_links=True)[0].floor(part.number).extent_m or (0.0, 0.0, 0.0, 0.0)
    extent = Extent(width_m=width_m, lower_left_m=(left, low))
    return part.plan.model_copy(update={**dict.fromkeys(SCALES), "extent": extent})


def removed_floor(root: Path, number: int) -> preparing.ChangedFloor:
    """Take a floor out of the site as ``site remove`` does; raises its errors."""
    done = remove_floor(root, number)
    _plans.clear()
    return preparing.ChangedFloor(notes=[*done.done, *done.notes])


_last_plan: dict[str, FloorPlan] = {}
"""The last plan, by its key."""


def corrected_floor(root: Path, request: preparing.WallsRequest, settings: WalkableSettings) -> preparing.WallsView:
    """The floor with its corrections and these strokes over them; with ``write`` they are saved next to its plan.

    Raises SurveyError if nothing is walkable then, OutputError if they cannot be written.
    """
    _, floor = floor_of(root, request.floor)
    before = None if request.anew else floor_mask(floor)
    plan = _plan_of(floor)
    mask = _painted(before, plan, request.strokes, settings)
    space = walkable_space(plan, settings, mask)
    if request.write:
        _write(root, f"floor_{floor.number}/{MASK_FILE}", mask)
    return preparing.WallsView(
        floor=floor.number,
        area_m2=float(space.area.mask.sum()) * space.area.cell_m**2,
        rings=rings_of(space),
        corrected=before is not None,
        notes=[finding.message for finding in space.findings],
    )


def _plan_of(floor: Floor) -> FloorPlan:
    key = f"{floor} {plan_stamp(floor)}"
    if key not in _last_plan:
        _last_plan.clear()
        _last_plan[key] = floor_plan(floor)
    return _last_plan[key]


def _painted(
    before: npt.NDArray[np.uint8] | None, plan: FloorPlan, strokes: list[preparing.Stroke], settings: WalkableSettings
) -> npt.NDArray[np.uint8] | None:
    """A correction (rows, columns, 4) over the plan's extent with strokes painted on it; None if there is none."""
    if before is None and not strokes:
        return None
    rows, columns = plan_grid(plan, settings).shape
    image = Image.new("RGBA", (columns, rows)) if before is None else Image.fromarray(before)
    left, right, low, high = plan.extent_m
    across, down = image.width / (right - left), image.height / (high - low)
    canvas = ImageDraw.Draw(image)
    for stroke in strokes:
        points = [((x - left) * across, (high - y) * down) for x, y in stroke.points]
        colour = (*(GREEN if stroke.walkable else RED), 255)
        if stroke.shape == "polygon":
            canvas.polygon(points, fill=colour)
        else:
            width = max(1, round(stroke.width_m * across))
            canvas.line(points, fill=colour, width=width, joint="curve")
            for x, y in (points[0], points[-1]):
                canvas.ellipse((x - width / 2, y - width / 2, x + width / 2, y + width / 2), fill=colour)
    return np.asarray(image)


def _write(root: Path, name: str, mask: npt.NDArray[np.uint8] | None) -> None:
    try:
        if mask is None:
            Folder.at(root).remove(name)
            return
        buffer = io.BytesIO()
        Image.fromarray(mask).save(buffer, "png")
        Folder.at(root).write(name, buffer.getvalue())
    except OSError as error:
        raise OutputError(f"{root / name}: cannot be written ({error.strerror}); check its permissions") from error


def sheets_folder(root: Path) -> Path:
    """Folder of a survey's sheets: ``SURVEY-sheets`` next to it."""
    return beside(root, "sheets")


def made_sheets(root: Path, wish: preparing.SheetsWish, settings: SheetSettings) -> preparing.SheetsView:
    """Create them; raises errors of ``vislam2tag sheets``."""
    out = sheets_folder(root)
    options = SheetOptions(root, wish.ids or None, None, wish.tag, settings.model_copy(update={"paper": wish.paper}))
    found = make_sheets(options, out)
    return preparing.SheetsView(folder=str(out), pages=len(found.pages), notes=[one.message for one in found.findings])


def sheets_pdf(root: Path) -> bytes:
    """The pages; raises KeyError if there are none."""
    folder = sheets_folder(root)
    if not is_sheets(folder):
        raise KeyError("the file of sheets")
    return read_bytes(folder / PDF_FILE)
