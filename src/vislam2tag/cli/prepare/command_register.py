"""``vislam2tag register``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, FollowLinks
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import table, table_console
from vislam2tag.cli.terminal import say, say_json
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from vislam2tag.registration.record import RegisteredPoint, Registration
    from vislam2tag.survey.model import Floor, Site

WORST = 10
"""Residuals shown; the files have all."""
HELP = """
Register: where landmarks hang, from what surveyors measured.

Total-station exports (--station, one file a station) are adjusted together with known points (--control, or landmarks
of the site by --known): least squares, with residuals and a sigma for each landmark. What contradicts the rest is left
out and named: points interchanged, mistyped, or off. Tape distances (--tape, with walls and corners in --targets) and
clicks on the plan (--click writes the page, --clicks reads its file) are cheaper and less exact. Nothing is written
without --out or --write. docs/how-to/registration.md tells formats and method.

Exit code: 0 all right, 1 something was left out, a landmark got no position, two look interchanged, or names do not
match the landmark table (then --write writes nothing), 2 wrong usage, or the measurements do not suffice, 130
interrupted.

\b
Examples:
  vislam2tag register site --floor 1 --station S1.csv --station S2.txt \\
      --control known.csv --out registered
  vislam2tag register site --floor 1 --station S1.csv --known all \\
      --landmark-names 'LM*' --write
  vislam2tag register site --floor 1 --tape tape.csv --targets walls.csv \\
      --write --replace
  vislam2tag register site --floor 1 --click clicks.html
  vislam2tag register site --floor 1 --clicks clicks_floor_1.csv --write
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("register", help=HELP)(_register)


def _register(
    site: Annotated[Path, typer.Argument(help="Site or survey folder.")],
    floor: Annotated[int | None, typer.Option(help="Floor; needed where the site has several.")] = None,
    station: Annotated[
        list[Path] | None, typer.Option(metavar="FILE", help="Export of a total station; repeatable.")
    ] = None,
    control: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Known points in the BCS: point,E,N,H and optional sigma.")
    ] = None,
    known: Annotated[
        list[str] | None, typer.Option(help="A landmark of the site that is known; repeatable; all: every one.")
    ] = None,
    columns: Annotated[
        str | None, typer.Option(help="Columns of the exports, in order: point,E,N,H,code,station; -: not used.")
    ] = None,
    code: Annotated[list[str] | None, typer.Option(help="Use only shots with this point code; repeatable.")] = None,
    landmark_names: Annotated[str, typer.Option(help="How landmarks are named; * is the id.")] = "*",
    control_points: Annotated[str, typer.Option(help="How the floor's control points are named; * is the number.")] = (
        "CP*"
    ),
    ties: Annotated[str, typer.Option(help="How points are named that only tie stations together.")] = "TP*",
    scale: Annotated[str, typer.Option(metavar="fixed|free", help="Whether distances may differ by a factor.")] = (
        "fixed"
    ),
    tape: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Distances: landmark,to,distance_m and optional sigma_m.")
    ] = None,
    targets: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Corners and walls: name,x,y or name,x,y,x2,y2.")
    ] = None,
    clicks: Annotated[Path | None, typer.Option(metavar="FILE", help="Clicks saved by the page of --click.")] = None,
    click: Annotated[
        Path | None, typer.Option(metavar="PAGE.html", help="Write the page to click landmarks on; nothing else.")
    ] = None,
    shot_sigma_m: Annotated[float | None, setting("registration.shot_sigma_m")] = None,
    tape_sigma_m: Annotated[float | None, setting("registration.tape_sigma_m")] = None,
    plan_sigma_m: Annotated[float | None, setting("registration.plan_sigma_m")] = None,
    follow_links: FollowLinks = False,
    json: AsJson = False,
    config: ConfigFile = None,
    out: Annotated[Path | None, typer.Option(metavar="FOLDER", help="Write files, record and figure there.")] = None,
    write: Annotated[bool, typer.Option("--write", help="Write the positions into the site's own files.")] = False,
    replace: Annotated[bool, typer.Option("--replace", help="Let --write replace other positions.")] = False,
) -> None:
    from vislam2tag.pipeline.site import register as registering
    from vislam2tag.registration.names import NameRules
    from vislam2tag.registration.point_file import parse_columns
    from vislam2tag.survey.links import refuse_outside_plan

    whole, chosen = registering.floor_of(site, floor)
    if click is not None:
        if not follow_links:
            refuse_outside_plan(site, chosen)
        _write_page(click, whole, chosen)
        if json:
            say_json({"floor": chosen.number, "page": click})
        else:
            next_step("register, click", page=click, site=site, floor=chosen.number)
        return
    sigmas = {"shot_sigma_m": shot_sigma_m, "tape_sigma_m": tape_sigma_m, "plan_sigma_m": plan_sigma_m}
    settings = settings_of(config, {f"registration.{key}": value for key, value in sigmas.items()}).registration
    if scale not in ("fixed", "free"):
        raise UsageError(f"--scale {scale}: must be fixed or free")
    if out is not None:
        registering.check_out(out, site)
    sources = registering.FloorFiles(
        stations=station or (),
        control=control,
        known=known or (),
        tape=tape,
        targets=targets,
        clicks=clicks,
        columns=None if columns is None else parse_columns(columns),
        codes=code or (),
        rules=NameRules(landmark_names, control_points, ties),
        free_scale=scale == "free",
    )
    found = registering.register(whole, chosen, sources, settings)
    refused = write and found.has_other_names
    written = registering.write_into_site(site, chosen, found, replace=replace) if write and not refused else []
    written += [] if out is None else registering.write_folder(out, site, chosen, found)
    if json:
        say_json(found)
    else:
        _print(found, settings.shot_sigma_m)
        for path in written:
            say(f"written: {path}")
        if refused:
            say("nothing was written into the site: the names are not those of its landmark table")
        next_step(_after(found, write), site=site)
    raise typer.Exit(0 if found.complete else 1)


