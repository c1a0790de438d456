"""``vislam2tag site``: init, show, write, rebase, walkable."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.options import Replace
from vislam2tag.cli.site_values import floor_part, georeference_part, plan_source
from vislam2tag.cli.site_walkable import WALKABLE_HELP, site_walkable
from vislam2tag.cli.tables import table, table_console
from vislam2tag.common.errors import UsageError
from vislam2tag.common.findings import Finding

if TYPE_CHECKING:
    from vislam2tag.pipeline.site.show import SiteSummary
    from vislam2tag.survey.frame_change import FrameChanges

_CODES = "Exit code: 0 all right, 2 wrong usage or unusable files, or nothing can be written, 130 interrupted."
HELP = """
The site that a survey is of: building, floors, plans, frames (docs/site.md).
"""
INIT_HELP = f"""
Begin a site, or add a floor to it: writes SITE/site.toml.

PLAN is a PNG, JPG, SVG, PDF, DXF, GeoJSON or IMDF file, or a floor's folder of the Indoor Location Competition 2.0; it
is copied into SITE. Its scale: the size of what it shows (--width-m, --height-m), two known points (--point, twice), a
known distance, or metres a unit. DXF files with units, and GeoJSON and IMDF on a site with a georeference, need none.
Without --plan a survey in the published layout is described.

{_CODES}

\b
Examples:
  vislam2tag site init survey --plan ground.pdf --page 2 --floor 0 \\
      --width-m 62.5 --height-m 31
  vislam2tag site init survey --plan first.png --floor 1 \\
      --point 120,840=0,0 --point 1950,850=45.6,0
  vislam2tag site init survey --plan ground.dxf --floor 0 --layer A-WALL \\
      --georeference EPSG:25832,294405,5628801,-12
  vislam2tag site init old-survey
"""
SHOW_HELP = f"""
Show a site: a table of its floors, and with --out a drawing of plans, landmarks, control points, axes and scale.

{_CODES}

\b
Examples:
  vislam2tag site show survey
  vislam2tag site show survey --floor 1 --out floor-1.pdf
"""
WRITE_HELP = f"""
Write a site in the published layout: floor_dimensions.csv, and each floor's plan, marker_dict.csv and refmarker.csv.

The origin of that layout is the lower left corner of the plan: positions move there, and rebase.toml says by how
much. Sessions are not copied.

{_CODES}

\b
Example:
  vislam2tag site write survey --out published
"""
REBASE_HELP = f"""
Carry labels, fingerprints or landmarks over to a new plan, origin or resurvey. What is there stays as it is.

SOURCE is an output folder of process, a data set, a site, or a file with landmarks of several floors. The change of
each floor, a similarity and a rise, is given by --by, or estimated from the landmarks that the sites --from and --to
share; residuals are printed. Positions, covariances, headings and heights change with it, and OUT records the change.

{_CODES}

\b
Examples:
  vislam2tag site rebase labels --from survey --to resurveyed \\
      --out labels-now
  vislam2tag site rebase fingerprints --by rebase.toml --to new-site \\
      --out fingerprints-now
  vislam2tag site rebase survey --by rebase.toml --out new-landmarks
