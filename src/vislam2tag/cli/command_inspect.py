"""``vislam2tag inspect``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import table, table_console
from vislam2tag.cli.terminal import say_json, visible_console
from vislam2tag.common.findings import Finding
from vislam2tag.common.judgement import Answer

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.sessions.inspection import FloorOverview, Inspection, SessionOverview
    from vislam2tag.settings import Settings


HELP = """
Show what is in a survey and what is wrong with it, without mapping anything.

Lists floors, sessions and all findings: which file, which lines, what was done about it. Nothing is written.

Exit code: 0 nothing is wrong (warnings are no failure), 1 a finding is an error, a session cannot be read or does not
have what mapping needs, or all are excluded, 2 not a survey.

\b
Examples:
  vislam2tag inspect survey
  vislam2tag inspect survey --json > survey.json
"""

_COLOURS = {"error": "red", "warning": "yellow", "info": "cyan"}


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("inspect", help=HELP)(_inspect)


def _inspect(
    survey: Annotated[Path, typer.Argument(help="Survey folder (with floor_K/DEVICE/SESSION below).")],
    json: AsJson = False,
    config: ConfigFile = None,
    use_planned: Annotated[bool | None, setting("survey.use_planned")] = None,
) -> None:
    inspection = _read_with_progress(survey, settings_of(config, {"survey.use_planned": use_planned}, survey))
    if json:
        say_json(inspection)
    else:
        _print(inspection)
    usable = inspection.usable
    if not json:
        none_read = inspection.judgement.answer is Answer.NOT_LOOKED_AT
        next_step(
            "inspect" if usable else "inspect, excluded" if none_read else "inspect, unusable",
            survey=survey,
            corrections=survey / "corrections.toml",
        )
    raise typer.Exit(0 if usable else 1)


def _read_with_progress(survey: Path, settings: Settings) -> Inspection:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from vislam2tag.sessions.inspection import inspect_survey

    console = visible_console(stderr=True)
    columns = (TextColumn("sessions"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=None)
        return inspect_survey(
            survey,
            settings.findings,
            progress=lambda done, total: bar.update(task, completed=done, total=total),
            survey_settings=settings.survey,
        )


def _print(inspection: Inspection) -> None:
    from rich.markup import escape

    console = table_console()
    console.print(_floor_table(inspection.floors))
    console.print(_session_table(inspection.sessions))
    groups = [("site", inspection.findings)]
    groups += [(f"floor {s.floor} / {s.device} / {s.session}", s.findings) for s in inspection.sessions]
    for session in inspection.sessions:
        if session.error:
            console.print(f"[bold red]cannot be read[/] {escape(session.error)}")
    for title, findings in groups:
        for line in _finding_lines(title, findings):
            console.print(line, soft_wrap=True)
    total = sum(len(findings) for _, findings in groups)
    console.print(f"sessions: {len(inspection.sessions)}, findings: {total}")
    console.print(escape(inspection.judgement.sentence), soft_wrap=True)


def _floor_table(floors: Iterable[FloorOverview]) -> Table:
    from rich.markup import escape

    from vislam2tag.survey.landmark_states import LandmarkCounts

    rows = table("Floors", ("floor", "plan"), ("size", "landmarks", "control points", "sessions"))
    for floor in floors:
        size = "unknown" if floor.width_m is None else f"{floor.width_m:.4g} m x {floor.height_m:.4g} m"
        counts = LandmarkCounts(
            floor.landmarks - floor.landmarks_planned - floor.landmarks_unsurveyed,
            floor.landmarks_planned,
            floor.landmarks_unsurveyed,
        )
        rows.add_row(
            escape(f"{floor.number}  {floor.name}"),
            escape(floor.plan or "none (metric grid)"),
            size,
            counts.short,
            str(floor.control_points),
            str(floor.sessions),
        )
    return rows


def _session_table(sessions: Iterable[SessionOverview]) -> Table:
    from rich.markup import escape

    amounts = ("scans", "sensor rows", "BLE rows", "presses", "findings")
    numbers = ("frames", "duration", "rate", "landmarks or fixes", *amounts)
    rows = table("Sessions", ("floor", "device", "session"), numbers)
    for session in sessions:
        place = (str(session.floor), escape(session.device), escape(session.session))
        rows.add_row(*place, *_session_cells(session))
    return rows


def _session_cells(session: SessionOverview) -> tuple[str, ...]:
    if session.excluded:
        return ("excluded",)
    if session.error:
        return ("[red]cannot be read[/]",)
    rate = "-" if session.frame_rate_hz is None else f"{session.frame_rate_hz:.1f} Hz"
    return (
        f"{session.frames:,}",
        f"{session.duration_s:.0f} s",
        rate,
        _known_places(session),
        f"{session.wifi_scans:,}",
        f"{session.sensor_rows:,}",
        "-" if session.ble_rows is None else f"{session.ble_rows:,}",
        str(session.presses),
        str(len(session.findings)) if session.usable else f"[red]{len(session.findings)}[/]",
    )


def _known_places(session: SessionOverview) -> str:
    if session.fixes is None:
        return f"{session.landmarks_surveyed} of {len(session.landmarks_seen)} surveyed"
    return f"{session.fixes} fixes"


def _finding_lines(title: str, findings: Iterable[Finding]) -> Iterable[str]:
    from rich.markup import escape

    for index, finding in enumerate(findings):
        if index == 0:
            yield f"[bold]{escape(title)}[/]"
        colour = _COLOURS[finding.severity.value]
        lines = ", ".join(map(str, finding.lines)) + (", ..." if finding.count > len(finding.lines) else "")
        file = f" {escape(finding.file)}" if finding.file else ""
        where = f" lines {lines}:" if finding.lines else ""
        count = f" {finding.count:,} x" if finding.count > 1 else ""
        yield f"  [{colour}]{finding.kind}[/]{count}{file}{where} {escape(finding.message)}"
