"""``vislam2tag plan``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.options import INTERRUPTED, Floors, wrong_values_told
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.tables import table, table_console
from vislam2tag.common.errors import UsageError
from vislam2tag.planning.settings import CameraSettings, PlanSettings
from vislam2tag.survey.sheet_size import sheet_size

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.planning.records import FloorPlanRecord, PlanSummary

DEFAULTS = PlanSettings()
HELP = """
Plan where landmarks stand: as few as can be, so that every walk passes one after each critical turn and never goes
farther than a set distance without one.

Reads the site's plans. Landmarks that the site has already stay where they are; new ones hang on walls that a
passer-by faces, off doors and corners, on sheets large enough to be recognised in passing. Writes P/landmarks.csv,
each floor's plan with the tour to walk, a map of the label sigma to expect with what further landmarks would gain (PNG
and PDF), plan.json and index.html. docs/planning.md tells how.

Exit code: 0 all right, 1 some demand cannot be met and it is told where, 2 wrong usage, no site, a floor that cannot be
planned, or P cannot be written, 130 interrupted.

\b
Examples:
  vislam2tag plan site --out plan
  vislam2tag plan site --floor 3 --spacing 12 --sheet A4 --out plan
  vislam2tag plan site --forbid glass.csv --first-id 101 --out plan --write
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("plan", help=HELP)(_plan)


def _plan(
    site: Annotated[Path, typer.Argument(help="Site or survey folder (with site.toml or floor_K below).")],
    out: Annotated[Path, typer.Option(metavar="P", help="Folder to write: new, empty or with plans.")],
    floor: Floors = None,
    spacing: Annotated[
        float, typer.Option(metavar="M", help="No walk goes farther than this without a landmark, metres.")
    ] = DEFAULTS.spacing_m,
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
    rooms: Annotated[bool, typer.Option("--rooms", help="Rooms are ways like others, with landmarks.")] = False,
    view: Annotated[
        tuple[float, float], typer.Option(metavar="LONG SHORT", help="The camera's angles of view, degrees.")
    ] = (67.0, 53.0),
    nearest: Annotated[
        float, typer.Option(metavar="M", help="Nobody holds the phone nearer to a wall in passing, metres.")
    ] = DEFAULTS.camera.nearest_m,
    speed: Annotated[float, typer.Option(metavar="M/S", help="Walking speed of the tour.")] = DEFAULTS.speed_m_s,
    further: Annotated[int, typer.Option(help="So many further landmarks are proposed.")] = DEFAULTS.further,
    first_id: Annotated[int, typer.Option(min=0, help="New landmarks are numbered from this on.")] = 1,
    time_limit: Annotated[
        float, typer.Option(metavar="S", help="Search for the fewest at most so long a floor, seconds.")
    ] = DEFAULTS.time_limit_s,
    write: Annotated[
        bool, typer.Option("--write", help="Also add the new landmarks to the site's marker_dict.csv files.")
    ] = False,
) -> None:
    from vislam2tag.pipeline.site.plan import PlanRequest, write_plans
    from vislam2tag.planning.floor import STEPS

    if not all(10 <= angle <= 170 for angle in view):
        raise UsageError(f"--view {view[0]:g} {view[1]:g}: angles of view lie between 10 and 170 degrees")
    with wrong_values_told():
        camera = CameraSettings(
            field_of_view_rad=(round(math.radians(view[0]), 4), round(math.radians(view[1]), 4)), nearest_m=nearest
        )
        settings = PlanSettings(
            spacing_m=spacing,
            sheets=tuple(sheet_size(name).name for name in sheet or DEFAULTS.sheets),
            rooms=rooms,
            camera=camera,
            speed_m_s=speed,
            further=further,
            time_limit_s=time_limit,
        )
    request = PlanRequest(tuple(floor or ()), first_id, anew, forbid, mask, write)
    try:
        with session_bar("steps") as bar:
            result = write_plans(
                site, out, settings, request, lambda _step, floors: bar.advance(floors * (len(STEPS) + 1), error=None)
            )
    except KeyboardInterrupt:
        typer.echo(f"interrupted: {out} holds no new plans", err=True)
        raise typer.Exit(INTERRUPTED) from None
    _print(result, out, write)
    raise typer.Exit(1 if any(one.unmet for one in result.floors) else 0)


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
        console.print("the new landmarks are in the site's marker_dict.csv files, until surveyed with a sigma of 0.1 m")
    console.print(f"page: {escape(str(out / PAGE_FILE))}", soft_wrap=True)


def _table(result: PlanSummary) -> Table:
    from rich.markup import escape

    numbers = ("ways", "new", "fixed", "at least", "above", "longest gap", "expected error", "tour", "time")
    rows = table("Landmarks", ("floor",), numbers)
    for floor in result.floors:
        rows.add_row(
            escape(f"{floor.floor} {floor.name}"),
            f"{floor.ways_m:.0f} m",
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
        notes.append("the time limit ended the search; --time-limit takes longer")
    return notes
