"""``vislam2tag verify``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import metres, print_table
from vislam2tag.cli.terminal import answer, say

if TYPE_CHECKING:
    from vislam2tag.datasets.comparison import Comparison, TableDifferences
    from vislam2tag.datasets.label_comparison import LabelComparison


SHOWN = 20
"""Tables that differ and are shown; --json has all."""
_COLUMNS_SHOWN = 3


@command
def verify_command(
    *,
    a: Path = argument("The first folder."),
    b: Path = argument("The second folder."),
    tolerance: float = option(
        0.01,
        "Metres that positions may lie apart; other numbers with fractions may differ by as much in their "
        "own unit. Times, whole numbers and texts must be equal.",
        least=0.0,
    ),
    json: AsJson = False,
) -> None:
    """Verify: are two sets the same within a tolerance, and if not, where?

    For those who rebuild a published set from raw data. A and B are both data sets, both outputs of `vislam2tag
    process`, or both folders in the published labelled layout (wifi_annotated.csv and sensors_annotated.csv in each
    session; spaces around fields and the form of numbers do not matter). Rows are matched by scan and access point, by
    line of the raw file, or by time. Two outputs of `process` (of two strategies, settings or dates) are also compared
    walk by walk: how many metres apart each has its frames, what share is labelled, sigma, and the error where truth is
    known, as `studio` does. Nothing is written.

    Exit code: 0 the same, 1 different, 2 wrong usage or nothing to compare.

    \b
    Examples:
      vislam2tag verify published rebuilt
      vislam2tag verify out-before out-now --tolerance 0.001 \\
          --json > differences.json
    """
    from vislam2tag.datasets.comparison import compare

    with session_bar("tables") as bar:
        found = compare(a, b, tolerance, bar.reach)
    answer(found, json, lambda: _print(found, a, b), failed=not found.same)


def _print(found: Comparison, a: Path, b: Path) -> None:
    for letter, sessions in (("A", found.missing_sessions), ("B", found.extra_sessions)):
        for session in sessions:
            say(f"only {letter} has session {session}")
    if found.facts:
        say(f"the manifests differ in {', '.join(found.facts)}")
    if found.differences:
        _print_tables(found.differences[:SHOWN])
    if found.labels and not found.same:
        _print_walks(found.labels)
    if len(found.differences) > SHOWN:
        say(f"{len(found.differences) - SHOWN} more tables differ; --json has all")
    say(_last_line(found))
    next_step("verify" if found.same else "verify, different", a=a, b=b)


def _print_tables(differences: tuple[TableDifferences, ...]) -> None:
    from vislam2tag.datasets.comparison import WHOLE_SET

    rows = []
    for one in differences:
        session = one.session if one.session != WHOLE_SET else "-"
        rows.append((session, one.table, _texts(one), str(one.matched), str(one.missing), str(one.extra)))
    heads = ("rows in both", "only in A", "only in B")
    print_table("Differences", ("session", "table", "what differs"), heads, rows)


def _print_walks(found: LabelComparison) -> None:
    """The walks, those furthest apart first, what they come to in all, and what settings differ."""
    rows = []
    for one in sorted(found.sessions, key=lambda one: -(one.apart_p95_m or 0.0))[:SHOWN]:
        pairs = (
            f"{_share(one.labelled_a)}, {_share(one.labelled_b)}",
            f"{metres(one.sigma_a_m)}, {metres(one.sigma_b_m)}",
            f"{metres(one.error_a_m)}, {metres(one.error_b_m)}",
        )
        rows.append((one.id, *pairs, metres(one.apart_median_m), metres(one.apart_p95_m)))
    labelled, sigma, error = ((total.a, total.b) for total in found.totals[1:])
    totals = (", ".join(map(form, pair)) for form, pair in ((_share, labelled), (metres, sigma), (metres, error)))
    heads = ("labelled", "sigma", "error", "apart (median)", "apart (95 %)")
    print_table("Walks, A and B", ("session",), heads, [*rows, ("all", *totals, "", "")])
    for setting in found.settings:
        say(f"{setting.name}: {setting.a}, {setting.b}")


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
