"""``floor_dimensions.csv``: extent, elevation and name of each floor."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from vislam2tag.common.finding_kinds import FindingKind
from vislam2tag.common.findings import Finding
from vislam2tag.core.limits import MAX_FLOOR_M
from vislam2tag.site.names import landmark_id
from vislam2tag.site.plans.source import GREATEST_M
from vislam2tag.site.site_table import LineCounts, SiteTable, finite_or_none, read_site_table, unreadable_file
from vislam2tag.site.table_columns import FLOORS

FLOOR_FILE = "floor_dimensions.csv"

_CONSEQUENCE = "the floors' extents are unknown and are taken from the data"
_MESSAGES: dict[FindingKind, str] = {
    "malformed_lines": (
        f"a row needs a whole floor number and a width and height from 0 to {MAX_FLOOR_M:,.0f} m; these rows are left "
        "out: correct them"
    ),
    "duplicate_floor": "a floor may have one row; the first counts: remove the others",
}


@dataclass(frozen=True)
class FloorRow:
    """One row of the file: what is known of a floor besides its folder."""

    width_m: float
    height_m: float
    elevation_m: float | None
    name: str


def read_floor_file(root: Path) -> tuple[dict[int, FloorRow], list[Finding]]:
    """Read the floors by number; a missing or damaged file is a finding.

    Columns: ``id``, ``width``, ``height`` (metres) and the optional ``elevation`` (metres) and ``name``.
    """
    try:
        table = read_site_table(root, root / FLOOR_FILE, columns=FLOORS)
    except FileNotFoundError:
        return {}, [_unusable("missing_file", "no such file")]
    except OSError as error:
        return {}, [unreadable_file(FLOOR_FILE, error, _CONSEQUENCE)]
    if (problem := table.missing_columns(FLOORS)) is not None:
        return {}, [_unusable("malformed_header", problem, table.header_lines)]
    counts = LineCounts.of(FLOOR_FILE)
    floors: dict[int, FloorRow] = {}
    for line, fields in table.rows:
        try:
            number, row = _floor_row(table, fields)
        except ValueError:
            counts.add("malformed_lines", line)
            continue
        if number in floors:
            counts.add("duplicate_floor", line)
        else:
            floors[number] = row
    return floors, [*table.findings, *counts.findings(_MESSAGES)]


def _unusable(kind: FindingKind, problem: str, lines: tuple[int, ...] = ()) -> Finding:
    return Finding(kind=kind, file=FLOOR_FILE, count=1, message=f"{problem}; {_CONSEQUENCE}", lines=lines)


def _floor_row(table: SiteTable, fields: tuple[str, ...]) -> tuple[int, FloorRow]:
    width, height, elevation = (finite_or_none(table.cell(fields, name)) for name in ("width", "height", "elevation"))
    if width is None or height is None or not (0 < width <= MAX_FLOOR_M and 0 < height <= MAX_FLOOR_M):
        raise ValueError("width and height must be positive, and no greater than a building")
    if elevation is not None and abs(elevation) > GREATEST_M:
        raise ValueError("no floor lies so high")
    number = int(landmark_id(table.cell(fields, "id")))
    return number, FloorRow(width, height, elevation, table.cell(fields, "name"))
