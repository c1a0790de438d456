"""``vislam2tag plan``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import INTERRUPTED, AsJson, Floors, FollowLinks
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import table, table_console
from vislam2tag.cli.terminal import say, say_json
from vislam2tag.common.errors import UsageError
from vislam2tag.survey.sheet_size import sheet_size

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.planning.records import FloorPlanRecord, PlanSummary


HELP = """
Plan where landmarks stand: as few as can be, so that every walk passes one after each critical turn and never goes
farther than a set distance without one.

Reads the site's plans. Landmarks that the site has already stay where they are; new ones hang on walls that a
passer-by faces, off doors and corners, on sheets large enough to be recognised in passing. Writes P/landmarks.csv,
each floor's plan with the tour to walk, a map of the label sigma to expect with what further landmarks would gain (PNG
and PDF), plan.json and index.html. docs/explanation/planning.md tells how.

Exit code: 0 all right, 1 some demand cannot be met (a line says which), 2 wrong usage, no site, a floor that cannot be
planned, or P cannot be written, 130 interrupted.

\b
Examples:
  vislam2tag plan site --out plan
  vislam2tag plan site --floor 3 --spacing-m 12 --sheet A4 --out plan
  vislam2tag plan site --forbid glass.csv --first-id 101 --out plan --write
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("plan", help=HELP)(_plan)


def _plan(
    site: Annotated[Path, typer.Argument(help="Site or survey folder (with site.toml or floor_K below).")],
    out: Annotated[Path, typer.Option(metavar="P", help="Folder to write: new, empty or with plans.")],
    floor: Floors = None,
    spacing_m: Annotated[float | None, setting("plan.spacing_m")] = None,
    sheet: Annotated[
        list[str] | None,
        typer.Option(metavar="SIZE", help="Size of paper to choose from; repeatable. [default: A4, A3]"),
    ] = None,
    forbid: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Rectangles without landmarks: CSV with floor,x0,y0,x1,y1, metres."),
    ] = None,
    mask: Annotated[
        Path | None, typer.Option(metavar="IMAGE", help="With one --floor: green can be walked, red cannot.")
    ] = None,
    anew: Annotated[
        bool,
        typer.Option(
            "--anew",
            help="Leave the landmarks that the site has out of account; --write then adds to them all the same.",
        ),
    ] = False,
    rooms: Annotated[bool | None, setting("plan.rooms")] = None,
    view_deg: Annotated[
        tuple[float, float] | None,
        typer.Option(metavar="LONG SHORT", help="The camera's angles of view, degrees.  [default: 67 53]"),
    ] = None,
    nearest_m: Annotated[float | None, setting("plan.camera.nearest_m")] = None,
    speed_m_s: Annotated[float | None, setting("plan.speed_m_s")] = None,
    further: Annotated[int | None, setting("plan.further")] = None,
    first_id: Annotated[int, typer.Option(min=0, help="New landmarks are numbered from this on.")] = 1,
    time_limit_s: Annotated[float | None, setting("plan.time_limit_s")] = None,
    follow_links: FollowLinks = False,
    json: AsJson = False,
    config: ConfigFile = None,
    write: Annotated[
        bool, typer.Option("--write", help="Also add the new landmarks to the site's marker_dict.csv files.")
    ] = False,
) -> None:
    from vislam2tag.pipeline.site.plan import LANDMARKS_FILE, PAGE_FILE, PlanRequest, write_plans
    from vislam2tag.planning.floor import STEPS

    if view_deg is not None and not all(10 <= angle <= 170 for angle in view_deg):
        raise UsageError(f"--view-deg {view_deg[0]:g} {view_deg[1]:g}: angles of view lie between 10 and 170 degrees")
    settings = settings_of(
        config,
        {
            "plan.spacing_m": spacing_m,
            "plan.sheets": None if sheet is None else tuple(sheet_size(name).name for name in sheet),
            "plan.rooms": rooms,
            "plan.camera.field_of_view_rad": view_deg and tuple(round(math.radians(angle), 4) for angle in view_deg),
            "plan.camera.nearest_m": nearest_m,
            "plan.speed_m_s": speed_m_s,
            "plan.further": further,
            "plan.time_limit_s": time_limit_s,
        },
        site,
    )
    request = PlanRequest(tuple(floor or ()), first_id, anew, forbid, mask, write, settings.walkable, follow_links)
    try:
        with session_bar("steps") as bar:
            result = write_plans(
                site,
                out,
                settings.plan,
                request,
                lambda _step, floors: bar.advance(floors * (len(STEPS) + 1), error=None),
            )
    except KeyboardInterrupt:
        say(f"interrupted: {out} holds no new plans", err=True)
        raise typer.Exit(INTERRUPTED) from None
    unmet = any(one.unmet for one in result.floors)
    if json:
        say_json(result)
    else:
        _print(result, out, write)
        next_step("plan, unmet" if unmet else "plan", page=out / PAGE_FILE, landmarks=out / LANDMARKS_FILE)
    raise typer.Exit(1 if unmet else 0)


def _print(result: PlanSummary, out: Path, write: bool) -> None:
    from rich.markup import escape

    from vislam2tag.pipeline.site.plan import PAGE_FILE

    console = table_console()
    console.print(_table(result))
    for floor in result.floors:
        for note in _notes(floor):
            console.print(f"floor {floor.floor}: {escape(note)}", soft_wrap=True)
    for finding in result.findings:
        console.print(f"{finding.severity}: {escape(finding.file)}: {escape(finding.message)}", soft_wrap=True)
    if write:
        console.print(
            "the new landmarks are in the site's marker_dict.csv files as planned; commands that map walks use them "
            "once they are measured (vislam2tag register), or with --use-planned",
            soft_wrap=True,
        )
    console.print(f"page: {escape(str(out / PAGE_FILE))}", soft_wrap=True)


def _table(result: PlanSummary) -> Table:
    from rich.markup import escape

    numbers = ("corridors", "new", "fixed", "at least", "above", "longest gap", "expected error", "tour", "time")
    rows = table("Landmarks", ("floor",), numbers)
    for floor in result.floors:
        rows.add_row(
            escape(f"{floor.floor} {floor.name}"),
            f"{floor.corridors_m:.0f} m",
            str(len(floor.landmarks)),
            str(len(floor.fixed)),
            str(floor.bound),
            f"{floor.above_bound:.0%}",
            "-" if floor.longest_m is None else f"{floor.longest_m:.1f} m",
            "-" if floor.expected_error_m is None else f"{floor.expected_error_m:.2f} m",
            f"{floor.tour.length_m:.0f} m",
            f"{floor.tour.duration_s / 60:.0f} min",
        )
    return rows


def _notes(floor: FloorPlanRecord) -> list[str]:
    notes = [finding.message for finding in floor.findings] + [unmet.message for unmet in floor.unmet]
    if floor.not_passed:
        notes.append(f"no way leads past landmark {', '.join(floor.not_passed)}")
    if floor.on_a_line:
        notes.append(f"next to one line with their neighbours: landmark {', '.join(floor.on_a_line)}")
    if floor.cut_short:
        notes.append("the time limit ended the search; --time-limit-s takes longer")
    return notes
