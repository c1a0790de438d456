"""What a plan reads and writes: ``plan.json``, rows of ``landmarks.csv``, planned landmarks in a site's own files."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Sequence
from itertools import count as numbers_from
from itertools import islice
from pathlib import Path
from typing import ClassVar

import numpy as np

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Finding
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.common.text_tables import csv_rows
from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.planning.floor import FloorDesign
from vislam2tag.preparation.planning.prediction import mean_error_m
from vislam2tag.preparation.planning.refine import NARROW_M, DistanceClass
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.preparation.sheets.settings import SHEET_SIZES
from vislam2tag.site.landmark_states import PLANNED_HEADING_SIGMA_RAD, PLANNED_SIGMA_M, LandmarkState, StateRow
from vislam2tag.site.rooms import FloorRooms
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.site_table import finite_or_none, readable_table

COLUMNS = ("id", "floor", "x", "y", "z", "heading_rad", "sheet", "width_m", "near", "floor_name", "building")


class PlannedLandmark(Record):
    """One sheet to hang up; metres in the floor's BCS."""

    id: str
    floor: int
    x_m: float
    y_m: float
    z_m: float
    heading_rad: float
    """Direction of the sheet's X axis: to the right of who looks at it."""
    sheet: str
    width_m: float
    """Side of the image that is recognised."""
    pass_m: float
    """Distance between phone and sheet in passing."""
    visible_m: float
    """Length of the corridor from which the sheet is in view."""
    near: str = ""
    """Nearest room with a name."""


class UnmetDemand(Record):
    """A demand that no wall can fulfil, and where."""

    kind: str
    start_m: tuple[float, float]
    stop_m: tuple[float, float]
    length_m: float
    message: str


class FurtherLandmark(Record):
    """One landmark more, and by how much the mean error to expect on the floor falls with it and those before it."""

    x_m: float
    y_m: float
    gain_m: float


class TourSummary(Record):
    """The tour: ``visits`` are ids in order, ``visit_m`` how far along, ``line_m`` its corners."""

    length_m: float
    duration_s: float
    repeated_m: float
    all_met_m: float
    visits: tuple[str, ...]
    visit_m: tuple[float, ...]
    line_m: tuple[tuple[float, float], ...]


class FloorPlanRecord(Record):
    """The plan of one floor."""

    floor: int
    name: str
    corridors_m: float
    places: int
    landmarks: tuple[PlannedLandmark, ...]
    fixed: tuple[str, ...]
    not_passed: tuple[str, ...]
    """Fixed landmarks that hang beside no corridor: no one passes them."""
    number: int
    """New landmarks and the fixed ones, as far as they are passed."""
    bound: int
    """Proven: no set of places with fewer landmarks fulfils the demands."""
    above_bound: float
    """Number over bound, less one."""
    cut_short: bool
    """Whether the time limit ended the search: another machine may then find another plan."""
    longest_m: float | None
    """Longest walk between two landmarks; None where some demand cannot be met."""
    on_a_line: tuple[str, ...]
    """Landmarks that lie next to one line with their nearest neighbours."""
    unmet: tuple[UnmetDemand, ...]
    expected_error_m: float | None
    """Mean length of the labels' errors; None where no walk can be mapped."""
    expected: tuple[DistanceClass, ...]
    further: tuple[FurtherLandmark, ...]
    tour: TourSummary
    findings: tuple[Finding, ...]
    """What is doubtful of the walkable space: rooms that walls close off."""
    dropped: tuple[str, ...] = ()
    """Planned landmarks of the site that this plan replaces."""
    excluded_rooms: tuple[str, ...] = ()
    """Rooms that walks leave out."""


class PlanSummary(Result):
    """``plan.json``."""

    main_table: ClassVar[str] = "floors"

    version: str
    settings: PlanSettings
    walkable: WalkableSettings = WalkableSettings()
    building: str = ""
    floors: tuple[FloorPlanRecord, ...]
    findings: tuple[Finding, ...]
    """Problems of the landmarks that the site has."""

    @property
    def landmarks(self) -> tuple[PlannedLandmark, ...]:
        """The new landmarks of all floors."""
        return tuple(landmark for floor in self.floors for landmark in floor.landmarks)


