"""The paper's Table IV on the terminal."""

from __future__ import annotations

from rich.markup import escape

from vislam2tag.cli.tables import table, table_console
from vislam2tag.positioning.table_4 import TITLE, Table4


def print_table_4(made: Table4) -> None:
    """Print it on standard output."""
    shown = table(TITLE, ("test data", "model"), made.heads)
    for row in made.rows:
        shown.add_row(escape(row.test), escape(row.model), *row.cells())
    table_console().print(shown)
