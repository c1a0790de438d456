"""``vislam2tag check``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.interrupted import outputs_of_interrupted
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import (
    ALL_CORES,
    AsJson,
    Devices,
    Floors,
    FollowLinks,
    Jobs,
    LandmarkFile,
    SurveyFolder,
    selection_of,
)
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import metres, print_warnings, table, table_console
from vislam2tag.cli.terminal import say, say_json

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.pipeline.run.selection import Selection
    from vislam2tag.self_check.record import BadLandmark, FloorCheck, SessionCheck, SurveyCheck
    from vislam2tag.settings import Settings
    from vislam2tag.walkable.walked.walked_record import WalkedFloor

HELP = """
Check a survey against itself: how good are its labels, which landmarks are bad, where would one more help?

No ground truth is needed. Each surveyed landmark in turn is left out of a session and predicted from the others, by
the smoother. How far the predictions are off, compared with what is stated of them, gives the mean error of the
session's labels (docs/results/self-check.md says how well). Landmarks whose predictions are off alike in all sessions
are named, and on each floor the three places where one more landmark would lower the errors most; and what of the
walkable space of the plans was walked, room by room, which rooms nobody entered, and the walk that would fill it.
Nothing is written but --out.

Exit code: 0 nothing is wrong, 1 a landmark or known position is, a session cannot be read or mapped, or the labels of
none could be judged, 2 wrong usage, not a survey, or the folder cannot be written, 130 interrupted.

\b
Examples:
  vislam2tag check survey
  vislam2tag check survey --out checked --floor 1
  vislam2tag check survey --landmarks completed.csv --max-sigma-m inf
