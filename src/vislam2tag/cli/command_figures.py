"""``vislam2tag figures``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, FollowLinks
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import print_table
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from vislam2tag.datasets.coverage import CoverageRecord
    from vislam2tag.datasets.model import Storey

_START = re.compile(r"(?:(.*)/)?(-?\d+):(-?\d+(?:\.\d+)?),(-?\d+(?:\.\d+)?)")


def start_of(text: str) -> tuple[Storey, tuple[float, float]]:
    """Read ``FLOOR:X,Y`` or ``BUILDING/FLOOR:X,Y``, metres; raises UsageError for anything else."""
    from vislam2tag.datasets.model import Storey

    match = _START.fullmatch(text)
    if match is None:
        raise UsageError(f"--start {text}: give FLOOR:X,Y or BUILDING/FLOOR:X,Y in metres, such as 1:12.5,3")
    building, floor, x, y = match.groups()
    return Storey(building or "", int(floor)), (float(x), float(y))


@command
def figures_command(
    *,
    dataset: Path = argument("Data set.", metavar="DS"),
    out: Path = option(..., "Output folder: new, empty or from an earlier run of this command."),
    cell_m: float | None = setting("coverage.cell_m"),
    radius_m: float | None = setting("coverage.radius_m"),
    follow_links: FollowLinks = False,
    json: AsJson = False,
    config: ConfigFile = None,
    start: tuple[str, ...] = option(
        (), "Where the walk that fills a floor's gaps begins; repeatable. Else anywhere.", metavar="FLOOR:X,Y"
    ),
) -> None:
    """Figures of a data set for print, the paper's Table III, and the shortest further walk that fills its gaps.

    Writes fingerprints by device and floor (the paper's Figure 8), coverage on the plans with gaps and walks, access
    points a fingerprint, RSSI by device, sigma, and fingerprints over time as SVG and PDF; Table III as CSV, Markdown
    and LaTeX; coverage.json with each floor's coverage and the corners of the walks.

    Exit code: 0 all right, 1 no fingerprint has a position, 2 wrong usage, no data set, or OUT cannot be written, 130
    interrupted.

    \b
    Examples:
      vislam2tag figures fingerprints --out figures
      vislam2tag figures fingerprints --out figures --cell-m 1 --radius-m 1.5 \\
          --start 1:12.5,3 --start annex/0:4,4
    """
    from vislam2tag.pipeline.datasets.figures import make_dataset_figures

    starts = dict(start_of(text) for text in start)
    settings = settings_of(config, {"coverage.cell_m": cell_m, "coverage.radius_m": radius_m}).coverage
    with session_bar("figures") as bar:
        made = make_dataset_figures(dataset, out, settings, starts, bar.count, follow_links=follow_links)
    answer(made, json, lambda: _print(made, out, dataset), failed=not made.floors)


def _print(made: CoverageRecord, out: Path, dataset: Path) -> None:
    from vislam2tag.datasets.model import Storey
    from vislam2tag.pipeline.datasets.figures import COVERAGE_FILE, storey_text

    rows = []
    for floor in made.floors:
        length_m = sum(walk.length_m for walk in floor.walks)
        minutes = sum(walk.minutes for walk in floor.walks)
        walk = (f"{length_m:.0f} m", f"{minutes:.1f} min") if floor.walks else ("-", "-")
        covered = "-" if floor.share is None else f"{100 * floor.share:.0f} %"
        storey = storey_text(Storey(floor.building, floor.floor))
        rows.append((storey, str(floor.fingerprints), f"{floor.walkable_m2:.0f} m²", covered, *walk))
    heads = ("fingerprints", "walkable", "covered", "walk that fills the gaps", "takes")
    print_table("Coverage", ("floor",), heads, rows)
    say(f"figures, Table III and {COVERAGE_FILE}: {out}")
    if made.floors:
        next_step("figures", dataset=dataset)
    else:
        say("coverage: could not be judged: no fingerprint has a position")
        next_step("no position", page=dataset / "report.html")
