"""Floors of a site: as ``site.toml`` describes them, or laid out as the Indoor Location Competition 2.0 does it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np
from shapely.geometry import Polygon

from vislam2tag.common.files.given_files import plain, read_json
from vislam2tag.common.findings import Finding, Severity, at_lines_if
from vislam2tag.site.georeference import Georeference, georeference_of
from vislam2tag.site.landmark_file import read_control_points
from vislam2tag.site.model import ControlPoints, Floor, SessionKey, floor_number
from vislam2tag.site.plans.drawing import Bounds, extent_sides_m
from vislam2tag.site.plans.load import plan_extent
from vislam2tag.site.plans.source import Extent, FloorPlan, PlanPolygon, PlanSource, PlanText, Use
from vislam2tag.site.site_file import FLOOR_FILE, SITE_FILE, FloorPart, read_site_file
from vislam2tag.site.site_table import ROOMS, finite_or_none, is_file, read_site_table, site_finding, unreadable_file

MASK_FILE = "floorplan.mask.png"
"""In a floor's folder: green can be walked, red cannot."""


def described_floors(root: Path, folders: Mapping[int, Path]) -> tuple[list[Floor], list[Finding]]:
    """Read the floors of a ``site.toml``, sorted by number; ``folders`` are the ``floor_K`` folders that there are.

    A plan that cannot be read or has no scale is a finding, and so is a folder of a floor that the file does not
    have: such a floor has no plan. Raises SurveyError where the file is wrong.
    """
    site = read_site_file(root)
    earth = None if site.georeference is None else site.georeference.georeference()
    described = {part.number: part for part in site.floors}
    floors, findings = [], list[Finding]()
    if (root / FLOOR_FILE).is_file():
        message = f"{SITE_FILE} is read instead; remove one of the two"
        findings.append(site_finding("second_file", FLOOR_FILE, message, Severity.INFO))
    for number in sorted({*described, *folders}):
        if number not in described:
            message = f"floor {number} is not in {SITE_FILE}: it has no plan; add it there"
            findings.append(site_finding("floor_without_size", folders[number].name, message))
        part = described.get(number, FloorPart(number=number))
        floor, problems = _floor(root, folders.get(number, root / f"floor_{number}"), part, earth)
        floors.append(floor)
        findings += problems
    return floors, findings


def _floor(root: Path, folder: Path, part: FloorPart, earth: Georeference | None) -> tuple[Floor, list[Finding]]:
    site_T_bcs = part.site_T_bcs.similarity()
    georeference = None if earth is None else georeference_of(earth, site_T_bcs)
    control_points, findings = read_control_points(root, folder)
    extent, problems = _extent(root, part.plan, georeference)
    left, right, low, high = extent or (0.0, 0.0, 0.0, 0.0)
    floor = Floor(
        number=part.number,
        name=part.name or f"Floor {part.number}",
        width_m=right - left if extent else None,
        height_m=high - low if extent else None,
        elevation_m=part.elevation_m,
        plan=None if part.plan is None else root / part.plan.file,
        control_points=control_points,
        lower_left_m=(left, low),
        source=part.plan,
        mask=file_in(folder, MASK_FILE),
        rooms=file_in(folder, ROOMS_FILE),
        excluded_rooms=part.excluded_rooms,
        georeference=georeference,
        site_T_bcs=site_T_bcs,
    )
    return floor, [*findings, *problems]


def file_in(folder: Path, name: str) -> Path | None:
    """A file of a floor's folder; None if it has none or is locked (reported where its sessions are listed)."""
    with suppress(PermissionError):
        return folder / name if is_file(folder / name) else None
    return None


def _extent(
    root: Path, source: PlanSource | None, georeference: Georeference | None
) -> tuple[Bounds | None, list[Finding]]:
    if source is None:
        return None, []
    try:
        found = plan_extent(root / source.file, source, georeference)
    except OSError as error:
        message = f"the plan {error}; a metric grid is drawn instead"
        return None, [site_finding("unreadable_plan", source.file, message)]
    if source.extent is not None:  # exactly as given, not as it comes out of the calculation
        left, low = source.extent.lower_left_m
        width_m, height_m = extent_sides_m(source.extent, found)
        found = left, left + width_m, low, low + height_m
    return found, []


ROOMS_FILE = "rooms.csv"
"""In a floor's folder: name, x and y of rooms, metres in the BCS."""
_SIZE = re.compile(r"\W*[\d.,\s]+(m|cm|mm|m²|m2|qm|ft|sq\.? ?ft)\W*", re.IGNORECASE)
"""A dimension or an area, which is not a room's name."""
_NUMBER = re.compile(r"\d")
_LONGEST = 40
"""Characters; what is longer explains something."""


def read_room_names(root: Path, path: Path | None) -> tuple[list[PlanText], list[Finding]]:
    """Read a floor's table of rooms: name, x, y; nothing where there is none, findings where it is wrong."""
    if path is None:
        return [], []
    name = path.relative_to(root).as_posix()
    try:
        table = read_site_table(root, path, columns=ROOMS)
    except OSError as error:
        return [], [unreadable_file(name, error, "rooms keep the names of the plan")]
    if (problem := table.missing_columns(ROOMS)) is not None:
        return [], [Finding(kind="malformed_header", file=name, count=1, message=problem, lines=table.header_lines)]
    found: dict[int, PlanText] = {}
    for line, fields in table.rows:
        with suppress(ValueError):
            x, y = (finite_or_none(table.cell(fields, axis)) for axis in ("x", "y"))
            if fields[0] and x is not None and y is not None:
                found[line] = PlanText(fields[0], (x, y))
    wrong = [line for line, _ in table.rows if line not in found]
    message = "these rows have no name, or no x and y in metres; they are skipped: correct them"
    return list(found.values()), [*table.findings, *at_lines_if("malformed_lines", name, wrong, message)]