"""


_MOST_ROOMS = 8
"""Rooms named on the terminal; the page and check.json have all."""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("check", help=HELP)(_check)


def _check(
    survey: SurveyFolder,
    out: Annotated[
        Path | None,
        typer.Option(metavar="FOLDER", help="Write check.json and check.html, with maps, there."),
    ] = None,
    landmarks: LandmarkFile = None,
    floor: Floors = None,
    device: Devices = None,
    follow_links: FollowLinks = False,
    jobs: Jobs = ALL_CORES,
    json: AsJson = False,
    config: ConfigFile = None,
    max_sigma_m: Annotated[float | None, setting("labels.max_sigma_m")] = None,
    use_planned: Annotated[bool | None, setting("survey.use_planned")] = None,
) -> None:
    from vislam2tag.pipeline.labels.check import CHECK_FILE, PAGE_FILE

    settings = settings_of(config, {"labels.max_sigma_m": max_sigma_m, "survey.use_planned": use_planned}, survey)
    selection = selection_of(floor, device)
    with outputs_of_interrupted(*(() if out is None else (out / CHECK_FILE, out / PAGE_FILE))):
        found = _with_progress(survey, settings, out, landmarks, selection, follow_links, jobs)
    after = _after(found)
    if json:
        say_json(found)
    else:
        _print(found)
        if out is not None:
            say(f"page: {out / PAGE_FILE}")
        next_step(after, survey=survey)
    raise typer.Exit(0 if after == "check" else 1)


def _after(found: SurveyCheck) -> str:
    """Name what to go on with."""
    from vislam2tag.common.judgement import Answer

    if found.failed or not found.checked:
        return "check, failed"
    return "process, faults" if found.judgement.answer is Answer.WRONG else "check"


def _with_progress(
    survey: Path,
    settings: Settings,
    out: Path | None,
    landmarks: Path | None,
    selection: Selection,
    follow_links: bool,
    jobs: int,
) -> SurveyCheck:
    """Check behind a progress bar; a line on standard error for each session that fails."""
    from vislam2tag.pipeline.labels.check import check

    with session_bar("sessions") as bar:
        return check(
            survey,
            settings,
            out=out,
            landmarks=landmarks,
            selection=selection,
            jobs=jobs,
            walkable=settings.walkable,
            follow_links=follow_links,
            progress=lambda session, total: bar.advance(total, session.error),
            tell=print_warnings,
        )


def _print(found: SurveyCheck) -> None:
    console = table_console()
    console.print(_session_table(found))
    if any(session.stated_m is not None and not session.well_founded for session in found.sessions):
        console.print("(in brackets: fewer than three could be left out, hardly more than what is stated)")
    if found.bad_landmarks:
        console.print(_bad_table(found.bad_landmarks))
    console.print(f"landmarks and known positions: {found.judgement.sentence}", soft_wrap=True, markup=False)
    if any(session.doubtful_fixes for session in found.sessions):
        console.print(_doubtful_table(found.sessions))
    if found.floors:
        console.print(_place_table(found.floors))
    if found.walked:
        console.print(_walked_table(found.walked))
    if any(floor.areas for floor in found.walked):
        console.print(_area_table(found.walked))
    for floor in found.walked:
        for line in _walked_lines(floor):
            console.print(line, soft_wrap=True, markup=False)
    console.print(f"sessions: {len(found.sessions)} ({found.failed} failed)")


def _session_table(found: SurveyCheck) -> Table:
    from rich.markup import escape

    title = f"Mean error of the labels (sigma at most {found.max_sigma_m} m)"
    numbers = (
        "landmarks or fixes",
        "left out",
        "their errors, median",
        "labelled",
        "stated",
        "estimated",
        "90 % interval",
    )
    rows = table(title, ("floor", "device", "session"), numbers)
    for session in found.sessions:
        place = (str(session.floor), escape(session.device), escape(session.session))
        rows.add_row(*place, *_session_cells(session))
    return rows


def _session_cells(session: SessionCheck) -> tuple[str, ...]:
    from vislam2tag.report.pages.check_page import median_left_out_m

    if session.error is not None:
        return ("[red]failed[/]",)
    share = f"{100 * session.labelled / session.frames:.0f} %" if session.frames else "-"
    counted = (
        str(session.landmarks or session.fixes),
        str(len(session.left_out)),
        metres(median_left_out_m(session)),
        share,
    )
    if session.estimated_m is None:
        return (*counted, "-", "-", "-")
    estimated = metres(session.estimated_m)
    return (
        *counted,
        metres(session.stated_m),
        estimated if session.well_founded else f"({estimated})",
        f"{session.low_m:.2f} to {session.high_m:.2f} m",
    )


def _bad_table(found: list[BadLandmark]) -> Table:
    from rich.markup import escape

    from vislam2tag.report.pages.check_page import FAULTS

    rows = table("Bad landmarks", ("floor", "landmark", "what it may be"), ("off by", "sigma", "sessions"))
    for bad in found:
        where = f" ({bad.room})" if bad.room else ""
        place = (str(bad.floor), escape(bad.landmark + where), FAULTS[bad.fault])
        rows.add_row(*place, metres(bad.size_m), metres(bad.sigma_m), str(bad.sessions))
    return rows


def _doubtful_table(sessions: list[SessionCheck]) -> Table:
    from rich.markup import escape

    rows = table(
        "Fixes that the others of their walk contradict", ("floor", "device", "session", "fix"), ("off by", "sigma")
    )
    for session in sessions:
        for fix in session.doubtful_fixes:
            place = (str(session.floor), escape(session.device), escape(session.session), escape(fix.name))
            rows.add_row(*place, metres(fix.size_m), metres(fix.sigma_m))
    return rows


def _place_table(floors: list[FloorCheck]) -> Table:
    from rich.markup import escape

    rows = table("One more landmark", ("floor", "where"), ("x", "y", "mean error now", "then"))
    for floor in floors:
        for place in floor.places:
            then = floor.expected_m - place.gain_m
            rows.add_row(
                str(floor.number),
                escape(place.near),
                f"{place.x_m:.1f} m",
                f"{place.y_m:.1f} m",
                f"{floor.expected_m:.3f} m",
                f"{then:.3f} m",
            )
    return rows


def _walked_table(floors: list[WalkedFloor]) -> Table:
    title = "What of the walkable space of the plan was walked (within 2 m, on foot)"
    rows = table(title, ("floor",), ("walkable", "walked", "scanned", "rooms entered", "walk that fills the rest"))
    for floor in floors:
        if floor.walkable_m2 is None:
            rows.add_row(str(floor.number), "-", "-", "-", "-", "-")
            continue
        entered = len(floor.rooms) - len(floor.never_entered)
        fill = "-" if floor.walk is None else f"{floor.walk.length_m:.0f} m, {floor.walk.minutes:.0f} min"
        shares = (f"{100 * (share or 0.0):.0f} %" for share in (floor.walked, floor.scanned))
        rooms = f"{entered} of {len(floor.rooms)}"
        rows.add_row(str(floor.number), f"{floor.walkable_m2:.0f} m²", *shares, rooms, fill)
    return rows


def _area_table(floors: list[WalkedFloor]) -> Table:
    """Of each floor the rooms and corridors of which most was not walked; the page and check.json have all."""
    from rich.markup import escape

    rows = table(
        "Rooms and corridors with most left to walk", ("floor", "room or corridor"), ("area", "walked", "scanned")
    )
    for floor in floors:
        for area in sorted(floor.areas, key=lambda area: -area.area_m2 * (1 - area.walked))[:_MOST_ROOMS]:
            shares = (f"{100 * share:.0f} %" for share in (area.walked, area.scanned))
            rows.add_row(str(floor.number), escape(area.name), f"{area.area_m2:.0f} m²", *shares)
    return rows


def _walked_lines(floor: WalkedFloor) -> list[str]:
    """Which rooms nobody entered, or why that is not known."""
    if floor.note:
        return [f"floor {floor.number}: {floor.note}"]
    odd = [f"{one.file}: {one.message}" for one in floor.findings]
    missed = [area.name for area in floor.never_entered]
    more = f" and {len(missed) - _MOST_ROOMS} more" if len(missed) > _MOST_ROOMS else ""
    rooms = [f"floor {floor.number}, never entered: {', '.join(missed[:_MOST_ROOMS])}{more}"] if missed else []
    return odd + rooms
