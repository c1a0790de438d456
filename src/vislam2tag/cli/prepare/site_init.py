"""``vislam2tag site init``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.prepare.site_values import floor_part, georeference_part, plan_source
from vislam2tag.cli.tables import print_site, site_record
from vislam2tag.cli.terminal import say, say_json
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from vislam2tag.pipeline.site.show import SiteSummary
    from vislam2tag.survey.plans.source import PlanSource

SITE_CODES = "Exit code: 0 all right, 2 wrong usage or unusable files, or nothing can be written, 130 interrupted."
INIT_HELP = f"""
Begin a site, or add a floor to it: writes SITE/site.toml.

PLAN is a PNG, JPG, SVG, PDF, DXF, GeoJSON or IMDF file, or a floor's folder of the Indoor Location Competition 2.0; it
is copied into SITE. Its scale: the size of what it shows (--width-m, --height-m), two known points (--point, twice), a
known distance (--measure writes a page to click it on), the scale on paper (--scale 1:100), or metres a unit. DXF files
with units, and GeoJSON and IMDF on a site with a georeference, need none. Of a page with a frame, the drawing in it is
taken (--area).
Without --plan a survey in the published layout is described.

{SITE_CODES}

\b
Examples:
  vislam2tag site init survey --plan ground.pdf --page 2 --floor 0 \\
      --width-m 62.5 --height-m 31
  vislam2tag site init survey --plan first.pdf --floor 1 --scale 1:100
  vislam2tag site init survey --plan first.svg --measure scale.html
  vislam2tag site init survey --plan first.png --floor 1 \\
      --point 120,840=0,0 --point 1950,850=45.6,0
  vislam2tag site init survey --plan ground.dxf --floor 0 --layer A-WALL \\
      --georeference EPSG:25832,294405,5628801,-12
  vislam2tag site init old-survey