def names_on_plan(plan: FloorPlan) -> list[PlanText]:
    """Names of rooms on a plan: of its polygons, then texts, those with a number first, as rooms have."""
    polygons = [
        PlanText(each.name, _inner_point(each)) for each in plan.polygons if each.name and each.use is Use.WALKABLE
    ]
    texts = [
        PlanText(text, one.place_m) for one in plan.texts if (text := " ".join(one.text.split())) and _is_name(text)
    ]
    return polygons + sorted(texts, key=lambda one: _NUMBER.search(one.text) is None)


def _inner_point(polygon: PlanPolygon) -> tuple[float, float]:
    point = Polygon(polygon.outline, polygon.holes).representative_point()
    return float(point.x), float(point.y)


def _is_name(text: str) -> bool:
    """Whether a text may be a room's name: no dimension with its unit, no sentence."""
    return len(text) <= _LONGEST and not _SIZE.fullmatch(text)


TRACES, INFO_FILE, PLAN, OUTLINES = "path_data_files", "floor_info.json", "floor_image.png", "geojson_map.json"
SITE_FILES = (f"*/{INFO_FILE}", f"*/{PLAN}", f"*/{OUTLINES}")
UNKNOWN_PHONE = "unknown"
_PHONE = re.compile(r"\b(?:Brand|Model):([^\t\r\n]*)")
HEADER_BYTES = 4096
"""Of a trace's beginning: they name the phone, if it is named at all."""


def is_ilc20_site(root: Path) -> bool:
    """Whether a folder is laid out as one site of the competition: ``F1/path_data_files`` or ``F1/floor_info.json``."""
    return bool(_competition_folders(root))


def ilc20_floors(root: Path) -> tuple[list[Floor], list[Finding]]:
    """Read the floors of a site, sorted by number (F1 is 0, B1 is -1); missing parts of a floor's file are findings."""
    floors, findings = [], _unnumbered(root)
    for number, folder in _competition_folders(root).items():
        width_m = height_m = None
        try:
            extent = read_json(folder / INFO_FILE)["map_info"]
            width_m, height_m = float(extent["width"]), float(extent["height"])
        except (OSError, ValueError, KeyError, TypeError):
            message = (
                'the file cannot be read; expected {"map_info": {"width": ..., "height": ...}}, metres; the '
                "floor's extent is taken from the data"
            )
            name = f"{folder.name}/{INFO_FILE}"
            findings.append(site_finding("floor_without_size", name, message))
        plan, source = _competition_plan(folder, width_m, height_m)
        floors.append(
            Floor(
                number=number,
                name=folder.name,
                width_m=width_m,
                height_m=height_m,
                elevation_m=None,
                plan=plan,
                control_points=ControlPoints((), np.empty((0, 2))),
                source=source,
            )
        )
    return floors, findings


def _competition_plan(
    folder: Path, width_m: float | None, height_m: float | None
) -> tuple[Path | None, PlanSource | None]:
    """The floor's outlines, which show where it can be walked, else its picture; both cover its extent."""
    if width_m is None or height_m is None:
        return None, None
    if (folder / OUTLINES).is_file():
        file = f"{folder.name}/{OUTLINES}"
        return folder / OUTLINES, PlanSource(file=file, extent=Extent(width_m=width_m, height_m=height_m))
    return (folder / PLAN if (folder / PLAN).is_file() else None), None


def ilc20_sessions(root: Path) -> list[tuple[SessionKey, Path]]:
    """List the traces of a site, sorted by key: the device is the phone that a trace's header names."""
    return sorted((SessionKey(number, _phone_of(path), path.stem), path) for number, path in ilc20_traces(root))


def ilc20_traces(root: Path) -> Iterator[tuple[int, Path]]:
    """The traces of a site, each with its floor's number."""
    for number, folder in _competition_folders(root).items():
        for path in (folder / TRACES).glob("*.txt"):
            yield number, path


def _competition_folders(root: Path) -> dict[int, Path]:
    """Folders of floors by number; where two have the same, the first by name."""
    found: dict[int, Path] = {}
    for folder in sorted(entry for entry in root.iterdir() if entry.is_dir()) if root.is_dir() else ():
        number = floor_number(folder.name)
        if number is not None and ((folder / TRACES).is_dir() or (folder / INFO_FILE).is_file()):
            found.setdefault(number, folder)
    return dict(sorted(found.items()))


def _unnumbered(root: Path) -> list[Finding]:
    """Folders with traces whose floor has no number."""
    message = (
        "the folder's name contains no floor number, so its traces are skipped; rename the folder to F1, F2, ... or "
        "B1, ..."
    )
    return [
        site_finding("unknown_floor", traces.parent.name, message, Severity.ERROR)
        for traces in sorted(root.glob(f"*/{TRACES}"))
        if floor_number(traces.parent.name) is None
    ]


def _phone_of(path: Path) -> str:
    try:
        with plain(path).open("rb") as file:
            head = file.read(HEADER_BYTES).decode("utf-8", errors="replace")
    except OSError:
        return UNKNOWN_PHONE
    return " ".join(word.strip() for word in _PHONE.findall(head)) or UNKNOWN_PHONE
