"""``vislam2tag radio-maps``."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import INTERRUPTED, AsJson, FollowLinks
from vislam2tag.cli.progress import session_bar
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_of
from vislam2tag.cli.tables import table, table_console
from vislam2tag.cli.terminal import say, say_json
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from rich.table import Table

    from vislam2tag.pipeline.datasets.radio_maps import RadioMapIndex


HELP = """
Draw radio maps: over each floor, how loud each access point is heard, how much that varies, and how often it is heard.

One map for each floor, technology and access point, smoothed by a Gaussian process, without the phones' offsets, with
the error of readings that were left out. Writes R/radio_maps.json, index.html to look through, one NumPy file a floor,
one GeoTIFF an access point, and figures. docs/explanation/radio_maps.md tells what each layer is.

Exit code: 0 all right, 2 wrong usage, no data set, nothing to map, or R cannot be written, 130 interrupted.

\b
Examples:
  vislam2tag radio-maps fingerprints --out maps
  vislam2tag radio-maps fingerprints --out maps --cell 50cm --most 20
  vislam2tag radio-maps fingerprints --out one --ap 0c:8d:db:f5:3c:01
"""
_UNITS_M = {"m": 1.0, "cm": 0.01}
_LENGTH = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(m|cm)\s*")


def register(app: typer.Typer) -> None:
    """Add the command to the application."""
    app.command("radio-maps", help=HELP)(_radio_maps)


def metres_of(text: str, option: str) -> float:
    """Read a length such as ``1m`` or ``50cm``; raises UsageError for anything else."""
    match = _LENGTH.fullmatch(text)
    if match is None or float(match.group(1)) == 0:
        raise UsageError(f"{option} {text}: give a length above zero with its unit, such as 1m or 50cm")
    return float(match.group(1)) * _UNITS_M[match.group(2)]


def _radio_maps(
    dataset: Annotated[Path, typer.Argument(help="Data set (see vislam2tag dataset).")],
    out: Annotated[Path, typer.Option(help="Folder to write: new, empty or with radio maps.")],
    ap: Annotated[
        list[str] | None, typer.Option("--ap", metavar="BSSID", help="Only this access point; repeatable.")
    ] = None,
    cell: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Side of a cell, such as 1m or 50cm.  [default: 1m]")
    ] = None,
    reach: Annotated[
        str | None,
        typer.Option(
            metavar="LENGTH", help="Cells farther than this from every fingerprint stay empty.  [default: 3m]"
        ),
    ] = None,
    most: Annotated[int | None, setting("radio_maps.most")] = None,
    follow_links: FollowLinks = False,
    json: AsJson = False,
    config: ConfigFile = None,
) -> None:
    from vislam2tag.pipeline.datasets.radio_maps import PAGE_FILE, write_radio_maps

    settings = settings_of(
        config,
        {
            "radio_maps.cell_m": None if cell is None else metres_of(cell, "--cell"),
            "radio_maps.reach_m": None if reach is None else metres_of(reach, "--reach"),
            "radio_maps.most": most,
        },
    ).radio_maps
    try:
        with session_bar("access points") as bar:
            found = write_radio_maps(
                dataset,
                out,
                settings,
                tuple(ap or ()),
                lambda _done, total: bar.advance(total, error=None),
                follow_links=follow_links,
            )
    except KeyboardInterrupt:
        say(f"interrupted: {out} holds no new radio maps", err=True)
        raise typer.Exit(INTERRUPTED) from None
    if json:
        say_json(found)
        return
    table_console().print(_table(found))
    if not ap and any(len(floor.access_points) == settings.most for floor in found.floors):
        say(f"only the {settings.most} most heard access points of a floor are mapped; --most takes more")
    say(f"page: {out / PAGE_FILE}")
    next_step("radio-maps", dataset=dataset)


def _table(found: RadioMapIndex) -> Table:
    import numpy as np
    from rich.markup import escape

    numbers = ("access points", "fingerprints", "noise", "error of a map, median", "within one deviation, median")
    rows = table("Radio maps", ("floor", "technology"), numbers)
    for floor in found.floors:
        errors = [one.errors for one in floor.access_points if one.errors.rms_db is not None]
        rows.add_row(
            escape(f"{floor.building} {floor.floor}".strip()),
            escape(floor.technology),
            str(len(floor.access_points)),
            str(floor.fingerprints),
            f"{floor.kernel.noise_db:.1f} dB",
            f"{np.median([one.rms_db for one in errors]):.1f} dB" if errors else "-",
            f"{100 * np.median([one.within_one_deviation for one in errors]):.0f} %" if errors else "-",
        )
    return rows
