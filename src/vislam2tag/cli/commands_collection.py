"""Commands for incoming sessions: ``receive`` and ``inspect``."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag import api
from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, ConfigFile, setting, settings_of
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import or_dash, print_table, red
from vislam2tag.cli.terminal import answer, print_line, say, visible_console
from vislam2tag.common.addresses import EVERYWHERE, code_of, listen, url_for
from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.common.findings import Answer, Finding

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress
    from rich.text import Text

    from vislam2tag.sessions.inspection import FloorOverview, SessionOverview
    from vislam2tag.studio.receiving.uploads import FiledSession
    from vislam2tag.studio.receiving.zips import AppPlace


UNPACKED = 8
"""Factor between ``--max-size-mb`` and the largest unpacked size of a zip."""
MEGABYTE = 1_000_000


@command
def receive_command(
    *,
    survey: Path = argument("Survey folder. Missing floor and device folders are created."),
    zips: tuple[Path, ...] = argument("Session zips to add without starting a server.", (), metavar="[ZIP]..."),
    host: str = option(EVERYWHERE[0], "Address to listen on; 127.0.0.1 for this computer only."),
    port: int = option(8765, "Port to listen on; 0 for any free port.", least=0, most=65535),
    max_size_mb: int = option(1000, "Largest accepted zip, megabytes.", least=1, hidden=True),
    floor: int | None = option(None, "Floor for recordings of other apps."),
    device: str | None = option(None, "Device name for recordings of other apps.", metavar="NAME"),
    json: AsJson = False,
) -> None:
    """Receive sessions from phones and file them as floor_K/DEVICE/SESSION.

    Shows a code for the phone's camera. The phone must be on the same network. Interrupted uploads continue, also after
    a restart. A session is checked before it is filed, and never replaces another one. Press Ctrl-C to stop.

    If you pass ZIP files, these are checked and filed, and no server starts. Zips of other apps such as Stray Scanner,
    Polycam and Sensor Logger are accepted too, see docs/how-to/iphone.md. They do not contain the floor, so pass
    --floor if the survey has several.

    Use a network that you trust, or a hotspot of the phone or computer. The access token is never sent, but the
    sessions are sent unencrypted.

    Exit code: 0 stopped by Ctrl-C or all ZIPs filed, 1 a ZIP was refused, 2 no such folder, or the address is not
    available.

    \b
    Examples:
      vislam2tag receive survey
      vislam2tag receive survey --port 9000
      vislam2tag receive survey 2021-12-20T132523.zip
      vislam2tag receive survey walk-1.zip --floor 2 --device iPhone
    """
    if not survey.is_dir():
        raise SurveyError(f"{survey}: not a folder; pass the survey folder for the sessions")
    from vislam2tag.studio.receiving.zips import app_place

    place = app_place(floor, device)
    if zips:
        from vislam2tag.studio.receiving.uploads import Uploads

        with Uploads(survey, max_size_mb * MEGABYTE, UNPACKED * max_size_mb * MEGABYTE):
            filed = {path: _filed(survey, path, max_size_mb * MEGABYTE, place, tell=not json) for path in zips}
        there = [one for one in filed.values() if one is not None]
    else:
        filed, there = {}, _serve(survey, host, port, max_size_mb * MEGABYTE, place, visible_console(stderr=json))
    refused = [path for path, one in filed.items() if one is None]
    show = lambda: next_step("receive", survey=survey) if there else None
    answer({"filed": there, "refused": refused}, json, show, failed=bool(refused))


def _filed(survey: Path, path: Path, max_bytes: int, place: AppPlace, *, tell: bool) -> FiledSession | None:
    """File one zip and report it; report and return None if it is refused."""
    from vislam2tag.studio.receiving.uploads import file_zip
    from vislam2tag.studio.receiving.zips import RefusedZipError

    try:
        if path.stat().st_size > max_bytes:
            raise RefusedZipError(
                f"larger than {max_bytes // MEGABYTE:,} MB; increase --max-size-mb if that is correct"
            )
        filed = file_zip(survey, path, UNPACKED * max_bytes, place)
    except RefusedZipError as error:
        say(f"refused {path}: {error}", err=True)
        return None
    except OSError as error:
        raise OutputError(f"{error.filename or path}: {error.strerror}") from error
    if tell:
        say(f"{filed.path}: {'already filed' if filed.already else 'filed'}")
    return filed


class _Screen:
    """Shows a bar for each running upload and a line for each session."""

    def __init__(self, bars: Progress) -> None:
        from rich.progress import TaskID

        self._bars, self._tasks = bars, dict[str, TaskID]()
        self.filed_sessions: list[FiledSession] = []

    def received(self, name: str, received: int, length: int) -> None:
        """Move an upload's bar."""
        if name not in self._tasks:
            self._tasks[name] = self._bars.add_task(name[:8], total=length)
        self._bars.update(self._tasks[name], completed=received)

    def filed(self, name: str, filed: FiledSession) -> None:
        """Report a session."""
        self._end(name)
        self.filed_sessions.append(filed)
        what, colour = ("already filed", "yellow") if filed.already else ("filed", "green")
        self._print(what, colour, filed.path)

    def refused(self, address: str, message: str) -> None:
        """Report a refused request."""
        self._print("refused", "red", f"{address}: {message}")

    def _end(self, name: str) -> None:
        task = self._tasks.pop(name, None)
        if task is not None:
            self._bars.remove_task(task)

    def _print(self, what: str, colour: str, text: str) -> None:
        print_line(what, f"bold {colour}", text, self._bars.console)


