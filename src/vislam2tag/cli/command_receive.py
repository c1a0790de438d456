"""``vislam2tag receive``: phones hand sessions over."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.terminal import answer, print_line, say, visible_console
from vislam2tag.common.addresses import EVERYWHERE, code_of, listen, url_for
from vislam2tag.common.errors import OutputError, SurveyError

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    from vislam2tag.studio.receiving.filing import FiledSession
    from vislam2tag.studio.receiving.zips import AppPlace


UNPACKED = 8
"""A zip may unpack to this many times ``--max-size-mb``."""
MEGABYTE = 1_000_000


@command
def receive_command(
    *,
    survey: Path = argument("Survey folder; floors and devices that it lacks are made in it."),
    zips: tuple[Path, ...] = argument("Zips of sessions to file.", (), metavar="[ZIP]..."),
    host: str = option(EVERYWHERE[0], "Address to listen on; 127.0.0.1: this computer alone."),
    port: int = option(8765, "Port to listen on; 0: any free one.", least=0, most=65535),
    max_size_mb: int = option(1000, "Greatest zip taken, megabytes.", least=1),
    floor: int | None = option(None, "Floor that recordings of other apps are filed under."),
    device: str | None = option(None, "Device that they are filed under.", metavar="NAME"),
    json: AsJson = False,
) -> None:
    """Receive sessions from phones and file them in the survey, at floor_K/DEVICE/SESSION.

    Shows a code for the phone's camera; the phone must be on the same network. Uploads go on where they broke off, also
    after a restart. A session is checked whole before it appears, and never replaces another one. Ctrl-C ends it.

    With ZIP files (shared by mail or cable) these are checked and filed, and no server is started. Zips that other apps
    share (Stray Scanner, Polycam, Sensor Logger, ...: docs/how-to/iphone.md) are filed, too, from the page or as files;
    they know no floor, so that --floor says it where the survey has several.

    The token is never sent, only proof of it; what the sessions hold is sent as it is. Use a network that you trust, or
    the phone's or the computer's own hotspot, where others should not read them.

    Exit code: 0 ended by Ctrl-C, or all ZIPs filed, 1 a ZIP was refused, 2 no folder, or it cannot be written, or the
    address cannot be listened on.

    \b
    Examples:
      vislam2tag receive survey
      vislam2tag receive survey --port 9000 --max-size-mb 4000
      vislam2tag receive survey 2021-12-20T132523.zip
      vislam2tag receive survey walk-1.zip --floor 2 --device iPhone
    """
    if not survey.is_dir():
        raise SurveyError(f"{survey}: not a folder; name the survey that sessions are filed in")
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
    """File one zip and tell it; tell and return None where it is refused."""
    from vislam2tag.studio.receiving.filing import file_zip
    from vislam2tag.studio.receiving.zips import RefusedZipError

    try:
        if path.stat().st_size > max_bytes:
            raise RefusedZipError(f"larger than {max_bytes // MEGABYTE:,} MB; raise --max-size-mb if that is right")
        filed = file_zip(survey, path, UNPACKED * max_bytes, place)
    except RefusedZipError as error:
        say(f"refused {path}: {error}", err=True)
        return None
    except OSError as error:
        raise OutputError(f"{error.filename or path}: {error.strerror}") from error
    if tell:
        say(f"{filed.path}: {'was there already' if filed.already else 'filed'}")
    return filed


class _Screen:
    """Tells what happens: a bar for each upload that runs, a line for each session."""

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
        """Tell of a session."""
        self._end(name)
        self.filed_sessions.append(filed)
        what, colour = ("there already", "yellow") if filed.already else ("filed", "green")
        self._print(what, colour, filed.path)

    def refused(self, address: str, message: str) -> None:
        """Tell of a request that was refused."""
        self._print("refused", "red", f"{address}: {message}")

    def _end(self, name: str) -> None:
        task = self._tasks.pop(name, None)
        if task is not None:
            self._bars.remove_task(task)

    def _print(self, what: str, colour: str, text: str) -> None:
        print_line(what, f"bold {colour}", text, self._bars.console)


def _serve(survey: Path, host: str, port: int, max_bytes: int, place: AppPlace, console: Console) -> list[FiledSession]:
    """Take uploads until Ctrl-C; returns what was filed."""
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
            line = f"an upload waits to go on: {waiting.received:,} of {waiting.length:,} bytes are here"
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
    console.out(f"Scan the code with the phone, or open this address there:\n\n    {url}\n", highlight=False)
    console.out(f"    token {grouped(token)}\n\nCtrl-C ends it.", highlight=False)
