"""From a site to its landmark plans: drawings, lists, summary and page, and the site's own files if wanted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from vislam2tag import __version__
from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.given_files import AnyPath, path_or_none, read_bytes
from vislam2tag.common.files.whole_output import whole_folder
from vislam2tag.common.progress import Progress, silent
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.preparation.planning.floor import STEPS, FloorConstraints, FloorDesign, plan_floor
from vislam2tag.preparation.planning.records import (
    FloorPlanRecord,
    PlanSummary,
    floor_summary,
    landmarks_text,
    marker_text,
    new_ids,
    planned_states,
    read_forbidden,
)
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.site.discover import floor_folders, read_site, refuse_unknown_floors, session_folders
from vislam2tag.site.landmark_file import LANDMARK_FILE, refuse_unreadable, table_path
from vislam2tag.site.landmark_states import write_states
from vislam2tag.site.links import refuse_outside_plan, shared_site, site_name, write_in_survey
from vislam2tag.site.model import Floor, Site, landmark_id
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.rooms import FloorRooms, boxes_of, floor_rooms, graph_without
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.site_table import LANDMARKS, read_site_table
from vislam2tag.site.walkable.graph import CorridorGraph, corridor_graph
from vislam2tag.site.walkable.painted_cells import floor_mask
from vislam2tag.site.walkable.space import walkable_space
from vislam2tag.views.panels import rendered
from vislam2tag.views.plan_page import PlannedMap, landmark_plan, sigma_figure, write_plan_page

SUMMARY_FILE, LANDMARKS_FILE, PAGE_FILE = "plan.json", "landmarks.csv", "index.html"


@dataclass(frozen=True)
class PlanRequest:
    """What to plan; ``floors`` empty: all."""

    floors: tuple[int, ...] = ()
    first_id: int = 1
    ignore_existing: bool = False
    """Whether the site's landmarks are ignored instead of being fixed."""
    restart: bool = False
    """Whether planned landmarks that were not measured are dropped instead of being fixed."""
    forbidden: AnyPath | None = None
    mask: AnyPath | None = None
    """Correction mask of the walkable space, if only one floor is planned."""
    write: bool = False
    """Whether the new landmarks are added to the site's own files."""
    walkable: WalkableSettings = field(default_factory=WalkableSettings)
    """Settings for finding walkable space on the floors' plans."""
    follow_links: bool = False
    """Use and draw floor plans, too, that links lead to outside the survey."""


@dataclass(frozen=True)
class PlannedFloor:
    """One floor's plan and its records."""

    floor: Floor
    design: FloorDesign
    summary: FloorPlanRecord
    hanging: Landmarks
    """Existing landmarks that are taken into account."""


def is_plan(folder: Path) -> bool:
    """Whether the folder contains plans."""
    return (folder / SUMMARY_FILE).is_file()


