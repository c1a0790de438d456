"""Tables on the terminal."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from vislam2tag.cli.terminal import say, visible_console
from vislam2tag.common.findings import Severity

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from vislam2tag.common.findings import Finding
    from vislam2tag.pipeline.site.show import SiteSummary
    from vislam2tag.positioning.benchmark_tables import Table4

_PIPE_WIDTH = 140
"""Columns where the output is no terminal, unless the environment's COLUMNS says how many."""


def table_console() -> Console:
    """Return a console for tables: as wide as the terminal, or wide enough for a pipe."""
    console = visible_console(highlight=False)
    if console.is_terminal or "COLUMNS" in os.environ:
        return console
    return visible_console(highlight=False, width=_PIPE_WIDTH)


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


def metres(value: float | None) -> str:
    """Write a length to the centimetre; a dash where it is not known."""
    return "-" if value is None else f"{value:.2f} m"


def print_table_4(made: Table4) -> None:
    """Print it on standard output."""
    from rich.markup import escape

    from vislam2tag.positioning.benchmark_tables import TABLE_4_TITLE

    shown = table(TABLE_4_TITLE, ("test data", "model"), made.heads)
    for row in made.rows:
        shown.add_row(escape(row.test), escape(row.model), *row.cells())
    table_console().print(shown)


def print_site(summary: SiteSummary) -> None:
    """Print a site's floors and what is odd about them on standard output."""
    from rich.markup import escape

    rows = table("Floors", ("floor", "name", "plan"), ("elevation", "x", "y", "pixel", "landmarks", "control points"))
    for each in summary.floors:
        floor = each.floor
        left, right, low, high = floor.extent_m or (None, None, None, None)
        rows.add_row(
            str(floor.number),
            escape(floor.name),
            escape(floor.plan.name if floor.plan else "none"),
            "-" if floor.elevation_m is None else f"{floor.elevation_m:g} m",
            "unknown" if left is None else f"{left:.2f} to {right:.2f} m",
            "unknown" if low is None else f"{low:.2f} to {high:.2f} m",
            "-" if each.pixel_m is None else f"{100 * each.pixel_m:.1f} cm",
            each.landmarks.short,
            str(len(floor.control_points.ids)),
        )
    table_console().print(rows)
    print_findings(summary.findings)


def site_record(summary: SiteSummary) -> dict[str, Any]:
    """A site's floors and findings, as JSON has them."""
    floors = [
        {
            "floor": each.floor.number,
            "name": each.floor.name,
            "plan": each.floor.plan.name if each.floor.plan else None,
            "elevation_m": each.floor.elevation_m,
            "extent_m": each.floor.extent_m,
            "pixel_m": each.pixel_m,
            "landmarks": each.landmarks.total,
            "planned": each.landmarks.planned,
            "unsurveyed": each.landmarks.without_position,
            "control_points": len(each.floor.control_points.ids),
        }
        for each in summary.floors
    ]
    return {"floors": floors, "findings": summary.findings, "judgement": summary.judgement}


def print_findings(findings: Iterable[Finding]) -> None:
    """Print each finding with its file on standard output."""
    console = table_console()
    for finding in findings:
        console.print(_finding_line(finding), soft_wrap=True, markup=False)


def print_warnings(findings: Iterable[Finding]) -> None:
    """Print those findings on standard error that want something done."""
    for finding in findings:
        if finding.severity != Severity.INFO:
            say(_finding_line(finding), err=True)


def _finding_line(finding: Finding) -> str:
    place = ":".join((finding.file, *map(str, finding.lines[:1])))
    return ": ".join(filter(None, (finding.severity, place, finding.message)))
