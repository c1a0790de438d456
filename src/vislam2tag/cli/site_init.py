"""``vislam2tag site init``: creates a site or adds a floor."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, SiteFolder
from vislam2tag.cli.records import command, option
from vislam2tag.cli.tables import or_dash, print_findings, print_table
from vislam2tag.cli.terminal import answer, say, visible_console
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from pydantic import BaseModel

    from vislam2tag.pipeline.site.plan_report import PlanReport
    from vislam2tag.site.plans.source import PlanSource

    Made = TypeVar("Made", bound=BaseModel)

_PAGE = "page"
"""Value of ``--area`` for the whole page."""
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_POLE_DEG = 90
_POINT = "PX,PY=X,Y: the plan's own coordinates, then metres"


def numbers(count: int, form: str) -> Callable[[str, str], list[float]]:
    """Return a function that reads ``count`` numbers separated by commas."""

    def read(text: str, name: str) -> list[float]:
        numbers = _found(text)
        if numbers is None or len(numbers) != count:
            raise UsageError(f"{name} {text}: expected {form}")
        return numbers

    return read


def _found(text: str) -> list[float] | None:
    parts = [part.strip() for part in text.split(",")]
    return [float(part) for part in parts] if all(_NUMBER.fullmatch(part) for part in parts) else None


def _area(text: str, name: str) -> list[float] | str:
    form = "X,Y,X,Y, two opposite corners in the plan's units, or page"
    return text if text == _PAGE else numbers(4, form)(text, name)


def _scale(text: str, name: str) -> float:
    one, _, number = text.partition(":")
    if one.strip() != "1" or not _NUMBER.fullmatch(number.strip()):
        raise UsageError(f"{name} {text}: expected 1:N as printed on the drawing, such as 1:100")
    return float(number)


def _point(text: str, name: str) -> dict[str, list[float]]:
    plan, _, bcs = text.partition("=")
    read = numbers(2, _POINT)
    return {"plan": read(plan, name), "bcs_m": read(bcs, name)}


def _georeference(text: str, name: str) -> api.GeoreferencePart:
    """Read ``EPSG:CODE,EASTING,NORTHING[,ROTATION]`` or ``LATITUDE,LONGITUDE[,BEARING]``; raises UsageError."""

    system = re.fullmatch(r"EPSG:(\d+),(.*)", text, re.IGNORECASE)
    numbers = _found(system.group(2) if system else text)
    if numbers is None or len(numbers) not in (2, 3):
        form = "EPSG:CODE,EASTING,NORTHING,ROTATION or LATITUDE,LONGITUDE,BEARING"
        raise UsageError(f"{name} {text}: expected {form}")
    if not system and abs(numbers[0]) > _POLE_DEG >= abs(numbers[1]):
        right = ",".join(f"{number:g}" for number in (numbers[1], numbers[0], *numbers[2:]))
        raise UsageError(f"{name} {text}: latitude and longitude are exchanged; pass {right}")
    names = ("easting_m", "northing_m", "rotation_deg") if system else ("latitude_deg", "longitude_deg", "bearing_deg")
    values: dict[str, Any] = dict(zip(names, numbers, strict=False))
    if system:
        values["epsg"] = int(system.group(1))
    return _made(api.GeoreferencePart, values, f"{name} {text}: ")


def _made(kind: type[Made], values: Mapping[str, Any], blamed: str = "") -> Made:
    """Make a record; raises UsageError that names the option for invalid values."""
    from pydantic import ValidationError

    try:
        return kind.model_validate(values)
    except ValidationError as error:
        wrong = error.errors()[0]
        place = ", ".join(str(part) for part in wrong["loc"])
        why = wrong["msg"].removeprefix("Value error, ")
        if place.startswith("extent, ") and "le" in wrong.get("ctx", {}):
            name = str(wrong["loc"][-1]).replace("_", "-")
            raise UsageError(f"--{name} {wrong['input']:g}: must be at most {wrong['ctx']['le']:g} metres") from error
        raise UsageError(f"{blamed}{place}{': ' if place else ''}{why}") from error


@dataclass(frozen=True, kw_only=True)
class InitOptions:
    """Arguments and options of ``vislam2tag site init``."""

    site: SiteFolder
    plan: Path | None = option(None, "Plan of the floor.")
    floor: int | None = option(None, "Number of the floor.  [default: 1]")
    name: str = option("", "Name of the floor.")
    elevation_m: float | None = option(None, "Height of the floor above the zero level.", metavar="METRES", hidden=True)
    building: str = option("", "Name of the building.")
    width_m: float | None = option(None, "Width of the area that the plan shows. Enough by itself.", metavar="METRES")
    height_m: float | None = option(
        None, "Height of the area that the plan shows, in plan direction y.", metavar="METRES"
    )
    lower_left: list[float] | None = option(
        None,
        "Building coordinates of the plan's lower left corner.  [default: 0,0]",
        metavar="X,Y",
        parse=numbers(2, "X,Y in metres"),
    )
    point: tuple[dict[str, list[float]], ...] = option(
        (), "A point in plan units and in building coordinates; pass two.", metavar="PX,PY=X,Y", parse=_point
    )
    distance: list[float] | None = option(
        None,
        "Two points of the plan and their distance.",
        metavar="X,Y,X,Y,METRES",
        parse=numbers(5, "X,Y,X,Y,METRES, the points in the plan's units"),
    )
    scale: float | None = option(
        None, "Scale on paper of a PDF, or of an SVG in mm, cm, in, pt or pc.", metavar="1:N", parse=_scale
    )
    area: list[float] | str | None = option(
        None,
        "Two corners of the building in the image or page, in plan units, or page for all of it.",
        metavar="X,Y,X,Y",
        parse=_area,
    )
    stretch: bool = option(False, "Use width and height even if the plan has another shape.", hidden=True)
    click: Path | None = option(
        None, "Write no site but an HTML page where you click a known distance.", metavar="FILE"
    )
    unit_m: float | None = option(
        None, "Length of a unit of the file, if its axes are those of the building.", metavar="METRES"
    )
    page: int | None = option(None, "Page of a PDF.  [default: 1]")
    level: str | None = option(None, "Level or storey of the file that the plan shows: number or name.", hidden=True)
    walls: tuple[str, ...] = option(
        (), "Layer of a DXF that contains walls, instead of those found by name (* and ? match); repeatable."
    )
    doors: tuple[str, ...] = option(
        (), "Another layer of a DXF that contains doors, even if --walls matches; repeatable."
    )
    ignore: tuple[str, ...] = option((), "Layer or class of the file to leave out, even if others match; repeatable.")
    others: str | None = option(None, "Use of polygons without one: walkable or obstacle.", metavar="USE", hidden=True)
    epsg: int | None = option(None, "Reference system of the plan's own coordinates.", hidden=True)
    georeference: Any = option(
        None,
        "Position of the origin: EPSG:CODE,EASTING,NORTHING,ROTATION or LATITUDE,LONGITUDE,BEARING.",
        metavar="PLACE",
        parse=_georeference,
    )
    json: AsJson = False


@command
def init_command(given: InitOptions) -> None:
    """Create a site or add a floor: writes SITE/site.toml.

    PLAN is a PNG, JPG, SVG, PDF, DXF, GeoJSON, OSM, IMDF or IFC file, an IMDF folder, or a floor folder of the Indoor
    Location Competition 2.0. It is copied into SITE. Specify its scale in one of these ways. Pass its size (--width-m,
    --height-m), two known points (--point, twice), a known distance (--click writes a page to click it), the scale on
    paper (--scale 1:100), or the length of a unit (--unit-m). An IFC file, or a DXF file with units, needs none, and
    neither do GeoJSON, OSM and IMDF files on a site with a georeference. If a page has a frame, only the drawing inside
    it is used (--area). The output lists what each layer or class of the file became, and SITE/floor_K/plan_as_read.png
    shows it; --walls, --doors and --ignore change it. Without --plan, the command describes an existing survey in the
    published layout.

    Exit code: 0 written, 2 wrong usage or unusable files, 130 interrupted.

    \b
    Examples:
      vislam2tag site init survey --plan ground.pdf --page 2 --floor 0 \\
          --width-m 62.5 --height-m 31
      vislam2tag site init survey --plan first.pdf --floor 1 --scale 1:100
      vislam2tag site init survey --plan first.svg --click scale.html
      vislam2tag site init survey --plan first.png --floor 1 \\
          --point 120,840=0,0 --point 1950,850=45.6,0
      vislam2tag site init survey --plan ground.dxf --floor 0 --walls A-WALL \\
          --georeference EPSG:25832,294405,5628801,-12
      vislam2tag site init old-survey
    """
    from vislam2tag.pipeline.site.init import describe_published
    from vislam2tag.site.site_file import SITE_FILE

    file = given.site / SITE_FILE
    if given.plan is None:
        describe_published(given.site, given.building, given.georeference)
        lines, summary, report = [f"written: {file}"], api.site_show(given.site), None
    else:
        new, notes = _new_floor(given, given.plan)
        api.site_init(given.site, new, given.building, given.georeference)
        summary = _before_landmarks(api.site_show(given.site))
        lines = [f"floor {new.part.number} added: {file}", *(f"note: {note}" for note in notes)]
        report = reported(given.site, new.part.number)
    record = site_record(summary) | {"notes": lines, "plan": report}
    answer(record, given.json, lambda: _print(lines, report, summary, given.site))


def reported(site: Path, number: int | None) -> PlanReport:
    """How the plan of a floor is read; no ``number``: of the only floor."""
    from vislam2tag.pipeline.site.plan_report import report_plan

    with visible_console(stderr=True).status("reading the plan"):
        return report_plan(site, number)


def _print(lines: list[str], report: PlanReport | None, summary: api.SiteSummary, site: Path) -> None:
    for line in lines:
        say(line)
    print_site(summary)
    if report is not None:
        print_report(report)
    if report is not None and report.warnings:
        next_step("site init, odd", site=site, floor=report.floor)
    else:
        next_step("site init", site=site)


_NAMED = 8
"""Layers that a line names."""


def print_report(report: PlanReport) -> None:
    """Print what each layer or class of a plan became, and what looks wrong."""
    from vislam2tag.site.plans.taken_parts import Became

    for became in sorted({part.became for part in report.taken}, key=list(Became).index):
        parts = sorted((part for part in report.taken if part.became is became), key=lambda part: -part.count)
        named = [f"{part.name} ({', '.join(filter(None, (part.why, str(part.count))))})" for part in parts[:_NAMED]]
        more = f" and {len(parts) - _NAMED} more" if len(parts) > _NAMED else ""
        say(f"{became}: {', '.join(named)}{more}")
    for warning in report.warnings:
        say(f"warning: {warning}")
    if report.picture is not None:
        say(f"picture of what was taken: {report.picture}")


def _new_floor(given: InitOptions, plan: Path) -> tuple[api.NewFloor, list[str]]:
    """The floor to add, and notes about how its plan is read."""
    from vislam2tag.pipeline.site.init import competition_floor, is_competition_floor, settled_source
    from vislam2tag.site.site_file import FloorPart

    if is_competition_floor(plan):
        return competition_floor(plan, given.floor), []
    source = plan_source(given, plan)
    if given.click is not None:
        _measure(given, plan, source, given.click)
    source, notes = settled_source(plan, source, whole=given.area == _PAGE, stretch=given.stretch)
    if given.lower_left is not None:
        source = _with_corner(plan, source, given.lower_left)
    number = 1 if given.floor is None else given.floor
    values = {"number": number, "name": given.name, "elevation_m": given.elevation_m, "plan": source}
    return api.NewFloor(plan, _made(FloorPart, values)), notes


def _with_corner(plan: Path, source: PlanSource, lower_left_m: list[float]) -> PlanSource:
    """Place the plan's lower left corner, also of a plan with a scale of its own."""
    from vislam2tag.site.plans.drawing import NO_SCALE
    from vislam2tag.site.plans.load import plan_moved

    try:
        return plan_moved(plan, source, (lower_left_m[0], lower_left_m[1]))
    except OSError as error:
        if str(error) == NO_SCALE:
            raise UsageError("--lower-left: also pass --width-m, --height-m, --distance or --scale") from error
        raise UsageError(f"--lower-left: {plan} {error}") from error


