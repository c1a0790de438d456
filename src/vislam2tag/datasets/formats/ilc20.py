"""Indoor Location Competition 2.0 (Microsoft Research, 2021): walks through malls between tapped waypoints.

Traces are in folders by site and floor, with plans and floor names.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.files.given_files import read_bytes, read_json
from vislam2tag.common.findings import ROWS_NAMED, Finding, Severity
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.datasets.fingerprints import radio_rows
from vislam2tag.datasets.folder import sha256_of
from vislam2tag.datasets.format_registry import ImportContext, ImportFormat, register
from vislam2tag.datasets.logged_walks import FARTHEST_M, LoggedWalk, Waypoints, walks_dataset
from vislam2tag.datasets.model import Dataset, DatasetInfo, DatasetSource, FloorInfo, Storey
from vislam2tag.intake.extents import FLOOR
from vislam2tag.sessions.formats.ilc20 import parse_trace
from vislam2tag.site.model import floor_number, unique_slugs

TRACES = "path_data_files"
INFO = "floor_info.json"
PLAN = "floor_image.png"


@dataclass(frozen=True)
class TraceRef:
    """A trace file, with site and floor from its folders."""

    path: Path
    place: Storey
    floor_name: str
    slug: str


@dataclass(frozen=True)
class Ilc20Sites:
    """Content of a folder: traces in the order of their slugs, floors in order, plans by path in the data set."""

    traces: tuple[TraceRef, ...]
    floors: tuple[FloorInfo, ...]
    plans: dict[str, Path]
    findings: tuple[Finding, ...]


def is_trace_path(parts: Sequence[str]) -> bool:
    """Whether a path (in parts) is that of a trace file in a floor's folder: ``.../F4/path_data_files/x.txt``."""
    return len(parts) >= 2 and parts[-1].endswith(".txt") and _floor_folder(parts) is not None


def find_sites(root: Path) -> Ilc20Sites:
    """Look for traces below a folder, which may be that of a floor or a site.

    Traces are in ``SITE/FLOOR/path_data_files`` or ``SITE/FLOOR``; ``floor_info.json`` and the plan are in
    ``SITE/FLOOR`` below the same or another folder (``metadata``). Raises DatasetError if there is no trace.
    """
    root = root.resolve()
    found, left_out = [], []
    for path in sorted(root.rglob("*.txt")):
        parts = _floor_folder(path.parts)
        if parts is None:
            continue
        folder = Path(*parts)
        number = floor_number(folder.name)
        if number is None:
            left_out.append(path)
        else:
            found.append((path, Storey(folder.parent.name, number), folder.name))
    if not found:
        raise DatasetError(
            f"{root}: contains no trace; expected SITE/FLOOR/{TRACES}/*.txt with floors named F1, B1, L2, ..."
        )
    names = [".".join((place.building, floor, path.stem)) for path, place, floor in found]
    refs = [TraceRef(*each, slug) for each, slug in zip(found, unique_slugs(names), strict=True)]
    floors, plans, odd = _floors(root, sorted({(ref.place, ref.floor_name) for ref in refs}))
    findings = (*_unnumbered(root, left_out), *odd)
    return Ilc20Sites(tuple(sorted(refs, key=lambda ref: ref.slug)), floors, plans, findings)


def _floor_folder(parts: Sequence[str]) -> Sequence[str] | None:
    """The parts of the floor's folder of a trace file; None if its folders have other names."""
    own = parts[:-1]
    if own and own[-1] == TRACES:
        return own[:-1]
    looks_like_a_floor = own and (floor_number(own[-1]) is not None)
    return own if looks_like_a_floor else None


def _floors(
    root: Path, named: Sequence[tuple[Storey, str]]
) -> tuple[tuple[FloorInfo, ...], dict[str, Path], list[Finding]]:
    described = {(path.parent.parent.name, path.parent.name): path for path in sorted(root.rglob(INFO))}
    infos: dict[Storey, FloorInfo] = {}
    plans: dict[str, Path] = {}
    findings = []
    for place, name in named:
        path = described.get((place.building, name))
        if path is None:
            message = f"floor {name} of {place.building} has no {INFO}: its extent is unknown"
            findings.append(Finding(kind="no_floor_info", file=f"{place.building}/{name}", count=1, message=message))
        width_m, height_m = (None, None) if path is None else _extent(path)
        plan = None
        if path is not None and (path.parent / PLAN).is_file():
            plan = f"plans/{unique_slugs([place.building])[0]}.floor_{place.floor}.png"
            plans[plan] = path.parent / PLAN
        infos[place] = FloorInfo(
            building=place.building, number=place.floor, name=name, width_m=width_m, height_m=height_m, plan=plan
        )
    return tuple(infos[place] for place in sorted(infos)), plans, findings


