"""Tables on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from vislam2tag.positioning.benchmark.table_4 import Table4

_PIPE_WIDTH = 140
"""Columns where the output is no terminal."""


def table_console() -> Console:
    """Return a console for tables: as wide as the terminal, or wide enough for a pipe."""
    from rich.console import Console

    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=_PIPE_WIDTH)


def table(title: str, texts: tuple[str, ...], numbers: tuple[str, ...]) -> Table:
    """Return an empty table with columns of text, then of numbers."""
    from rich import box
    from rich.table import Table

    empty = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for name in texts:
        empty.add_column(name, overflow="fold")
    for name in numbers:
        empty.add_column(name, justify="right")
    return empty


def print_table_4(made: Table4) -> None:
    """Print it on standard output."""
    from rich.markup import escape

    from vislam2tag.positioning.benchmark.table_4 import TITLE

    shown = table(TITLE, ("test data", "model"), made.heads)
    for row in made.rows:
        shown.add_row(escape(row.test), escape(row.model), *row.cells())
    table_console().print(shown)