def plan_source(given: InitOptions, plan: Path) -> PlanSource:
    """How to read the plan; raises UsageError for options that contradict each other."""
    from vislam2tag.site.plans.source import PlanSource

    own = {name: getattr(given, name) for name in ("unit_m", "page", "level", "others", "epsg")}
    values: dict[str, Any] = {"file": plan.name} | {name: value for name, value in own.items() if value is not None}
    corner = {} if given.lower_left is None else {"lower_left_m": given.lower_left}
    parts = {"layers": given.walls, "doors": given.doors, "ignore": given.ignore}
    values |= {name: names for name, names in parts.items() if names}
    _refuse_two_scales(given)
    if given.width_m is not None or given.height_m is not None:
        values["extent"] = {"width_m": given.width_m, "height_m": given.height_m} | corner
    if given.area is not None and given.area != _PAGE:
        values["area"] = given.area
    if given.scale is not None:
        values["scale"] = {"one_to": given.scale} | corner
    if given.point:
        if len(given.point) != 2:
            raise UsageError(f"--point: two known points are needed, but {len(given.point)} are given")
        values["points"] = given.point
    if given.distance is not None:
        x0, y0, x1, y1, metres = given.distance
        values["distance"] = {"from": (x0, y0), "to": (x1, y1), "metres": metres} | corner
    if given.lower_left is not None and given.point:
        raise UsageError("--lower-left: --point places the plan already; pass one of them")
    return _made(PlanSource, values)