"""
SiteFolder = Annotated[Path, typer.Argument(metavar="SITE", help="Survey folder.")]


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    site = typer.Typer(help=HELP, no_args_is_help=True, rich_markup_mode=None)
    site.command("init", help=INIT_HELP)(_init)
    site.command("show", help=SHOW_HELP)(_show)
    site.command("write", help=WRITE_HELP)(_write)
    site.command("rebase", help=REBASE_HELP)(_rebase)
    site.command("walkable", help=WALKABLE_HELP)(site_walkable)
    app.add_typer(site, name="site")


def _init(
    site: SiteFolder,
    plan: Annotated[Path | None, typer.Option(help="The floor's plan.")] = None,
    floor: Annotated[int | None, typer.Option(help="The floor's number; 1 if not given.")] = None,
    name: Annotated[str, typer.Option(help="The floor's name.")] = "",
    elevation_m: Annotated[float | None, typer.Option(metavar="METRES", help="Of the floor above the zero.")] = None,
    building: Annotated[str, typer.Option(help="Name of the building.")] = "",
    width_m: Annotated[
        float | None, typer.Option(metavar="METRES", help="What the plan shows from left to right.")
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
) -> None:
    from vislam2tag.pipeline.site.init import (
        NewFloor,
        add_floor,
        competition_floor,
        describe_published,
        is_competition_floor,
    )
    from vislam2tag.pipeline.site.show import look_at_site
    from vislam2tag.survey.site_file import SITE_FILE

    earth = None if georeference is None else georeference_part(georeference)
    if plan is None:
        describe_published(site, building, earth)
        typer.echo(f"written: {site / SITE_FILE}")
        _print_site(look_at_site(site))
        return
    if is_competition_floor(plan):
        new = competition_floor(plan, floor)
    else:
        source = plan_source(
            plan.name,
            size=(width_m, height_m),
            lower_left=lower_left,
            points=point or (),
            distance=distance,
            unit_m=unit_m,
            page=page,
            level=level,
            layers=tuple(layer) if layer else None,
            others=others,
            epsg=epsg,
        )
        part = floor_part(number=1 if floor is None else floor, name=name, elevation_m=elevation_m, plan=source)
        new = NewFloor(plan, part)
    add_floor(site, new, building, earth)
    typer.echo(f"floor {new.part.number} added: {site / SITE_FILE}")
    _print_site(look_at_site(site))


def _show(
    site: SiteFolder,
    floor: Annotated[list[int] | None, typer.Option(help="Only this floor; repeatable.")] = None,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw it there: a file named .png, .pdf, .svg or .html.")
    ] = None,
) -> None:
    from vislam2tag.pipeline.site.show import draw_site, look_at_site, title_of

    summary = look_at_site(site, floor or ())
    _print_site(summary)
    if out is not None:
        draw_site(summary, title_of(site), out)
        typer.echo(f"drawn: {out}")


def _write(
    site: SiteFolder,
    out: Annotated[Path, typer.Option(help="Output folder: new, empty or from an earlier run.")],
) -> None:
    from vislam2tag.pipeline.site.write import write_published

    changes, findings = write_published(site, out)
    for change in changes.floors:
        if change.x_m or change.y_m:
            typer.echo(f"floor {change.number}: positions moved by ({change.x_m:g}, {change.y_m:g}) m")
    _print_findings(findings)
    typer.echo(f"written: {out}")


def _rebase(
    source: Annotated[Path, typer.Argument(help="Labels, data set, site or landmark file.")],
    out: Annotated[Path, typer.Option(help="Where the rebased one goes: new, empty or from an earlier run.")],
    to: Annotated[Path | None, typer.Option(metavar="SITE", help="The new site.")] = None,
    old: Annotated[
        Path | None, typer.Option("--from", metavar="SITE", help="The old site; SOURCE itself where that is a site.")
    ] = None,
    by: Annotated[Path | None, typer.Option(metavar="FILE", help="The change, as rebase.toml.")] = None,
    back: Annotated[bool, typer.Option("--back", help="Apply the inverse of the change.")] = False,
    rigid: Annotated[bool, typer.Option("--rigid", help="Estimate no scale.")] = False,
    without: Annotated[
        list[str] | None, typer.Option(metavar="ID", help="Do not estimate by this landmark; repeatable.")
    ] = None,
    building: Annotated[str | None, typer.Option(help="The site's building in a data set of several.")] = None,
    replace: Replace = False,
) -> None:
    from rich.console import Console

    from vislam2tag.pipeline.site.rebase import rebase  # reads data sets: the other commands do without

    changes = _changes(source, to, old, by, rigid, tuple(without or ()))
    changes = changes.inverse if back else changes
    _print_changes(changes)
    try:
        with Console(stderr=True).status("rebasing"):
            kind = rebase(source, out, changes, to, building, replace=replace)
    except KeyboardInterrupt:
        typer.echo(f"interrupted: nothing was written to {out}", err=True)
        raise typer.Exit(130) from None
    typer.echo(f"rebased {kind}: {out}")


def _changes(
    source: Path, to: Path | None, old: Path | None, by: Path | None, rigid: bool, without: tuple[str, ...]
) -> FrameChanges:
    """The change as given, or estimated."""
    from vislam2tag.survey.discover import read_site
    from vislam2tag.survey.frame_change import estimated_changes, read_changes

    if by is not None:
        if old is not None or rigid or without:
            raise UsageError("--by: the change is given; --from, --rigid and --without are for estimating it")
        return read_changes(by)
    if to is None:
        raise UsageError("--to: give the new site, or the change by --by")
    return estimated_changes(read_site(old or source)[0], read_site(to)[0], rigid=rigid, without=without)


def _print_changes(changes: FrameChanges) -> None:
    from rich.markup import escape

    rows = table("Change of frame", ("floor",), ("turn", "scale", "x", "y", "rise", "landmarks", "rms"))
    for change in changes.floors:
        residuals = list(change.residuals_m.values())
        rms_m = (sum(each * each for each in residuals) / len(residuals)) ** 0.5 if residuals else None
        rows.add_row(
            str(change.number),
            f"{change.angle_deg:.4f}°",
            f"{change.scale:.6f}",
            f"{change.x_m:.3f} m",
            f"{change.y_m:.3f} m",
            f"{change.rise_m:.3f} m",
            str(len(residuals)) if residuals else "-",
            "-" if rms_m is None else f"{rms_m:.3f} m",
        )
    console = table_console()
    console.print(rows)
    for change in changes.floors:
        worst = sorted(change.residuals_m.items(), key=lambda item: -item[1])[:3]
        if worst:
            texts = ", ".join(f"{escape(name)} {apart_m:.3f} m" for name, apart_m in worst)
            console.print(
                f"floor {change.number}: fit worst: {texts}; leave out what was moved by --without", soft_wrap=True
            )


def _print_site(summary: SiteSummary) -> None:
    from rich.markup import escape

    rows = table("Floors", ("floor", "name", "plan"), ("elevation", "x", "y", "pixel", "landmarks", "control points"))
    for each in summary.floors:
        floor = each.floor
        left, right, low, high = floor.extent_m or (None, None, None, None)
        rows.add_row(
            str(floor.number),
            escape(floor.name),
            escape(floor.plan.name if floor.plan else "none"),
            "-" if floor.elevation_m is None else f"{floor.elevation_m:g} m",
            "unknown" if left is None else f"{left:.2f} to {right:.2f} m",
            "unknown" if low is None else f"{low:.2f} to {high:.2f} m",
            "-" if each.pixel_m is None else f"{100 * each.pixel_m:.1f} cm",
            f"{each.landmarks}" + (f" ({each.unsurveyed} without position)" if each.unsurveyed else ""),
            str(len(floor.control_points.ids)),
        )
    table_console().print(rows)
    _print_findings(summary.findings)


def _print_findings(findings: tuple[Finding, ...]) -> None:
    from rich.markup import escape

    console = table_console()
    for finding in findings:
        console.print(f"{finding.severity}: {escape(finding.file)}: {escape(finding.message)}", soft_wrap=True)
