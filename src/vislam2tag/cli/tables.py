"""Tables and findings on the terminal."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, TypeAlias

from vislam2tag.cli.terminal import say, visible_console
from vislam2tag.common.findings import Severity

if TYPE_CHECKING:
    from rich.console import Console, RenderableType
    from rich.measure import Measurement
    from rich.table import Column, Table
    from rich.text import Text

    from vislam2tag.common.findings import Finding
    from vislam2tag.positioning.benchmark_tables import Table4

    Row: TypeAlias = Sequence[str | Text] | None
    """Cells of a table's row; None for a line between rows."""

_PIPE_WIDTH = 140
"""Width if the output is not a terminal and COLUMNS is not set."""


def print_table(
    title: str, texts: Sequence[str], numbers: Sequence[str], rows: Iterable[Row], *, pipe_width: int = _PIPE_WIDTH
) -> None:
    """Print a table with columns of text, then of numbers: as wide as the terminal, or wide enough for a pipe."""
    show_table(table(title, texts, numbers, rows), pipe_width)


def show_table(made: Table, pipe_width: int = _PIPE_WIDTH) -> None:
    """Print a table in as many parts as the width needs."""
    console = visible_console()
    if not console.is_terminal and "COLUMNS" not in os.environ:
        console = visible_console(width=pipe_width)
    for part in tables_that_fit(made, console):
        console.print(part)


def table(title: str, texts: Sequence[str], numbers: Sequence[str], rows: Iterable[Row]) -> Table:
    """Return a table with columns of text, then of numbers."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    made = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD)
    for name in texts:
        made.add_column(name, overflow="fold")
    for name in numbers:
        made.add_column(name, justify="right")
    for row in rows:
        if row is None:
            made.add_section()
        else:
            made.add_row(*(escape(cell) if isinstance(cell, str) else cell for cell in row))
    return made


def red(text: str) -> Text:
    """Return a cell of a table in red."""
    from rich.text import Text

    return Text(text, "red")


def metres(value: float | None) -> str:
    """A length to the centimetre, or a dash for None."""
    return "-" if value is None else f"{value:.2f} m"


def or_dash(value: float | None, form: str) -> str:
    """A number in a form such as ``{:.1f} m``, or a dash for None."""
    return "-" if value is None else form.format(value)


def print_table_4(made: Table4) -> None:
    """Print it on standard output."""
    from vislam2tag.positioning.benchmark_tables import TABLE_4_TITLE

    rows = ((row.test, row.model, *row.cells()) for row in made.rows)
    print_table(TABLE_4_TITLE, ("test data", "model"), made.heads, rows)


def print_findings(findings: Iterable[Finding]) -> None:
    """Print each finding with its file on standard output."""
    for finding in findings:
        say(_finding_line(finding))


def print_warnings(findings: Iterable[Finding]) -> None:
    """Print findings that need an action on standard error."""
    for finding in findings:
        if finding.severity != Severity.INFO:
            say(_finding_line(finding), err=True)


def _finding_line(finding: Finding) -> str:
    place = ":".join((finding.file, *map(str, finding.lines[:1])))
    return ": ".join(filter(None, (finding.severity, place, finding.message)))


def tables_that_fit(table: Table, console: Console) -> list[Table]:
    """Split a table too wide for a console into several, each with its columns of text, so that no number is cut."""
    texts = [i for i, column in enumerate(table.columns) if column.justify == "left"]
    spans = [_span_of(column, console) for column in table.columns]
    least, most = [span.minimum for span in spans], [span.maximum for span in spans]
    beside = (_span(table, console).maximum - sum(most)) / max(len(most), 1)

    def fits(columns: Sequence[int], widths: Sequence[int]) -> bool:
        return sum(widths[i] + beside for i in columns) <= console.width

    if fits(range(len(spans)), most):
        return [table]
    groups: list[list[int]] = [[*texts]]
    for i in (i for i in range(len(spans)) if i not in texts):
        if len(groups[-1]) > len(texts) and not fits([*groups[-1], i], least):
            groups.append([*texts])
        groups[-1].append(i)
    parts = []
    for group in groups:
        room = int(console.width - beside * len(group))
        widths = _shared(room, [least[i] for i in group], [most[i] for i in group])
        parts.append(_part(table, dict(zip(group, widths, strict=True))))
    return parts


def _span(text: RenderableType, console: Console) -> Measurement:
    from rich.measure import Measurement

    return Measurement.get(console, console.options.update(max_width=10_000), text)


def _span_of(column: Column, console: Console) -> Measurement:
    """The smallest and largest useful width of a column. Numbers are not wrapped."""
    from rich.measure import Measurement

    head, cells = _span(column.header, console), [_span(cell, console) for cell in column.cells]
    words = [cell.minimum if column.justify == "left" else cell.maximum for cell in cells]
    return Measurement(max([head.minimum, *words]), max([head.maximum, *(cell.maximum for cell in cells)]))


def _part(table: Table, widths: Mapping[int, int]) -> Table:
    """A table of some of another's columns, with these widths."""
    from rich.table import Table

    made = Table(title=table.title, title_justify="left", box=table.box)
    for i, width in widths.items():
        old = table.columns[i]
        made.add_column(old.header, justify=old.justify, overflow=old.overflow, width=width)
    cells = [list(table.columns[i].cells) for i in widths]
    for number, row in enumerate(zip(*cells, strict=True)):
        made.add_row(*row, end_section=table.rows[number].end_section)
    return made


def _shared(width: int, least: Sequence[int], most: Sequence[int]) -> list[int]:
    """Widths of columns that share this one, each with its least where that can be, and with no more than its most.

    Where the least alone is too wide, the widest columns give.
    """
    widths = list(least)
    while sum(widths) > width and max(widths) > 1:
        widths[widths.index(max(widths))] -= 1
    while sum(widths) < width and (short := [i for i in range(len(widths)) if widths[i] < most[i]]):
        widths[min(short, key=widths.__getitem__)] += 1
    return widths
