"""A progress bar over sessions on a terminal, and a line for each session that fails anywhere."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from vislam2tag.cli.terminal import visible_console

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress


class SessionBar:
    """Counts sessions; make it by :func:`session_bar`."""

    def __init__(self, console: Console, bar: Progress) -> None:
        self._console, self._bar = console, bar
        self._task = bar.add_task("", total=None, rate="")
        self._rows = 0
        self.done = 0
        """Sessions finished so far."""
        self.failed = 0
        """Those of them, and other things, that failed."""

    def advance(self, total: int, error: str | None, rows: int = 0) -> None:
        """Count one finished session of ``total``, and say why it failed if it did; ``rows`` are those written."""
        self.done += 1
        self._rows += rows
        elapsed_s = max(self._bar.tasks[0].elapsed or 0.0, 0.1)
        if error:
            self.fail(error)
        rate = f"{self.done / elapsed_s:.1f} sessions/s, {self._rows / elapsed_s:,.0f} rows/s" if self._rows else ""
        self._bar.update(self._task, advance=1, total=total, rate=rate + f", {self.failed} failed" * bool(self.failed))

    def fail(self, error: str) -> None:
        """Count a failure and say why."""
        self.failed += 1
        self.print_line("failed", "red", error)

    def print_line(self, what: str, colour: str, text: str) -> None:
        """Print a line above the bar."""
        from rich.text import Text

        self._console.print(Text(f"{what} ", f"bold {colour}") + Text(text), soft_wrap=True)


@contextmanager
def session_bar(name: str) -> Iterator[SessionBar]:
    """Show a bar on standard error while sessions are worked at; ``name`` is what is counted."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    console = visible_console(stderr=True)
    rate = TextColumn("{task.fields[rate]}")
    columns = (TextColumn(name), BarColumn(), MofNCompleteColumn(), rate, TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        yield SessionBar(console, bar)
