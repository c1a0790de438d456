"""``vislam2tag join``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, FollowLinks, Replace
from vislam2tag.cli.progress import outputs_of_interrupted
from vislam2tag.cli.tables import table, table_console
from vislam2tag.cli.terminal import say, say_json, visible_console
from vislam2tag.dataset.settings import CHANGE_CELL_M

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.dataset.changes import SurveyChanges, TechnologyChanges


HELP = """
Join a later survey to a data set, and tell what changed in the building between the two.

Writes one data set of all walks to DS, and to DS/changes which access points appeared, vanished or moved (judged only
where both surveys walked), and the places whose RSSI changed beyond what noise and the phones' offsets explain: those
are worth walking again. docs/how-to/second-survey.md tells how it is tested. A walk that both sets hold is taken once.

Exit code: 0 joined, 2 wrong usage, the sets cannot be joined, or DS cannot be written, 130 interrupted.

\b
Examples:
  vislam2tag join fingerprints-2022 fingerprints-2023 --out fingerprints
  vislam2tag join fingerprints check-walk --out fingerprints-now --cell-m 6
"""


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("join", help=HELP)(_join)


def _join(
    base: Annotated[Path, typer.Argument(help="The data set.")],
    later: Annotated[Path, typer.Argument(help="The data set of a later survey of the same building.")],
    out: Annotated[Path, typer.Option(help="Folder for the joined data set: new, empty or an earlier data set.")],
    cell_m: Annotated[
        float, typer.Option(min=0.5, help="Side of the square that counts as one place, metres.")
    ] = CHANGE_CELL_M,
    replace: Replace = False,
    follow_links: FollowLinks = False,
    json: AsJson = False,
) -> None:
    from vislam2tag.pipeline.datasets.join import CHANGES, join

    with outputs_of_interrupted(out), visible_console(stderr=True).status("joining"):
        record = join(base, later, out, cell_m, replace=replace, follow_links=follow_links)
    if json:
        say_json(record)
        return
    _print(record)
    say(f"joined: {out}, what changed: {out / CHANGES}")
    next_step("join", dataset=out)


def _print(record: SurveyChanges) -> None:
    from vislam2tag.dataset.changes import CHANGED, OUTDATED

    console = table_console()
    for one in record.technologies:
        if one.changed:
            console.print(_points(one))
        points = ", ".join(f"{count} {change}" for change, count in one.access_points.items())
        places = ", ".join(f"{count} {change}" for change, count in one.places.items())
        console.print(f"{one.technology}: access points: {points or 'none'}", soft_wrap=True)
        console.print(f"{one.technology}: places: {places or 'none'}", soft_wrap=True)
        again = one.places.get(CHANGED, 0) + one.places.get(OUTDATED, 0)
        console.print(f"{one.technology}: {again} places are worth walking again", soft_wrap=True)
    for finding in record.findings:
        console.print(f"{finding.kind}: {finding.message}", soft_wrap=True)


def _points(one: TechnologyChanges) -> Table:
    from rich.markup import escape

    rows = table(
        f"Access points that changed ({one.technology})", ("bssid", "ssid", "change"), ("dB", "was at", "is at")
    )
    for point in one.changed:
        was = _where(point.base_floor, point.base_x, point.base_y)
        now = _where(point.later_floor, point.later_x, point.later_y)
        rows.add_row(point.bssid, escape(point.ssid or ""), point.change, f"{point.difference_db:+.1f}", was, now)
    return rows


def _where(floor: int | None, x: float | None, y: float | None) -> str:
    return "-" if floor is None else f"floor {floor} ({x:.0f}, {y:.0f})"