def floor_summary(
    design: FloorDesign, floor: int, name: str, ids: Sequence[str], rooms: FloorRooms | None = None
) -> FloorPlanRecord:
    """Describe one floor's plan; ``ids`` (m) are those of its new landmarks, ``rooms`` name what they are near."""
    settings = design.settings
    passed = [name for name, at in zip(design.constraints.names, design.fixed_station.tolist(), strict=True) if at >= 0]
    every = [*ids, *passed]
    number = len(every)
    # Two fixed landmarks at one station count as one in the bound; the plan cannot do without either.
    bound = design.cover.bound + number - int(design.cover.number)
    error_m = mean_error_m(design.expected)
    return FloorPlanRecord(
        floor=floor,
        name=name,
        corridors_m=_metres(design.corridors.length_m.sum()),
        places=len(design.places.station),
        landmarks=planned_landmarks(design, floor, ids, rooms),
        fixed=design.constraints.names,
        not_passed=tuple(name for name in design.constraints.names if name not in set(passed)),
        number=number,
        bound=bound,
        above_bound=round(number / bound - 1, 4) if bound else 0.0,
        cut_short=design.cover.cut_short,
        longest_m=None if design.demands.gaps else design.longest_m,
        on_a_line=tuple(
            one for one, width in zip(every, design.line_deviations_m.tolist(), strict=True) if width < NARROW_M
        ),
        unmet=tuple(_unmet(gap.kind, gap.start, gap.stop, gap.length_m, settings) for gap in design.demands.gaps),
        expected_error_m=None if math.isnan(error_m) else _metres(error_m, 4),
        expected=design.classes,
        further=tuple(
            FurtherLandmark(x_m=_metres(x_m), y_m=_metres(y_m), gain_m=_metres(gain_m, 4))
            for (x_m, y_m), gain_m in ((design.places.position[place], gain_m) for place, gain_m in design.further)
        ),
        tour=_tour(design, every, settings.speed_m_s),
        findings=design.space.findings,
    )


def planned_landmarks(
    design: FloorDesign, floor: int, ids: Sequence[str], rooms: FloorRooms | None = None
) -> tuple[PlannedLandmark, ...]:
    """The new landmarks of a floor with their ids (m)."""
    places = design.places.take(design.place)
    # Who faces a sheet has its X axis on the right: the outward normal turned by +90 degrees.
    heading = np.arctan2(places.normal[:, 0], -places.normal[:, 1])
    near = [""] * len(ids) if rooms is None else rooms.near(places.position)
    return tuple(
        PlannedLandmark(
            id=name,
            floor=floor,
            x_m=_metres(places.position[i, 0]),
            y_m=_metres(places.position[i, 1]),
            z_m=design.settings.height_m,
            heading_rad=round(float(heading[i]), 4),
            sheet=places.sheet[i],
            width_m=SHEET_SIZES[places.sheet[i]].image_m,
            pass_m=_metres(places.pass_m[i], 2),
            visible_m=_metres(places.visible_m[i], 2),
            near=near[i],
        )
        for i, name in enumerate(ids)
    )


def _tour(design: FloorDesign, names: Sequence[str], speed_m_s: float) -> TourSummary:
    first_m = design.tour.first_m()
    return TourSummary(
        length_m=_metres(design.tour.length_m, 1),
        duration_s=round(design.tour.duration_s(speed_m_s)),
        repeated_m=_metres(design.tour.twice_m, 1),
        all_met_m=_metres(first_m[-1], 1) if len(first_m) else 0.0,
        visits=tuple(names[i] for i in design.tour.visit.tolist()),
        visit_m=tuple(_metres(at, 1) for at in design.tour.visit_m.tolist()),
        line_m=tuple((_metres(x, 2), _metres(y, 2)) for x, y in design.tour.line.tolist()),
    )


def _unmet(
    kind: str, start: tuple[float, float], stop: tuple[float, float], length_m: float, settings: PlanSettings
) -> UnmetDemand:
    here, there = (f"({x:.1f}, {y:.1f})" for x, y in (start, stop))
    if kind == "spacing":
        message = (
            f"from {here} a walk of {length_m:.0f} m passes no wall for a sheet; put up a stand there, allow larger "
            f"sheets (--paper), or use a --spacing-m above {settings.spacing_m:g} m"
        )
    elif kind == "turn":
        message = f"between the turns at {here} and {there} there is no wall for a sheet; put up a stand there"
    else:
        message = f"the open area at {here} has no wall for a sheet within {length_m:.1f} m; put up a stand there"
    rounded = [(_metres(x, 2), _metres(y, 2)) for x, y in (start, stop)]
    return UnmetDemand(kind=kind, start_m=rounded[0], stop_m=rounded[1], length_m=length_m, message=message)


