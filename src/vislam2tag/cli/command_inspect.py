"""``vislam2tag inspect``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.records import argument, command
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import or_dash, print_table, red
from vislam2tag.cli.terminal import answer, print_line, say
from vislam2tag.common.findings import Finding
from vislam2tag.common.judgement import Answer

if TYPE_CHECKING:
    from rich.text import Text

    from vislam2tag.sessions.inspection import FloorOverview, Inspection, SessionOverview


_COLOURS = {"error": "red", "warning": "yellow", "info": "cyan"}


@command
def inspect_command(
    *,
    survey: Path = argument("Survey folder (with floor_K/DEVICE/SESSION below)."),
    json: AsJson = False,
    config: ConfigFile = None,
    use_planned: bool | None = setting("survey.use_planned"),
) -> None:
    """Show what is in a survey and what is wrong with it, without mapping anything.

    Lists floors, sessions and all findings: which file, which lines, what was done about it. Nothing is written.

    Exit code: 0 nothing is wrong (warnings are no failure), 1 a finding is an error, a session cannot be read or does
    not have what mapping needs, or all are excluded, 2 not a survey.

    \b
    Examples:
      vislam2tag inspect survey
      vislam2tag inspect survey --json > survey.json
    """
    from vislam2tag.sessions.inspection import inspect_survey

    settings = settings_of(config, {"survey.use_planned": use_planned}, survey)
    with session_bar("sessions") as bar:
        inspection = inspect_survey(survey, settings.findings, progress=bar.reach, survey_settings=settings.survey)
    answer(inspection, json, lambda: _print(inspection, survey), failed=not inspection.usable)


def _print(inspection: Inspection, survey: Path) -> None:
    _print_floors(inspection.floors)
    _print_sessions(inspection.sessions)
    groups = [("site", inspection.findings)]
    groups += [(f"floor {s.floor} / {s.device} / {s.session}", s.findings) for s in inspection.sessions]
    for session in inspection.sessions:
        if session.error:
            print_line("cannot be read", "bold red", session.error)
    for title, findings in groups:
        if findings:
            print_line(title, "bold", "")
        for finding in findings:
            _print_finding(finding)
    say(f"sessions: {len(inspection.sessions)}, findings: {sum(len(findings) for _, findings in groups)}")
    say(inspection.judgement.sentence)
    after = "inspect, excluded" if inspection.judgement.answer is Answer.NOT_LOOKED_AT else "inspect, unusable"
    next_step("inspect" if inspection.usable else after, survey=survey, corrections=survey / "corrections.toml")


def _print_floors(floors: Iterable[FloorOverview]) -> None:
    from vislam2tag.site.landmark_states import LandmarkCounts

    rows = []
    for floor in floors:
        size = "unknown" if floor.width_m is None else f"{floor.width_m:.4g} m x {floor.height_m:.4g} m"
        surveyed = floor.landmarks - floor.landmarks_planned - floor.landmarks_unsurveyed
        counts = LandmarkCounts(surveyed, floor.landmarks_planned, floor.landmarks_unsurveyed)
        name, plan = f"{floor.number}  {floor.name}", floor.plan or "none (metric grid)"
        rows.append((name, plan, size, counts.short, str(floor.control_points), str(floor.sessions)))
    print_table("Floors", ("floor", "plan"), ("size", "landmarks", "control points", "sessions"), rows)


def _print_sessions(sessions: Iterable[SessionOverview]) -> None:
    amounts = ("scans", "sensor rows", "BLE rows", "presses", "findings")
    numbers = ("frames", "duration", "rate", "landmarks or fixes", *amounts)
    rows = [(str(each.floor), each.device, each.session, *_session_cells(each)) for each in sessions]
    print_table("Sessions", ("floor", "device", "session"), numbers, rows)


def _session_cells(session: SessionOverview) -> tuple[str | Text, ...]:
    if session.excluded:
        return ("excluded",)
    if session.error:
        return (red("cannot be read"),)
    places = f"{session.landmarks_surveyed} of {len(session.landmarks_seen)} surveyed"
    findings = str(len(session.findings))
    return (
        f"{session.frames:,}",
        f"{session.duration_s:.0f} s",
        or_dash(session.frame_rate_hz, "{:.1f} Hz"),
        places if session.fixes is None else f"{session.fixes} fixes",
        f"{session.wifi_scans:,}",
        f"{session.sensor_rows:,}",
        or_dash(session.ble_rows, "{:,}"),
        str(session.presses),
        findings if session.usable else red(findings),
    )


def _print_finding(finding: Finding) -> None:
    lines = ", ".join(map(str, finding.lines)) + (", ..." if finding.count > len(finding.lines) else "")
    count = f"{finding.count:,} x" if finding.count > 1 else ""
    place = f"lines {lines}:" if finding.lines else ""
    text = " ".join(filter(None, (count, finding.file, place, finding.message)))
    print_line(f"  {finding.kind}", _COLOURS[finding.severity.value], text)
