"""``vislam2tag verify``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.tables import metres, table, table_console
from vislam2tag.cli.terminal import say_json, visible_console

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.dataset.comparison import Comparison, TableDifferences
    from vislam2tag.dataset.label_comparison import LabelComparison


SHOWN = 20
"""Tables that differ and are shown; --json has all."""
_COLUMNS_SHOWN = 3
HELP = """
Verify: are two sets the same within a tolerance, and if not, where?

For those who rebuild a published set from raw data. A and B are both data sets, both outputs of `vislam2tag process`,
or both folders in the published labelled layout (wifi_annotated.csv and sensors_annotated.csv in each session; spaces
around fields and the form of numbers do not matter). Rows are matched by scan and access point, by line of the raw
file, or by time. Two outputs of `process` (of two strategies, settings or dates) are also compared walk by walk: how
many metres apart each has its frames, what share is labelled, sigma, and the error where truth is known, as `studio`
does. Nothing is written.

Exit code: 0 the same, 1 different, 2 wrong usage or nothing to compare.

\b
Examples:
  vislam2tag verify published rebuilt
  vislam2tag verify out-before out-now --tolerance 0.001 \\
      --json > differences.json
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("verify", help=HELP)(_verify)


def _verify(
    a: Annotated[Path, typer.Argument(help="The first folder.")],
    b: Annotated[Path, typer.Argument(help="The second folder.")],
    tolerance: Annotated[
        float,
        typer.Option(
            min=0.0,
            help="Metres that positions may lie apart; other numbers with fractions may differ by as much in their "
            "own unit. Times, whole numbers and texts must be equal.",
        ),
    ] = 0.01,
    json: AsJson = False,
) -> None:
    found = _compare_with_progress(a, b, tolerance)
    if json:
        say_json(found)
    else:
        _print(found)
        next_step("verify" if found.same else "verify, different", a=a, b=b)
    raise typer.Exit(0 if found.same else 1)


def _compare_with_progress(a: Path, b: Path, tolerance: float) -> Comparison:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from vislam2tag.dataset.comparison import compare

    console = visible_console(stderr=True)
    columns = (TextColumn("tables"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=None)
        return compare(a, b, tolerance, lambda done, total: bar.update(task, completed=done, total=total))


def _print(found: Comparison) -> None:
    from rich.markup import escape

    console = table_console()
    for letter, sessions in (("A", found.missing_sessions), ("B", found.extra_sessions)):
        for session in sessions:
            console.print(f"only {letter} has session {escape(session)}", soft_wrap=True)
    if found.facts:
        console.print(f"the manifests differ in {', '.join(found.facts)}", soft_wrap=True)
    if found.differences:
        console.print(_tables(found.differences[:SHOWN]))
    if found.labels and not found.same:
        _print_walks(found.labels)
    if len(found.differences) > SHOWN:
        console.print(f"{len(found.differences) - SHOWN} more tables differ; --json has all", soft_wrap=True)
    console.print(_last_line(found), soft_wrap=True)


def _tables(differences: tuple[TableDifferences, ...]) -> Table:
    from rich.markup import escape

    from vislam2tag.dataset.comparison import WHOLE_SET

    rows = table("Differences", ("session", "table", "what differs"), ("rows in both", "only in A", "only in B"))
    for one in differences:
        counts = (str(count) for count in (one.matched, one.missing, one.extra))
        rows.add_row(escape(one.session) if one.session != WHOLE_SET else "-", one.table, escape(_texts(one)), *counts)
    return rows


def _print_walks(found: LabelComparison) -> None:
    """The walks, those furthest apart first, what they come to in all, and what settings differ."""
    from rich.markup import escape

    rows = table("Walks, A and B", ("session",), ("labelled", "sigma", "error", "apart (median)", "apart (95 %)"))
    for one in sorted(found.sessions, key=lambda one: -(one.apart_p95_m or 0.0))[:SHOWN]:
        rows.add_row(
            escape(one.id),
            f"{_share(one.labelled_a)}, {_share(one.labelled_b)}",
            f"{metres(one.sigma_a_m)}, {metres(one.sigma_b_m)}",
            f"{metres(one.error_a_m)}, {metres(one.error_b_m)}",
            metres(one.apart_median_m),
            metres(one.apart_p95_m),
        )
    labelled, sigma, error = ((total.a, total.b) for total in found.totals[1:])
    rows.add_row(
        "all", ", ".join(map(_share, labelled)), ", ".join(map(metres, sigma)), ", ".join(map(metres, error)), "", ""
    )
    table_console().print(rows)
    for setting in found.settings:
        table_console().print(f"{setting.name}: {escape(setting.a)}, {escape(setting.b)}", soft_wrap=True)


def _share(value: float | None) -> str:
    return "-" if value is None else f"{100 * value:.1f} %"


def _texts(one: TableDifferences) -> str:
    lines = []
    for letter, names in (("A", one.missing_columns), ("B", one.extra_columns)):
        if names:
            lines.append(f"only {letter} has column {', '.join(names)} (or its type differs)")
    for column in one.columns[:_COLUMNS_SHOWN]:
        most = "" if column.greatest is None else f", at most {column.greatest:.4g}"
        lines.append(f"{column.column}: {column.rows} rows{most} (at {column.where})")
    if len(one.columns) > _COLUMNS_SHOWN:
        lines.append(f"and {', '.join(column.column for column in one.columns[_COLUMNS_SHOWN:])}")
    for letter, names in (("A", one.missing_rows), ("B", one.extra_rows)):
        if names:
            lines.append(f"only in {letter}: {names[0]}" + (", ..." if len(names) > 1 else ""))
    return "\n".join(lines)


def _last_line(found: Comparison) -> str:
    compared = f"{found.tables} tables with {found.rows} common rows, tolerance {found.tolerance:g}"
    if found.same:
        return f"the same: {compared}"
    sessions = len(found.missing_sessions) + len(found.extra_sessions)
    return f"different: {len(found.differences)} of {compared}; {sessions} sessions on one side only"