def _metres(value: float, digits: int = 3) -> float:
    return round(float(value), digits)


def landmarks_text(summary: PlanSummary) -> str:
    """``landmarks.csv``."""
    rows = (
        _row(one, COLUMNS, floor_name=floor.name, building=summary.building)
        for floor in summary.floors
        for one in floor.landmarks
    )
    return csv_rows((COLUMNS, *rows))


def new_ids(count: int, first: int, taken: Iterable[str]) -> list[str]:
    """``count`` numbers from ``first`` on that are not taken."""
    clash = set(taken)
    return list(islice((str(number) for number in numbers_from(first) if str(number) not in clash), count))


FORBIDDEN_HEADER = ("floor", "x0", "y0", "x1", "y1")


def read_forbidden(path: Path) -> dict[int, FloatArray]:
    """Rectangles (f, 4) of each floor: two opposite corners x0, y0, x1, y1, metres in the BCS.

    The file is comma separated with the header ``floor,x0,y0,x1,y1``. Raises SurveyError where it cannot be used.
    """
    table = readable_table(path.parent, path, f"; expected {','.join(FORBIDDEN_HEADER)}")
    if not set(FORBIDDEN_HEADER) <= set(table.header):
        raise SurveyError(f"{path}: the first line must be {','.join(FORBIDDEN_HEADER)}")
    found: dict[int, list[list[float]]] = {}
    for line, fields in table.rows:
        try:
            floor = int(table.cell(fields, "floor"))
            corners = [finite_or_none(table.cell(fields, name)) for name in FORBIDDEN_HEADER[1:]]
            if any(value is None for value in corners):
                raise ValueError("a corner is missing")
        except ValueError as error:
            raise SurveyError(f"{path}:{line}: expected a floor's number and four numbers, metres") from error
        found.setdefault(floor, []).append([value for value in corners if value is not None])
    return {floor: np.array(rows) for floor, rows in sorted(found.items())}


MARKER_COLUMNS = ("id", "x", "y", "z", "sigma_m", "heading_rad", "heading_sigma_rad", "sheet", "width_m")


def marker_text(text: str, landmarks: Sequence[PlannedLandmark]) -> str:
    """Text of a floor's ``marker_dict.csv`` with further rows; missing columns are added to its header.

    ``text`` is empty where there is no file yet.
    """
    newline = "\r\n" if "\r\n" in text else "\n"
    head, _, rest = text.partition("\n")
    header = next(csv.reader([head.rstrip("\r")]), [])
    names = [name.strip().lower() for name in header] or list(MARKER_COLUMNS)
    wanted = [*MARKER_COLUMNS[1:], *(["near"] if any(one.near for one in landmarks) else [])]
    missing = [name for name in wanted if name not in names[1:]]
    first = head.rstrip("\r") if header else ",".join(MARKER_COLUMNS)
    lines = [",".join((first, *missing))]
    if rest.strip("\r\n"):
        lines.append(rest.rstrip("\r\n"))
    rows = (_row(landmark, (*names, *missing)) for landmark in landmarks)
    return newline.join((*lines, csv_rows(rows, newline)))


def planned_states(landmarks: Sequence[PlannedLandmark]) -> list[StateRow]:
    """The states of planned landmarks."""
    return [StateRow(one.id, LandmarkState.PLANNED, "plan", one.x_m, one.y_m) for one in landmarks]


def _row(landmark: PlannedLandmark, names: Sequence[str], **more: str) -> list[str]:
    """A landmark's id and cells of further columns; empty where they are others."""
    values = more | {
        "x": landmark.x_m,
        "y": landmark.y_m,
        "z": landmark.z_m,
        "floor": landmark.floor,
        "sigma_m": PLANNED_SIGMA_M,
        "heading_rad": landmark.heading_rad,
        "heading_sigma_rad": PLANNED_HEADING_SIGMA_RAD,
        "sheet": landmark.sheet,
        "width_m": landmark.width_m,
        "near": landmark.near,
    }
    return [landmark.id, *(str(values.get(name, "")) for name in names[1:])]
