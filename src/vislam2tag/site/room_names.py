"""What rooms are called: a table of the survey, else the text that stands in them on the plan."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from shapely.geometry import Polygon

from vislam2tag.common.findings import Finding
from vislam2tag.site.plans.model import FloorPlan, PlanPolygon, Use
from vislam2tag.site.site_table import finite_or_none, is_file, read_site_table, unreadable_file
from vislam2tag.site.table_columns import ROOMS

ROOMS_FILE = "rooms.csv"
"""In a floor's folder: name, x and y of rooms, metres in the BCS."""
_SIZE = re.compile(r"\W*[\d.,\s]+(m|cm|mm|m²|m2|qm|ft|sq\.? ?ft)\W*", re.IGNORECASE)
"""A dimension or an area, which is no room's name."""
_NUMBER = re.compile(r"\d")
_LONGEST = 40
"""Characters; what is longer explains something."""


@dataclass(frozen=True)
class RoomName:
    """A name and where it stands, BCS metres."""

    name: str
    place_m: tuple[float, float]


def rooms_of(folder: Path) -> Path | None:
    """The table of rooms that a floor's folder has."""
    path = folder / ROOMS_FILE
    with suppress(PermissionError):  # a locked folder is reported where its sessions are looked for
        return path if is_file(path) else None
    return None


def read_room_names(root: Path, path: Path | None) -> tuple[list[RoomName], list[Finding]]:
    """Read a floor's table of rooms: name, x, y; nothing where there is none, findings where it is wrong."""
    if path is None:
        return [], []
    name = path.relative_to(root).as_posix()
    try:
        table = read_site_table(root, path, columns=ROOMS)
    except OSError as error:
        return [], [unreadable_file(name, error, "rooms keep the names that the plan has")]
    if (problem := table.missing_columns(ROOMS)) is not None:
        return [], [Finding(kind="malformed_header", file=name, count=1, message=problem, lines=table.header_lines)]
    found, wrong = [], []
    for line, fields in table.rows:
        try:
            x, y = (finite_or_none(table.cell(fields, axis)) for axis in ("x", "y"))
        except ValueError:
            x = y = None
        if fields[0] and x is not None and y is not None:
            found.append(RoomName(fields[0], (x, y)))
        else:
            wrong.append(line)
    message = "these rows have no name, or no x and y in metres; they are left out: correct them"
    malformed = [Finding.at_lines("malformed_lines", name, wrong, message)] if wrong else []
    return found, [*table.findings, *malformed]


def names_on_plan(plan: FloorPlan) -> list[RoomName]:
    """Names of rooms on a plan: of its polygons, then texts, those with a number first, as rooms have."""
    polygons = [
        RoomName(each.name, _inner_point(each)) for each in plan.polygons if each.name and each.use is Use.WALKABLE
    ]
    texts = [
        RoomName(text, one.place_m) for one in plan.texts if (text := " ".join(one.text.split())) and _is_name(text)
    ]
    return polygons + sorted(texts, key=lambda one: _NUMBER.search(one.name) is None)


def _inner_point(polygon: PlanPolygon) -> tuple[float, float]:
    point = Polygon(polygon.outline, polygon.holes).representative_point()
    return float(point.x), float(point.y)


def _is_name(text: str) -> bool:
    """Whether a text may be a room's name: no dimension with its unit, no sentence."""
    return len(text) <= _LONGEST and not _SIZE.fullmatch(text)