def _extent(path: Path) -> tuple[float, float]:
    try:
        extent = read_json(path)["map_info"]
        width_m, height_m = float(extent["width"]), float(extent["height"])
        if FLOOR.refuses(width_m) or FLOOR.refuses(height_m):
            raise ValueError("the floor is implausibly large or small")
        return width_m, height_m
    except (OSError, ValueError, KeyError, TypeError, OverflowError) as error:
        raise DatasetError(
            f'{path}: cannot be read; expected {{"map_info": {{"width": ..., "height": ...}}}}'
        ) from error


def _unnumbered(root: Path, left_out: Sequence[Path]) -> list[Finding]:
    if not left_out:
        return []
    names = sorted({parts[-1] for path in left_out if (parts := _floor_folder(path.parts))})
    message = (
        f"traces on floors without a number ({', '.join(names[:ROWS_NAMED])}) are skipped; name the folders F1, F2, "
        "... "
        "or B1, ..."
    )
    first = left_out[0].relative_to(root).as_posix()
    return [Finding(kind="unknown_floor", file=first, count=len(left_out), message=message, severity=Severity.ERROR)]


BESIDE_M = 10.0
"""Tolerance around hand-drawn plans: a waypoint may be this far outside."""


def recognises(path: Path) -> bool:
    """Whether a trace is in the folder of a floor."""
    if path.is_file() and path.suffix == ".txt":
        return False
    return any(is_trace_path((*path.resolve().parts, *name.parts)) for name in names_in(path))


def read(path: Path, context: ImportContext) -> Dataset:
    """Read all traces below a folder or in an archive, one at a time."""
    sites = find_sites(folder_of(path, context.scratch, context.most_unpacked))
    places = sorted({ref.place for ref in sites.traces})
    floors = {Storey(floor.building, floor.number): floor for floor in sites.floors}
    plans = {name: sha256_of(file) for name, file in sorted(sites.plans.items())}
    info = DatasetInfo(
        name="ilc20",
        title="Indoor Location Competition 2.0",
        description="Walks between tapped waypoints; positions between them are interpolated at each reading's time.",
        clock="unix",
        floors=sites.floors,
        sources=(DatasetSource(kind="ilc20", name=path.name, version=__version__, inputs=plans),),
        findings=sites.findings,
    )

    def walk(ref: TraceRef) -> LoggedWalk:
        return _walk(ref, places.index(ref.place), floors[ref.place])

    return walks_dataset(context, info, places, sites.traces, walk, sites.plans)


def _walk(ref: TraceRef, index: int, floor: FloorInfo) -> LoggedWalk:
    try:
        data = read_bytes(ref.path)
    except OSError as error:
        raise DatasetError(f"{ref.path}: cannot be read ({error.strerror})") from error
    trace = parse_trace(data, ref.path.name)
    inside = _on_plan(trace.taps.position_bcs, floor)
    position = trace.taps.position_bcs[inside]
    taps = Waypoints(trace.taps.time_ns[inside], position, np.full(len(position), index, dtype=np.int64))
    findings = list(trace.findings)
    if not inside.all():
        message = "waypoints outside the plan are not used as taps"
        findings.append(
            Finding(kind="taps_outside_plan", file=ref.path.name, count=int((~inside).sum()), message=message)
        )
    phone = " ".join(trace.header[part] for part in ("Brand", "Model") if trace.header.get(part))
    return LoggedWalk(
        slug=ref.slug,
        name=ref.path.stem,
        place=ref.place,
        device=phone or None,
        taps=taps,
        tables={"wifi": trace.wifi, "ble": radio_rows(trace.ble, "ble"), "sensors": trace.sensors},
        first_ns=trace.first_ns,
        last_ns=trace.last_ns,
        started=datetime.fromtimestamp(trace.first_ns // 1_000_000 / 1e3, UTC).replace(tzinfo=None),
        source=hashlib.sha256(data).hexdigest(),
        file=f"{ref.place.building}/{ref.floor_name}/{ref.path.name}",
        findings=findings,
    )


def _on_plan(position: FloatArray, floor: FloorInfo) -> BoolArray:
    """Mask (n,) of the taps at these positions (n, 2) that are on the plan, or a few metres outside it."""
    size = np.array([size_m or FARTHEST_M for size_m in (floor.width_m, floor.height_m)])
    low = -BESIDE_M if floor.width_m else -FARTHEST_M
    inside: BoolArray = np.all((position >= low) & (position <= size + BESIDE_M), axis=1)
    return inside


register(ImportFormat("ilc20", read, recognises))