def _refuse_two_scales(given: InitOptions) -> None:
    ways = (("width_m", "height_m"), ("point",), ("distance",), ("scale",), ("unit_m",))
    used = [[name for name in way if getattr(given, name) not in (None, ())] for way in ways]
    named = [f"--{names[0].replace('_', '-')}" for names in used if names]
    if len(named) > 1:
        raise UsageError(f"{' and '.join(named)} give the scale of the plan more than once: keep one of them")


def _before_landmarks(summary: api.SiteSummary) -> api.SiteSummary:
    """Remove findings about missing landmarks: planning them is the next step, which is printed."""
    from vislam2tag.site.landmark_file import LANDMARK_FILE

    kept = [one for one in summary.findings if one.kind != "missing_file" or Path(one.file).name != LANDMARK_FILE]
    return replace(summary, findings=tuple(kept))


def _measure(given: InitOptions, plan: Path, source: PlanSource, page: Path) -> None:
    """Write the page to click a known distance on, open it, and end."""
    import shlex
    import sys
    import webbrowser

    from vislam2tag.views.click_pages import write_measure_page

    words = ["vislam2tag", "site", "init", str(given.site), "--plan", str(plan)]
    words += [] if given.floor is None else ["--floor", str(given.floor)]
    words += [] if source.page == 1 else ["--page", str(source.page)]
    words += [] if source.level is None else ["--level", source.level]
    write_measure_page(page, plan, source, shlex.join(words))

    def show() -> None:
        next_step("site init, measure", page=page)
        if sys.stdout.isatty():
            webbrowser.open(page.resolve().as_uri())

    answer({"page": page}, given.json, show)