def _after(found: Registration, write: bool) -> str:
    """Name what to go on with."""
    if found.has_other_names:
        return "register, other names"
    return "register" if write else "register, not written"


def _write_page(page: Path, site: Site, floor: Floor) -> None:
    import numpy as np

    from vislam2tag.views.click_pages import write_click_page

    here = site.landmarks.on_floor(floor.number)
    placed = np.flatnonzero(here.surveyed).tolist()
    expected = {here.ids[i]: (float(here.position_bcs[i, 0]), float(here.position_bcs[i, 1])) for i in placed}
    write_click_page(page, floor, expected, here.ids)


def _print(found: Registration, shot_sigma_m: float) -> None:
    from rich.markup import escape

    console = table_console()
    if found.landmarks or found.control_points:
        console.print(_point_table(found))
    if found.residuals or found.tape_residuals:
        console.print(_residual_table(found))
    for repeat in found.repeats:
        if repeat.spread_m > 3 * shot_sigma_m:
            text = (
                f"{repeat.point}: {repeat.shots} shots from {repeat.station} spread by {1000 * repeat.spread_m:.0f} mm"
            )
            console.print(f"[yellow]repeated[/] {escape(text)}", soft_wrap=True)
    for finding in found.findings:
        place = f"{finding.file}: " if finding.file else ""
        lines = f" (line {', '.join(map(str, finding.lines))})" if finding.lines else ""
        console.print(f"{finding.severity.value} {escape(place + finding.message + lines)}", soft_wrap=True)
    for error in found.errors:
        console.print(f"[bold red]left out[/] {escape(error)}", soft_wrap=True)
    for name, why in found.unplaced.items():
        console.print(f"[bold red]no position[/] landmark {escape(name)}: {escape(why)}", soft_wrap=True)
    _print_summary(console, found)


def _print_summary(console: Console, found: Registration) -> None:
    if found.stations:
        sigma0 = "-" if found.sigma0 is None else f"{found.sigma0:.2f}"
        text = f"{len(found.stations)} stations; sigma0 {sigma0} of {found.redundancy} redundant measurements"
        if found.scale is not None:
            text += f"; scale {found.scale.value:.5f} ± {found.scale.sigma:.5f}"
        console.print(text, soft_wrap=True)
    console.print(
        f"{len(found.landmarks)} landmarks and {len(found.control_points)} control points registered, "
        f"{len(found.unplaced)} without a position, {len(found.errors)} contradictions",
        soft_wrap=True,
    )


def _point_table(found: Registration) -> Table:
    rows = table(
        f"Floor {found.floor} (metres)",
        ("point", "by"),
        ("x", "y", "z", "sigma", "heading", "measurements", "checked"),
    )
    for kind, points in (("", found.landmarks), ("control point ", found.control_points)):
        for one in points:
            rows.add_row(*_cells(kind, one))
    return rows


def _cells(kind: str, one: RegisteredPoint) -> tuple[str, ...]:
    import numpy as np
    from rich.markup import escape

    z = "-" if one.z_m is None else f"{one.z_m:.3f}"
    heading = "-" if one.heading_rad is None else f"{np.degrees(one.heading_rad):.1f}°"
    note = f" ({one.note})" if one.note else ""
    return (
        escape(kind + one.point),
        escape(one.source.value + note),
        f"{one.x_m:.3f}",
        f"{one.y_m:.3f}",
        z,
        f"{one.sigma_m:.3f}",
        heading,
        str(one.measurements),
        f"{100 * one.checked:.0f} %",
    )


def _residual_table(found: Registration) -> Table:
    from rich.markup import escape

    rows = table(f"Greatest residuals of those kept (at most {WORST})", ("measurement",), ("x", "y", "off", "sigmas"))
    every = sorted((*found.residuals, *found.tape_residuals), key=lambda one: -abs(one.sigmas))
    for one in every[:WORST]:
        along = ("-", "-") if one.by_m is None else tuple(_millimetres(value) for value in one.by_m)
        rows.add_row(escape(one.measurement), *along, _millimetres(one.off_m), f"{one.sigmas:.1f}")
    return rows


def _millimetres(value_m: float) -> str:
    return f"{1000 * value_m:.1f} mm"
