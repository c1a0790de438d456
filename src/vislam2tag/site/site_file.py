"""``site.toml`` (docs/how-to/site.md) and ``floor_dimensions.csv``: a building's floors, their plans and frames."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Self

from pydantic import Field, FiniteFloat, model_validator

from vislam2tag.common.documentation import page_of
from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.toml_file import read_toml, toml_value
from vislam2tag.common.findings import Finding, FindingKind
from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.core.transforms import Similarity2
from vislam2tag.intake.extents import FLOOR, MAX_LOCAL_M
from vislam2tag.site.georeference import Georeference, georeference_in_grid
from vislam2tag.site.model import landmark_id
from vislam2tag.site.plans.source import PlanSource
from vislam2tag.site.site_table import FLOORS, LineCounts, SiteTable, finite_or_none, read_site_table, unreadable_file

SITE_FILE = "site.toml"
_HEAD = "# The building: its floors, their plans and frames. Entries are explained in {}\n"
_Metres = Annotated[FiniteFloat, Field(ge=-MAX_LOCAL_M, le=MAX_LOCAL_M)]


class Relation(Record):
    """A frame in another: where its origin is, and by how much its x axis is turned counter-clockwise."""

    x_m: _Metres = 0.0
    y_m: _Metres = 0.0
    angle_deg: FiniteFloat = 0.0

    def similarity(self) -> Similarity2:
        """The map from the frame to the other one."""
        angle = math.radians(self.angle_deg)
        return Similarity2(complex(math.cos(angle), math.sin(angle)), complex(self.x_m, self.y_m))


class GeoreferencePart(Record):
    """Where the site's frame is on the earth: in a projected reference system, or by longitude and latitude."""

    epsg: Annotated[int, Field(gt=0)] | None = None
    easting_m: FiniteFloat | None = None
    northing_m: FiniteFloat | None = None
    rotation_deg: FiniteFloat | None = None
    """From grid east to the x axis, counter-clockwise."""
    latitude_deg: Annotated[float, Field(ge=-90, le=90)] | None = None
    longitude_deg: Annotated[float, Field(ge=-180, le=180)] | None = None
    bearing_deg: FiniteFloat | None = None
    """From true north to the y axis, clockwise."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        grid = (self.epsg, self.easting_m, self.northing_m)
        degrees = (self.latitude_deg, self.longitude_deg)
        by_grid = None not in grid and degrees == (None, None) and self.bearing_deg is None
        by_degrees = None not in degrees and grid == (None, None, None) and self.rotation_deg is None
        if not by_grid and not by_degrees:
            raise ValueError(
                "specify either epsg, easting_m, northing_m and rotation_deg, or latitude_deg, longitude_deg and "
                "bearing_deg"
            )
        self.georeference()
        return self

    def georeference(self) -> Georeference:
        """The same as longitude, latitude and bearing; raises ValueError for a system that cannot be used."""
        if self.epsg is not None and self.easting_m is not None and self.northing_m is not None:
            return georeference_in_grid(self.epsg, (self.easting_m, self.northing_m), self.rotation_deg or 0.0)
        assert self.latitude_deg is not None
        assert self.longitude_deg is not None
        return Georeference(
            latitude_deg=self.latitude_deg, longitude_deg=self.longitude_deg, bearing_deg=self.bearing_deg or 0.0
        )


class FloorPart(Record):
    """One floor."""

    number: Annotated[int, Field(ge=-999_999, le=999_999)]
    name: str = ""
    elevation_m: _Metres | None = None
    site_T_bcs: Relation = Relation()
    """The floor's BCS in the frame that all floors share."""
    excluded_rooms: tuple[str, ...] = ()
    """Names of rooms that tours and coverage leave out."""
    plan: PlanSource | None = None


class SiteFile(Result):
    """The whole file."""

    main_table: ClassVar[str] = "floors"

    name: str = ""
    """Of the building."""
    georeference: GeoreferencePart | None = None
    floors: Annotated[tuple[FloorPart, ...], Field(min_length=1)]

    @model_validator(mode="after")
    def _numbers_differ(self) -> Self:
        number, count = Counter(floor.number for floor in self.floors).most_common(1)[0]
        if count > 1:
            raise ValueError(f"floor {number} is given {count} times; give each floor once")
        return self


def has_site_file(root: Path) -> bool:
    """Whether the folder contains a ``site.toml``."""
    return (root / SITE_FILE).is_file()


def read_site_file(root: Path) -> SiteFile:
    """Read a folder's ``site.toml``; raises SurveyError naming file, entry and what was expected."""
    try:
        return read_toml(root / SITE_FILE, SiteFile)
    except FileNotFoundError as error:
        raise SurveyError(f"{root}: contains no {SITE_FILE}; make one with vislam2tag site init") from error


def site_file_text(site: SiteFile) -> str:
    """Write a ``site.toml``; what is as when it is not said is left out."""
    lines = [_HEAD.format(page_of("how-to/site"))]
    if site.name:
        lines += [f"name = {toml_value(site.name)}", ""]
    if site.georeference is not None:
        lines += ["[georeference]", *_entries(site.georeference.model_dump(exclude_none=True)), ""]
    for floor in site.floors:
        said = floor.model_dump(exclude_defaults=True, exclude={"plan"})
        lines += ["[[floors]]", *_entries({"number": floor.number, **said}), ""]
        if floor.plan is not None:
            plan = floor.plan.model_dump(by_alias=True, exclude_defaults=True)
            lines += ["[floors.plan]", *_entries(plan), ""]
    return "\n".join(lines).rstrip("\n") + "\n"


def _entries(values: Mapping[str, object]) -> list[str]:
    return [f"{key} = {toml_value(value)}" for key, value in values.items()]


FLOOR_FILE = "floor_dimensions.csv"

_CONSEQUENCE = "the floors' extents are unknown and are taken from the data"
_MESSAGES: dict[FindingKind, str] = {
    "malformed_lines": (
        "a row needs a whole floor number, and numbers for width and height; these rows are skipped: correct them"
    ),
    "implausible_extent": (
        f"the width and height of a floor must be {FLOOR.least_m:g} to {FLOOR.greatest_m:,.0f} m; these rows are "
        "skipped: write them in metres"
    ),
    "duplicate_floor": "a floor may have only one row; the first is used: remove the others",
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
    counts = LineCounts(FLOOR_FILE)
    floors: dict[int, FloorRow] = {}
    for line, fields in table.rows:
        try:
            number, row = _floor_row(table, fields)
        except ValueError:
            counts.add("malformed_lines", line)
            continue
        if FLOOR.refuses(row.width_m) or FLOOR.refuses(row.height_m):
            counts.add("implausible_extent", line)
        elif number in floors:
            counts.add("duplicate_floor", line)
        else:
            floors[number] = row
    return floors, [*table.findings, *counts.findings(_MESSAGES)]


def _unusable(kind: FindingKind, problem: str, lines: tuple[int, ...] = ()) -> Finding:
    return Finding(kind=kind, file=FLOOR_FILE, count=1, message=f"{problem}; {_CONSEQUENCE}", lines=lines)


def _floor_row(table: SiteTable, fields: tuple[str, ...]) -> tuple[int, FloorRow]:
    width, height, elevation = (finite_or_none(table.cell(fields, name)) for name in ("width", "height", "elevation"))
    if width is None or height is None:
        raise ValueError("width and height must be numbers")
    if elevation is not None and abs(elevation) > MAX_LOCAL_M:
        raise ValueError("no building has so many floors")
    number = int(landmark_id(table.cell(fields, "id")))
    return number, FloorRow(width, height, elevation, table.cell(fields, "name"))
