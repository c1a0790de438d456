"""``vislam2tag radio-maps``."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from vislam2tag.cli.next_steps import next_step
from vislam2tag.cli.options import AsJson, FollowLinks
from vislam2tag.cli.progress import interrupted_with, session_bar
from vislam2tag.cli.records import argument, command, option
from vislam2tag.cli.settings_options import ConfigFile, setting, settings_from
from vislam2tag.cli.tables import print_table
from vislam2tag.cli.terminal import answer, say
from vislam2tag.common.errors import UsageError

if TYPE_CHECKING:
    from vislam2tag.pipeline.datasets.radio_maps import RadioMapIndex


_UNITS_M = {"m": 1.0, "cm": 0.01}
_LENGTH = re.compile(r"\s*(\d+(?:\.\d+)?)\s*(m|cm)\s*")


def metres_of(text: str, option_name: str) -> float:
    """Read a length such as ``1m`` or ``50cm``; raises UsageError for anything else."""
    match = _LENGTH.fullmatch(text)
    if match is None or float(match.group(1)) == 0:
        raise UsageError(f"{option_name} {text}: give a length above zero with its unit, such as 1m or 50cm")
    return float(match.group(1)) * _UNITS_M[match.group(2)]


@dataclass(frozen=True, kw_only=True)
class RadioMapsOptions:
    """Arguments and options of ``vislam2tag radio-maps``."""

    dataset: Path = argument("Data set (see vislam2tag dataset).")
    out: Path = option(..., "Folder to write: new, empty or with radio maps.")
    ap: tuple[str, ...] = option((), "Only this access point; repeatable.", "--ap", metavar="BSSID")
    cell: float | None = option(
        None,
        "Side of a cell, such as 1m or 50cm.  [default: 1m]",
        metavar="LENGTH",
        parse=metres_of,
        sets=("radio_maps.cell_m",),
    )
    reach: float | None = option(
        None,
        "Cells farther than this from every fingerprint stay empty.  [default: 3m]",
        metavar="LENGTH",
        parse=metres_of,
        sets=("radio_maps.reach_m",),
        hidden=True,
    )
    most: int | None = setting("radio_maps.most")
    follow_links: FollowLinks = False
    json: AsJson = False
    config: ConfigFile = None


@command
def radio_maps_command(given: RadioMapsOptions) -> None:
    """Draw radio maps: over each floor, how loud each access point is heard, how much that varies, and how often it is
    heard.

    One map for each floor, technology and access point, smoothed by a Gaussian process, without the phones' offsets,
    with the error of readings that were left out. Writes R/radio_maps.json, index.html to look through, one NumPy file
    a floor, one GeoTIFF an access point, and figures. docs/explanation/radio_maps.md tells what each layer is.

    Exit code: 0 all right, 2 wrong usage, no data set, nothing to map, or R cannot be written, 130 interrupted.

    \b
    Examples:
      vislam2tag radio-maps fingerprints --out maps
      vislam2tag radio-maps fingerprints --out maps --cell 50cm --most 20
      vislam2tag radio-maps fingerprints --out one --ap 0c:8d:db:f5:3c:01
    """
    from vislam2tag.pipeline.datasets.radio_maps import write_radio_maps

    settings = settings_from(given).radio_maps
    with interrupted_with(f"{given.out} holds no new radio maps"), session_bar("access points") as bar:
        found = write_radio_maps(
            given.dataset, given.out, settings, given.ap, bar.count, follow_links=given.follow_links
        )
    answer(found, given.json, lambda: _print(found, given, settings.most))


def _print(found: RadioMapIndex, given: RadioMapsOptions, most: int) -> None:
    import numpy as np

    from vislam2tag.pipeline.datasets.radio_maps import PAGE_FILE

    rows = []
    for floor in found.floors:
        errors = [one.errors for one in floor.access_points if one.errors.rms_db is not None]
        typical = ("-", "-")
        if errors:
            within = 100 * np.median([one.within_one_deviation for one in errors])
            typical = (f"{np.median([one.rms_db for one in errors]):.1f} dB", f"{within:.0f} %")
        place = (f"{floor.building} {floor.floor}".strip(), floor.technology)
        counts = (str(len(floor.access_points)), str(floor.fingerprints), f"{floor.kernel.noise_db:.1f} dB")
        rows.append((*place, *counts, *typical))
    numbers = ("access points", "fingerprints", "noise", "error of a map, median", "within one deviation, median")
    print_table("Radio maps", ("floor", "technology"), numbers, rows)
    if not given.ap and any(len(floor.access_points) == most for floor in found.floors):
        say(f"only the {most} most heard access points of a floor are mapped; --most takes more")
    say(f"page: {given.out / PAGE_FILE}")
    next_step("radio-maps", dataset=given.dataset)