def print_site(summary: api.SiteSummary) -> None:
    """Print a site's floors and findings."""
    rows = []
    for each in summary.floors:
        floor = each.floor
        left, right, low, high = floor.extent_m or (None, None, None, None)
        texts = (str(floor.number), floor.name, floor.plan.name if floor.plan else "none")
        sizes = (
            or_dash(floor.elevation_m, "{:g} m"),
            "unknown" if left is None else f"{left:.2f} to {right:.2f} m",
            "unknown" if low is None else f"{low:.2f} to {high:.2f} m",
            "-" if each.pixel_m is None else f"{100 * each.pixel_m:.1f} cm",
        )
        rows.append((*texts, *sizes, each.landmarks.short, str(len(floor.control_points.ids))))
    heads = ("elevation", "x", "y", "pixel", "landmarks", "control points")
    print_table("Floors", ("floor", "name", "plan"), heads, rows)
    print_findings(summary.findings)


def site_record(summary: api.SiteSummary) -> dict[str, Any]:
    """A site's floors and findings, as JSON has them."""
    floors = [
        {
            "floor": each.floor.number,
            "name": each.floor.name,
            "plan": each.floor.plan.name if each.floor.plan else None,
            "elevation_m": each.floor.elevation_m,
            "extent_m": each.floor.extent_m,
            "pixel_m": each.pixel_m,
            "landmarks": each.landmarks.total,
            "planned": each.landmarks.planned,
            "unsurveyed": each.landmarks.without_position,
            "control_points": len(each.floor.control_points.ids),
        }
        for each in summary.floors
    ]
    return {"floors": floors, "findings": summary.findings, "judgement": summary.judgement}
