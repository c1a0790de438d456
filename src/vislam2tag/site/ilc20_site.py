"""Folders of the Indoor Location Competition 2.0 as a survey: floors, plans and traces of one site."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from vislam2tag.common.files.plain_files import plain, read_json
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.site.model import ControlPoints, Floor, SessionKey
from vislam2tag.site.names import floor_number
from vislam2tag.site.plans.source import Extent, PlanSource
from vislam2tag.site.site_table import site_finding

TRACES, INFO, PLAN, OUTLINES = "path_data_files", "floor_info.json", "floor_image.png", "geojson_map.json"
SITE_FILES = (f"*/{INFO}", f"*/{PLAN}", f"*/{OUTLINES}")
UNKNOWN_PHONE = "unknown"
_PHONE = re.compile(r"\b(?:Brand|Model):([^\t\r\n]*)")
HEADER_BYTES = 4096
"""Of a trace's beginning: they name the phone, if it is named at all."""


def is_ilc20_site(root: Path) -> bool:
    """Whether a folder is laid out as one site of the competition: ``F1/path_data_files`` or ``F1/floor_info.json``."""
    return bool(_floor_folders(root))


def ilc20_floors(root: Path) -> tuple[list[Floor], list[Finding]]:
    """Read the floors of a site, sorted by number (F1 is 0, B1 is -1); what a floor's file lacks is a finding."""
    floors, findings = [], _unnumbered(root)
    for number, folder in _floor_folders(root).items():
        width_m = height_m = None
        try:
            extent = read_json(folder / INFO)["map_info"]
            width_m, height_m = float(extent["width"]), float(extent["height"])
        except (OSError, ValueError, KeyError, TypeError):
            message = (
                'cannot be read; expected {"map_info": {"width": ..., "height": ...}}, metres; the floor\'s extent is '
                "taken from the data"
            )
            name = f"{folder.name}/{INFO}"
            findings.append(site_finding("floor_without_size", name, message))
        plan, source = _plan(folder, width_m, height_m)
        floors.append(
            Floor(
                number=number,
                name=folder.name,
                width_m=width_m,
                height_m=height_m,
                elevation_m=None,
                plan=plan,
                control_points=ControlPoints((), np.empty((0, 2))),
                source=source,
            )
        )
    return floors, findings


def _plan(folder: Path, width_m: float | None, height_m: float | None) -> tuple[Path | None, PlanSource | None]:
    """The floor's outlines, which tell where it can be walked, else its picture; both cover its extent."""
    if width_m is None or height_m is None:
        return None, None
    if (folder / OUTLINES).is_file():
        file = f"{folder.name}/{OUTLINES}"
        return folder / OUTLINES, PlanSource(file=file, extent=Extent(width_m=width_m, height_m=height_m))
    return (folder / PLAN if (folder / PLAN).is_file() else None), None


def ilc20_sessions(root: Path) -> list[tuple[SessionKey, Path]]:
    """List the traces of a site, sorted by key: the device is the phone that a trace's header names."""
    return sorted((SessionKey(number, _phone_of(path), path.stem), path) for number, path in ilc20_traces(root))


def ilc20_traces(root: Path) -> Iterator[tuple[int, Path]]:
    """The traces of a site, each with its floor's number."""
    for number, folder in _floor_folders(root).items():
        for path in (folder / TRACES).glob("*.txt"):
            yield number, path


def _floor_folders(root: Path) -> dict[int, Path]:
    """Folders of floors by number; where two have the same, the first by name."""
    found: dict[int, Path] = {}
    for folder in sorted(entry for entry in root.iterdir() if entry.is_dir()) if root.is_dir() else ():
        number = floor_number(folder.name)
        if number is not None and ((folder / TRACES).is_dir() or (folder / INFO).is_file()):
            found.setdefault(number, folder)
    return dict(sorted(found.items()))


def _unnumbered(root: Path) -> list[Finding]:
    """Folders with traces whose floor has no number."""
    message = "the floor's name tells no number: its traces are left out; call the folder F1, F2, ... or B1, ..."
    return [
        site_finding("unknown_floor", traces.parent.name, message, Severity.ERROR)
        for traces in sorted(root.glob(f"*/{TRACES}"))
        if floor_number(traces.parent.name) is None
    ]


def _phone_of(path: Path) -> str:
    try:
        with plain(path).open("rb") as file:
            head = file.read(HEADER_BYTES).decode("utf-8", errors="replace")
    except OSError:
        return UNKNOWN_PHONE
    return " ".join(word.strip() for word in _PHONE.findall(head)) or UNKNOWN_PHONE