def write_plans(
    site_folder: AnyPath,
    out: AnyPath,
    settings: PlanSettings,
    request: PlanRequest,
    progress: Progress[str] = silent,
) -> PlanSummary:
    """Plan the landmarks of a site's floors and write them to ``out``, which appears complete or not at all.

    ``progress`` is called with the name of each step of a floor when it begins, and the number of floors. Raises
    SurveyError if the site or a floor cannot be planned, UsageError for an unknown floor, OutputError if something
    cannot be written.
    """
    site_folder, out = Path(site_folder), Path(out)
    site, findings = read_site(site_folder, follow_links=True)
    shown, _ = shared_site(site_folder, site, findings, follow_links=request.follow_links)
    refuse_unknown_floors(site, request.floors)
    taken = site.landmarks.ids
    dropped = planned_landmarks_of(site, request.floors) if request.restart else {}
    site, shown = without_landmarks(site, dropped), without_landmarks(shown, dropped)
    taken = ids_in_use(site_folder, site, taken)
    floors = [floor for floor in site.floors if not request.floors or floor.number in request.floors]
    for floor in () if request.follow_links else floors:
        refuse_outside_plan(site_folder, floor)
    if request.mask is not None and len(request.floors) != 1:
        raise UsageError("--mask corrects one floor; choose it with --floor")
    forbidden = {} if request.forbidden is None else read_forbidden(Path(request.forbidden))
    unknown = sorted(set(forbidden) - {floor.number for floor in site.floors})
    if unknown:
        raise SurveyError(f"{request.forbidden}: the site has no floor {unknown[0]}")
    with whole_folder(out, is_plan) as folder:
        planned: list[PlannedFloor] = []
        first = request.first_id
        for floor in floors:
            given = constraints_of(site, floor, forbidden.get(floor.number), ignore_existing=request.ignore_existing)
            advance = lambda step, _steps: progress(step, len(floors))
            design, _, rooms = designed(floor, request, settings, given, advance)
            ids = new_ids(len(design.place), first, taken)
            first = int(ids[-1]) + 1 if ids else first
            summary = floor_summary(design, floor.number, shown.floor(floor.number).name, ids, rooms)
            also = {"dropped": dropped.get(floor.number, ()), "excluded_rooms": floor.excluded_rooms}
            summary = summary.model_copy(update=also)
            hanging = shown.landmarks.select([]) if request.ignore_existing else shown.landmarks.on_floor(floor.number)
            planned.append(PlannedFloor(shown.floor(floor.number), design, summary, hanging))
        result = PlanSummary(
            version=__version__,
            settings=settings,
            walkable=request.walkable,
            building=site_name(site_folder, follow_links=request.follow_links),
            floors=tuple(one.summary for one in planned),
            findings=tuple(one for one in findings if one.file.endswith(LANDMARK_FILE) and one.kind != "missing_file"),
        )
        _write(folder, planned, result)
    if request.write:
        add_to_site(site_folder, result)
    return result


def planned_landmarks_of(site: Site, floors: Sequence[int]) -> dict[int, tuple[str, ...]]:
    """Ids of landmarks that are planned and not measured, by floor; ``floors`` empty: all."""
    chosen = [floor.number for floor in site.floors if not floors or floor.number in floors]
    planned = {number: tuple(site.landmarks.on_floor(number).planned_ids) for number in chosen}
    return {number: names for number, names in planned.items() if names}


def without_landmarks(site: Site, dropped: Mapping[int, Sequence[str]]) -> Site:
    """The site without some landmarks, by floor."""
    marks = site.landmarks
    names = zip(marks.floor.tolist(), marks.ids, strict=True)
    rows = [row for row, (floor, name) in enumerate(names) if name not in dropped.get(floor, ())]
    return replace(site, landmarks=marks.select(rows))


def ids_in_use(root: Path, site: Site, before: tuple[str, ...]) -> tuple[str, ...]:
    """Ids that new landmarks must not get: those ``before`` some were dropped if walks may have seen their sheets."""
    try:
        return before if session_folders(root)[0] else site.landmarks.ids
    except SurveyError:  # no floor has a folder yet
        return site.landmarks.ids


def constraints_of(
    site: Site, floor: Floor, forbidden: FloatArray | None = None, *, ignore_existing: bool = False
) -> FloorConstraints:
    """Constraints of a floor: its surveyed landmarks, unless ``ignore_existing``, and forbidden rectangles (f, 4)."""
    here = site.landmarks.on_floor(floor.number)
    rows = [] if ignore_existing else np.flatnonzero(here.surveyed).tolist()
    names = tuple(here.ids[row] for row in rows)
    return FloorConstraints(
        here.position_bcs[rows].reshape(-1, 2), names, np.zeros((0, 4)) if forbidden is None else forbidden
    )


