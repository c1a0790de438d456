"""Progress of a command on standard error, and the message of an interrupted command."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from vislam2tag.cli.exit_codes import ExitCode
from vislam2tag.cli.terminal import print_line, progress_is_shown, say, visible_console
from vislam2tag.common.errors import Vislam2tagError
from vislam2tag.common.files.store import shown

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    from vislam2tag.common.progress import Stage

_LINES = 20
"""Largest number of lines, evenly spread over the sessions."""


class SessionBar:
    """Counts sessions, or other steps; make it by :func:`session_bar`."""

    def __init__(self, console: Console, bar: Progress, name: str, lines: bool) -> None:
        self._console, self._bar, self._lines = console, bar, lines
        self._task = bar.add_task(name, total=None, rate="")
        self._rows = 0
        self._reached = 0.0
        self.done = 0
        """Sessions finished so far."""
        self.failed = 0
        """Number of failures so far."""

    def count(self, _step: object, total: int) -> None:
        """Count one step of ``total`` that cannot fail."""
        self.advance(total, None)

    def enter(self, stage: str) -> None:
        """Start another stage of the work, with its own count."""
        from rich.markup import escape

        name = escape(stage)
        if self._bar.tasks[0].description != name:
            self.done, self._reached = 0, 0.0
            self._bar.reset(self._task, description=name, total=None)

    def step(self, stage: str, total: int, error: str | None = None) -> None:
        """Count one step of ``total`` of a stage, and print why it failed."""
        self.enter(stage)
        self.advance(total, error)

    def show(self, stage: Stage, total: int) -> None:
        """Show the name and progress of a stage."""
        self.enter(stage.name)
        self.reach(stage.done, total)

    def advance(self, total: int, error: str | None, rows: int = 0) -> None:
        """Count one finished session of ``total`` with the rows that it wrote, and print why it failed."""
        self.done += 1
        self._rows += rows
        if error:
            self.fail(error)
        rate = f"{self.done / self._elapsed_s:.1f} sessions/s"
        row_rate = f", {self._rows / self._elapsed_s:,.0f} rows/s" if self._rows else ""
        failed = f", {self.failed} failed" if self.failed else ""
        shown = f"{rate}{row_rate}{failed}" if row_rate else ""
        if self._moves_to(self.done, total, shown):
            line = f"{self.done} of {total} sessions, {rate}{row_rate}{failed}, {self._left_s(total):.0f} s left"
            self._console.print(line, highlight=False)

    def reach(self, done: float, total: int) -> None:
        """Show how many of ``total`` sessions are done, including a part of the current one."""
        if self._moves_to(done, total):
            line = f"{done:.2f} of {total} sessions, {self._left_s(total):.0f} s left"
            self._console.print(line, highlight=False)

    def _moves_to(self, done: float, total: int, rate: str = "") -> bool:
        """Move the bar; True if a line is due on an output that is not a terminal."""
        before, self._reached = self._reached, done
        self._bar.update(self._task, completed=done, total=total, rate=rate)
        return self._lines and done * _LINES // total > before * _LINES // total

    def _left_s(self, total: int) -> float:
        return self._elapsed_s / self._reached * max(total - self._reached, 0)

    @property
    def _elapsed_s(self) -> float:
        return max(self._bar.tasks[0].elapsed or 0.0, 0.1)

    def fail(self, error: str) -> None:
        """Count a failure and print why."""
        self.failed += 1
        self.print_line("failed", "red", error)

    def print_line(self, what: str, colour: str, text: str) -> None:
        """Print a line above the bar."""
        print_line(what, f"bold {colour}", text, self._console)


@contextmanager
def session_bar(name: str, *, lines: bool = False, share: bool = False) -> Iterator[SessionBar]:
    """Show a bar on standard error while sessions are worked at; ``name`` is what is counted.

    With ``lines``, for long work, an output that is not a terminal gets a line now and then. With ``share`` the bar
    shows the share of the work that is done instead of a count.
    """
    from rich import progress

    console = visible_console(stderr=True)
    columns = (
        progress.TextColumn("{task.description}"),
        progress.BarColumn(),
        progress.TaskProgressColumn() if share else progress.MofNCompleteColumn(),
        progress.TextColumn("{task.fields[rate]}"),
        progress.TimeElapsedColumn(),
        progress.TimeRemainingColumn(),
    )
    with progress.Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        yield SessionBar(console, bar, name, lines and progress_is_shown() and not console.is_terminal)


@contextmanager
def interrupted_with(there: str | Callable[[], str]) -> Iterator[None]:
    """End an interrupted block with one line, what is ``there`` then, and the exit code of an interrupt."""
    try:
        yield
    except KeyboardInterrupt:
        say(f"interrupted: {there if isinstance(there, str) else there()}", err=True)
        raise typer.Exit(ExitCode.INTERRUPTED) from None


@contextmanager
def outputs_of_interrupted(*outputs: Path | None) -> Iterator[None]:
    """End an interrupted block with the names of those of its files and folders that were written until then."""
    wanted = [path for path in outputs if path is not None]
    before = [_state(path) for path in wanted]

    def there() -> str:
        written = [shown(path) for path, state in zip(wanted, before, strict=True) if _state(path) != state]
        if written:
            return f"{' and '.join(written)} written; run the same command again"
        return "nothing was written" + (f" to {' or '.join(map(shown, wanted))}" if wanted else "")

    with interrupted_with(there):
        yield


def labels_there(out: Path) -> str:
    """How many sessions an output folder for labels contains, which may be in a store."""
    from vislam2tag.pipeline.run.output import OutputFolder

    with suppress(Vislam2tagError, OSError):
        if count := len(OutputFolder(out).finished()):
            return f"{shown(out)} contains the labels of {count} sessions; run the same command again to go on"
    return f"no session was finished in {shown(out)}"


def contents_there(out: Path, parts: dict[str, str]) -> str:
    """Which parts a folder contains, named by their paths in it."""
    found = [name for path, name in parts.items() if _has_content(out / path)]
    if not found:
        return f"nothing was written to {out}"
    return f"{out} contains {', '.join(found)}; run the same command again to go on"


def _has_content(path: Path) -> bool:
    return any(path.iterdir()) if path.is_dir() else path.exists()


def _state(path: Path) -> object:
    """What changes when a file or folder is written or replaced; None if it does not exist."""
    try:
        stat = path.stat()
    except OSError:
        return None
    return stat.st_ino, stat.st_mtime_ns, stat.st_size
