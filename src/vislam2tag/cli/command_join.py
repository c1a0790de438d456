"""``vislam2tag join``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, FollowLinks, Replace
from vislam2tag.cli.progress import outputs_of_interrupted
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.tables import print_table
from vislam2tag.cli.terminal import answer, say, visible_console
from vislam2tag.datasets.settings import CHANGE_CELL_M

if TYPE_CHECKING:
    from vislam2tag.datasets.changes import SurveyChanges, TechnologyChanges


@command
def join_command(
    *,
    base: Path = argument("The data set."),
    later: Path = argument("The data set of a later survey of the same building."),
    out: Path = option(..., "Folder for the joined data set: new, empty or an earlier data set."),
    cell_m: float = option(CHANGE_CELL_M, "Side of the square that counts as one place, metres.", least=0.5),
    replace: Replace = False,
    follow_links: FollowLinks = False,
    json: AsJson = False,
) -> None:
    """Join a later survey to a data set, and tell what changed in the building between the two.

    Writes one data set of all walks to DS, and to DS/changes which access points appeared, vanished or moved (judged
    only where both surveys walked), and the places whose RSSI changed beyond what noise and the phones' offsets
    explain: those are worth walking again. docs/how-to/second-survey.md tells how it is tested. A walk that both sets
    hold is taken once.

    Exit code: 0 joined, 2 wrong usage, the sets cannot be joined, or DS cannot be written, 130 interrupted.

    \b
    Examples:
      vislam2tag join fingerprints-2022 fingerprints-2023 --out fingerprints
      vislam2tag join fingerprints check-walk --out fingerprints-now --cell-m 6
    """
    from vislam2tag.pipeline.datasets.join import join

    with outputs_of_interrupted(out), visible_console(stderr=True).status("joining"):
        record = join(base, later, out, cell_m, replace=replace, follow_links=follow_links)
    answer(record, json, lambda: _print(record, out))


def _print(record: SurveyChanges, out: Path) -> None:
    from vislam2tag.datasets.changes import CHANGED, OUTDATED
    from vislam2tag.pipeline.datasets.join import CHANGES

    for one in record.technologies:
        if one.changed:
            _print_points(one)
        points = ", ".join(f"{count} {change}" for change, count in one.access_points.items())
        places = ", ".join(f"{count} {change}" for change, count in one.places.items())
        again = one.places.get(CHANGED, 0) + one.places.get(OUTDATED, 0)
        say(f"{one.technology}: access points: {points or 'none'}")
        say(f"{one.technology}: places: {places or 'none'}")
        say(f"{one.technology}: {again} places are worth walking again")
    for finding in record.findings:
        say(f"{finding.kind}: {finding.message}")
    say(f"joined: {out}, what changed: {out / CHANGES}")
    next_step("join", dataset=out)


def _print_points(one: TechnologyChanges) -> None:
    rows = []
    for point in one.changed:
        was = _where(point.base_floor, point.base_x, point.base_y)
        now = _where(point.later_floor, point.later_x, point.later_y)
        rows.append((point.bssid, point.ssid or "", point.change, f"{point.difference_db:+.1f}", was, now))
    title = f"Access points that changed ({one.technology})"
    print_table(title, ("bssid", "ssid", "change"), ("dB", "was at", "is at"), rows)


def _where(floor: int | None, x: float | None, y: float | None) -> str:
    return "-" if floor is None else f"floor {floor} ({x:.0f}, {y:.0f})"