def _serve(survey: Path, host: str, port: int, max_bytes: int, place: AppPlace, console: Console) -> list[FiledSession]:
    """Receive uploads until Ctrl-C; returns the filed sessions."""
    # Only a server needs these; starting quickly matters to all other commands.
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TransferSpeedColumn

    from vislam2tag.common.serving import serve
    from vislam2tag.studio.receiving.server import Listener, Receiver
    from vislam2tag.studio.receiving.token import Guard, new_token
    from vislam2tag.studio.receiving.uploads import Uploads

    columns = (TextColumn("{task.description}"), BarColumn(), DownloadColumn(), TransferSpeedColumn())
    with (
        listen(host, port) as opened,
        Uploads(survey, max_bytes, UNPACKED * max_bytes, place) as uploads,
        Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bars,
    ):
        token, screen = new_token(), _Screen(bars)
        _welcome(console, url_for(host, opened.getsockname()[1], token), token)
        for waiting in uploads.waiting():
            line = f"an interrupted upload can continue: {waiting.received:,} of {waiting.length:,} bytes received"
            console.out(line, highlight=False)
        listener = Listener(screen.received, screen.filed, screen.refused)
        serve(Receiver(uploads, Guard(token), listener).app(), opened)
    count = sum(not one.already for one in screen.filed_sessions)
    console.out(f"{survey}: {count} session{'' if count == 1 else 's'} received", highlight=False)
    return screen.filed_sessions


def _welcome(console: Console, url: str, token: str) -> None:
    from vislam2tag.studio.receiving.token import grouped

    if console.is_terminal:
        console.out(code_of(url), end="", highlight=False)
    console.out(f"Scan the code with the phone, or open this address on the phone:\n\n    {url}\n", highlight=False)
    console.out(f"    token {grouped(token)}\n\nPress Ctrl-C to stop.", highlight=False)


_COLOURS = {"error": "red", "warning": "yellow", "info": "cyan"}


@command
def inspect_command(
    *,
    survey: Path = argument("Survey folder (with floor_K/DEVICE/SESSION below)."),
    columns: Path | None = option(None, "File, a columns.toml, for the columns of the first walk as they were read."),
    json: AsJson = False,
    config: ConfigFile = None,
    use_planned: bool | None = setting("survey.use_planned"),
) -> None:
    """List what a survey contains and its problems, without mapping it.

    Lists floors, sessions and all findings, with file, lines and how the program handled each. Nothing is written,
    except the file of --columns.

    Exit code: 0 nothing is wrong, 1 a finding is an error, or a session cannot be read or mapped, 2 not a survey, 3 all
    sessions are excluded. Warnings do not change the exit code.

    \b
    Examples:
      vislam2tag inspect survey
      vislam2tag inspect survey --json > survey.json
      vislam2tag inspect survey --columns survey/columns.toml
    """
    settings = settings_of(config, {"survey.use_planned": use_planned}, survey)
    with session_bar("sessions") as bar:
        inspection = api.inspect(survey, settings.findings, progress=bar.reach, survey_settings=settings.survey)
    if columns is not None:
        _write_columns(columns, inspection)
    nothing = inspection.judgement.answer is Answer.NOT_LOOKED_AT
    answer(inspection, json, lambda: _print(inspection, survey), failed=not inspection.usable, nothing=nothing)


def _write_columns(path: Path, inspection: api.Inspection) -> None:
    from vislam2tag.common.files.whole_output import file_to_write

    found = next((session.columns for session in inspection.sessions if session.columns), None)
    if found is None:
        raise UsageError(
            f"--columns {path}: no walk of the survey has tables with columns of other names; expected one"
        )
    with file_to_write(path) as file:
        file.write(found.encode())


def _print(inspection: api.Inspection, survey: Path) -> None:
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
    if inspection.usable:
        off_plan = any(finding.kind == "landmarks_off_plan" for finding in inspection.findings)
        after = "inspect, off plan" if off_plan else "inspect"
    else:
        after = "inspect, excluded" if inspection.judgement.answer is Answer.NOT_LOOKED_AT else "inspect, unusable"
    next_step(after, survey=survey, corrections=survey / "corrections.toml")


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