"""
_LARGEST_M = 1000.0
"""Few buildings are larger; more drawings are in other units than was thought."""
_PAGE = "page"
"""``--area``: all of it."""


def site_init(
    site: Annotated[Path, typer.Argument(metavar="SITE", help="Survey folder.")],
    plan: Annotated[Path | None, typer.Option(help="The floor's plan.")] = None,
    floor: Annotated[int | None, typer.Option(help="The floor's number; 1 if not given.")] = None,
    name: Annotated[str, typer.Option(help="The floor's name.")] = "",
    elevation_m: Annotated[float | None, typer.Option(metavar="METRES", help="Of the floor above the zero.")] = None,
    building: Annotated[str, typer.Option(help="Name of the building.")] = "",
    width_m: Annotated[
        float | None, typer.Option(metavar="METRES", help="What the plan shows from left to right; alone will do.")
    ] = None,
    height_m: Annotated[
        float | None, typer.Option(metavar="METRES", help="What the plan shows from bottom to top.")
    ] = None,
    lower_left: Annotated[
        str | None,
        typer.Option(metavar="X,Y", help="BCS coordinates of the plan's lower left corner; 0,0 if not given."),
    ] = None,
    point: Annotated[
        list[str] | None, typer.Option(metavar="PX,PY=X,Y", help="A point in the plan's units and the BCS; give two.")
    ] = None,
    distance: Annotated[
        str | None, typer.Option(metavar="X,Y,X,Y,METRES", help="Two points of the plan and how far they are apart.")
    ] = None,
    scale: Annotated[
        str | None, typer.Option(metavar="1:N", help="Scale on paper, of a PDF, or an SVG in mm, cm, in, pt or pc.")
    ] = None,
    area: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,X,Y",
            help="Two corners of what the building is of a picture or page, in the plan's units; page: all of it.",
        ),
    ] = None,
    stretch: Annotated[
        bool, typer.Option("--stretch", help="Take width and height though the plan has another shape.")
    ] = False,
    measure: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write no site but an HTML page to click a known distance on, and open it."),
    ] = None,
    unit_m: Annotated[
        float | None, typer.Option(metavar="METRES", help="A unit of the file, whose axes are the BCS's.")
    ] = None,
    page: Annotated[int | None, typer.Option(help="Page of a PDF; 1 if not given.")] = None,
    level: Annotated[str | None, typer.Option(help="Level of an IMDF archive: id, ordinal or short name.")] = None,
    layer: Annotated[
        list[str] | None, typer.Option(help="Layer of a DXF that holds walls (* and ?); repeatable.")
    ] = None,
    others: Annotated[
        str | None, typer.Option(metavar="USE", help="Polygons that do not say their use: walkable or obstacle.")
    ] = None,
    epsg: Annotated[int | None, typer.Option(help="Reference system of the plan's own coordinates.")] = None,
    georeference: Annotated[
        str | None,
        typer.Option(
            metavar="PLACE",
            help="Of the site's origin: EPSG:CODE,EASTING,NORTHING,ROTATION or LATITUDE,LONGITUDE,BEARING.",
        ),
    ] = None,
    json: AsJson = False,
) -> None:
    """Run the command."""
    from vislam2tag.pipeline.site.init import (
        NewFloor,
        add_floor,
        competition_floor,
        describe_published,
        is_competition_floor,
    )
    from vislam2tag.pipeline.site.plan_scale import settled_source
    from vislam2tag.pipeline.site.show import summarise_site
    from vislam2tag.survey.site_file import SITE_FILE

    earth = None if georeference is None else georeference_part(georeference)
    if plan is None:
        describe_published(site, building, earth)
        _tell([f"written: {site / SITE_FILE}"], summarise_site(site), site, as_json=json)
        return
    notes: list[str] = []
    if is_competition_floor(plan):
        new = competition_floor(plan, floor)
    elif plan.is_dir():
        raise UsageError(f"--plan {plan}: is a folder; give the file of the floor's plan")
    else:
        source = plan_source(
            plan.name,
            size=(width_m, height_m),
            lower_left=lower_left,
            area=None if area == _PAGE else area,
            scale=scale,
            points=point or (),
            distance=distance,
            unit_m=unit_m,
            page=page,
            level=level,
            layers=tuple(layer) if layer else None,
            others=others,
            epsg=epsg,
        )
        if measure is not None:
            _measure(measure, site, plan, floor, source, as_json=json)
            return
        source, notes = settled_source(plan, source, whole=area == _PAGE, stretch=stretch)
        part = floor_part(number=1 if floor is None else floor, name=name, elevation_m=elevation_m, plan=source)
        new = NewFloor(plan, part)
    add_floor(site, new, building, earth)
    summary = _before_landmarks(summarise_site(site))
    notes += [
        f"floor {each.floor.number} is {each.floor.width_m:g} m wide: were its sizes in metres?"
        for each in summary.floors
        if max(each.floor.width_m or 0.0, each.floor.height_m or 0.0) > _LARGEST_M
    ]
    added = f"floor {new.part.number} added: {site / SITE_FILE}"
    _tell([added, *(f"note: {note}" for note in notes)], summary, site, as_json=json)


def _before_landmarks(summary: SiteSummary) -> SiteSummary:
    """Leave out that floors have no landmarks yet: to plan or measure them is the next step, which is told."""
    from vislam2tag.survey.landmark_file import LANDMARK_FILE

    kept = [one for one in summary.findings if one.kind != "missing_file" or Path(one.file).name != LANDMARK_FILE]
    return replace(summary, findings=tuple(kept))


def _tell(lines: list[str], summary: SiteSummary, site: Path, *, as_json: bool) -> None:
    if as_json:
        say_json(site_record(summary) | {"notes": lines})
        return
    for line in lines:
        say(line)
    print_site(summary)
    next_step("site init", site=site)


def _measure(page: Path, site: Path, plan: Path, floor: int | None, source: PlanSource, *, as_json: bool) -> None:
    import shlex
    import sys
    import webbrowser

    from vislam2tag.views.click_pages import write_measure_page

    words = ["vislam2tag", "site", "init", str(site), "--plan", str(plan)]
    words += [] if floor is None else ["--floor", str(floor)]
    words += [] if source.page == 1 else ["--page", str(source.page)]
    write_measure_page(page, plan, source, shlex.join(words))
    if as_json:
        say_json({"page": page})
        return
    next_step("site init, measure", page=page)
    if sys.stdout.isatty():
        webbrowser.open(page.resolve().as_uri())
