"""``vislam2tag site walkable``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, Floors, FollowLinks
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import print_warnings, table, table_console
from vislam2tag.cli.terminal import say, say_json

if TYPE_CHECKING:
    from vislam2tag.pipeline.site.walkable import WalkableFloor


WALKABLE_HELP = """
Show where floors can be walked, as planning and simulating take it from the plans (docs/explanation/walkable.md).

Writes for each floor OUT/floor_K.png (walkable space, walls, corridors), OUT/floor_K.geojson (the graph, metres) and
OUT/floor_K.mask.png, green where people can walk and red elsewhere: correct it with any paint program, and give it to
--mask here, of plan and of simulate. walkable.json has figures and findings.

Exit code: 0 all right, 2 wrong usage, no plan, nothing that can be walked, or OUT cannot be written, 130 interrupted.

\b
Examples:
  vislam2tag site walkable survey --out walkable
  vislam2tag site walkable survey --floor 4 --wall-contrast 0.08 \\
      --out walkable
  vislam2tag site walkable survey --floor 4 --mask corrected.png \\
      --out walkable
"""


def site_walkable(
    site: Annotated[Path, typer.Argument(metavar="SITE", help="Survey folder.")],
    out: Annotated[Path, typer.Option(help="Output folder: new, empty or from an earlier run.")],
    floor: Floors = None,
    mask: Annotated[
        Path | None, typer.Option(metavar="IMAGE", help="With one floor: green can be walked, red cannot.")
    ] = None,
    wall_contrast: Annotated[float | None, setting("walkable.wall_contrast")] = None,
    follow_links: FollowLinks = False,
    json: AsJson = False,
    config: ConfigFile = None,
) -> None:
    """Find and draw walkable space."""
    from vislam2tag.pipeline.site.walkable import floor_record, write_walkable

    settings = settings_of(config, {"walkable.wall_contrast": wall_contrast}).walkable
    found = write_walkable(site, out, floor or (), settings, mask, follow_links=follow_links, tell=print_warnings)
    if json:
        say_json([floor_record(one) for one in found])
        return
    _print(found)
    say(f"written: {out}")
    next_step("site walkable", site=site)


def _print(found: tuple[WalkableFloor, ...]) -> None:
    from rich.markup import escape

    from vislam2tag.walkable.graph import NodeKind

    console = table_console()
    kinds = [kind for kind in NodeKind if any(kind in one.graph.kinds for one in found)]
    rows = table("Walkable space", ("floor",), ("area", "corridors", *(kind.value for kind in kinds)))
    for one in found:
        corridors_m = float(one.graph.length_m[~one.graph.in_room & ~one.graph.shortcut].sum())
        counts = [str(one.graph.kinds.count(kind)) for kind in kinds]
        rows.add_row(
            escape(f"{one.floor.number} {one.floor.name}"), f"{one.area_m2:.0f} m2", f"{corridors_m:.0f} m", *counts
        )
    console.print(rows)
    for one in found:
        for finding in one.findings:
            console.print(f"floor {one.floor.number}: {escape(finding.message)}", soft_wrap=True)