def designed(
    floor: Floor,
    request: PlanRequest,
    settings: PlanSettings,
    given: FloorConstraints,
    progress: Progress[str] = silent,
) -> tuple[FloorDesign, CorridorGraph, FloorRooms]:
    """Plan a floor from its plan's walkable space, with its rooms; raises SurveyError if that fails."""
    progress("walkable space", len(STEPS))
    plan, mask = floor_plan(floor), floor_mask(floor, path_or_none(request.mask))
    space = walkable_space(plan, request.walkable, mask)
    graph = corridor_graph(space)
    rooms = floor_rooms(floor, plan, space, graph)
    try:
        left_out = rooms.called(floor.excluded_rooms)
        graph = graph_without(graph, rooms.areas, left_out)
        given = replace(given, forbidden=np.vstack((given.forbidden, boxes_of(rooms.areas, left_out))))
        return plan_floor(space, graph, settings, given, progress), graph, rooms
    except SurveyError as error:
        raise SurveyError(f"floor {floor.number}: {error}") from error


def _write(folder: Folder, planned: Sequence[PlannedFloor], result: PlanSummary) -> None:
    folder.write(SUMMARY_FILE, result.model_dump_json(indent=1) + "\n")
    folder.write(LANDMARKS_FILE, landmarks_text(result))
    maps: dict[int, PlannedMap] = {}
    for one in planned:
        stem = f"floor_{one.floor.number}"
        drawings = {
            "plan": landmark_plan(one.design, one.floor, one.summary),
            "sigma": sigma_figure(one.design, one.floor, one.summary),
        }
        files = {(name, kind): rendered(figure, kind) for name, figure in drawings.items() for kind in ("png", "pdf")}
        for (name, kind), content in files.items():
            folder.write(f"{stem}.{name}.{kind}", content)
        maps[one.floor.number] = PlannedMap(one.floor, one.hanging, files["sigma", "png"])
    write_plan_page(folder / PAGE_FILE, result, maps)


def add_to_site(site_folder: Path, result: PlanSummary) -> None:
    """Add the new landmarks to the floors' own files as planned, not measured; each is replaced whole.

    Raises OutputError if one cannot be read or written.
    """
    folders = _floor_folders(site_folder)
    for floor in result.floors:
        path = folders.get(floor.floor, site_folder / f"floor_{floor.floor}") / LANDMARK_FILE
        if floor.dropped:
            _drop(site_folder, path, floor)
        if not floor.landmarks:
            continue
        places = np.array([(one.x_m, one.y_m) for one in floor.landmarks])
        refuse_unreadable(path, [one.id for one in floor.landmarks], places)
        try:
            before = _landmark_text(site_folder, path)
        except OSError as error:
            raise OutputError(f"{path}: cannot be read ({error.strerror}); nothing was written to it") from error
        text = marker_text(before, floor.landmarks)
        # the states come first, because a position without one would count as measured
        write_states(site_folder, path.parent, planned_states(floor.landmarks))
        write_in_survey(site_folder, path, text.encode("utf-8", errors="surrogateescape"))


def _drop(root: Path, path: Path, floor: FloorPlanRecord) -> None:
    """Remove dropped landmarks from a floor's own files."""
    table = read_site_table(root, table_path(path), columns=LANDMARKS)
    kept = [
        fields
        for _, fields in table.rows
        if landmark_id(fields[0]) not in floor.dropped
        or landmark_id(table.cell(fields, "floor")) not in ("", str(floor.floor))
    ]
    # the states come last, because a planned position without one would count as measured
    write_in_survey(root, path, csv_rows([table.header, *kept]))
    write_states(root, path.parent, (), floor.dropped)


def _landmark_text(root: Path, path: Path) -> str:
    """A floor's landmark file: unchanged if it has our columns, otherwise converted to them."""
    there = table_path(path)
    if not there.is_file():
        return ""
    table = read_site_table(root, there, columns=LANDMARKS)
    if table.findings or there != path:
        return csv_rows([table.header, *(fields for _, fields in table.rows)])
    return read_bytes(path).decode("utf-8", errors="surrogateescape")


def _floor_folders(site_folder: Path) -> dict[int, Path]:
    """The folders of the floors; a site with a site.toml may have none yet."""
    try:
        return floor_folders(site_folder)[0]
    except SurveyError:
        return {}
