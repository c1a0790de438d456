"""Indoor Location Competition 2.0 (Microsoft Research, 2021): walks through malls between tapped waypoints."""

from __future__ import annotations

import hashlib
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from vislam2tag import __version__
from vislam2tag.common.errors import DatasetError
from vislam2tag.common.files.archives import folder_of, names_in
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.dataset.fingerprinting.radio_tables import radio_rows
from vislam2tag.dataset.folder import sha256_of
from vislam2tag.dataset.format_registry import ImportContext, ImportFormat
from vislam2tag.dataset.formats.ilc20.site_folders import TraceRef, find_sites, is_trace_path
from vislam2tag.dataset.model import Dataset, DatasetInfo, DatasetSource, FloorInfo, Grouping, Storey
from vislam2tag.dataset.reading.logged_walks import LoggedWalk, WalkTables
from vislam2tag.dataset.reading.waypoints import FARTHEST_M, PACE_M2_S, TAP_SIGMA_M, Waypoints
from vislam2tag.dataset.settings import DatasetSettings
from vislam2tag.sessions.tables.ilc20_trace import parse_trace

BESIDE_M = 10.0
"""Plans are drawn by hand: a waypoint may lie this far beside one."""


def recognises(path: Path) -> bool:
    """Whether a trace lies in the folder of a floor."""
    if path.is_file() and path.suffix == ".txt":
        return False
    return any(is_trace_path((*path.resolve().parts, *name.parts)) for name in names_in(path))


def read(path: Path, context: ImportContext) -> Dataset:
    """Read all traces below a folder or in an archive, one at a time."""
    sites = find_sites(folder_of(path, context.scratch, context.most_unpacked))
    places = sorted({ref.place for ref in sites.traces})
    floors = {Storey(floor.building, floor.number): floor for floor in sites.floors}
    tables = WalkTables(context.scratch, places)
    inputs: dict[str, str] = {}
    for ref in sites.traces:
        walk, findings = _walk(ref, places.index(ref.place), floors[ref.place])
        tables.add(walk, findings)
        inputs[f"{ref.place.building}/{ref.floor_name}/{ref.path.name}"] = walk.source
        context.progress(ref.path.name, len(sites.traces))
    inputs.update({name: sha256_of(file) for name, file in sorted(sites.plans.items())})
    settings = DatasetSettings()
    info = DatasetInfo(
        name="ilc20",
        title="Indoor Location Competition 2.0",
        description="Walks between tapped waypoints; positions between them are interpolated at each reading's time.",
        clock="unix",
        floors=sites.floors,
        groupings=(
            Grouping(technology="ble", by="window", window_s=settings.ble_window_s),
            Grouping(technology="wifi", by="scan"),
        ),
        sources=(
            DatasetSource(
                kind="ilc20",
                name=path.name,
                version=__version__,
                settings={"tap_sigma_m": TAP_SIGMA_M, "pace_m2_s": PACE_M2_S},
                inputs=inputs,
            ),
        ),
        findings=sites.findings,
    )
    return tables.dataset(info, sites.plans)


def _walk(ref: TraceRef, index: int, floor: FloorInfo) -> tuple[LoggedWalk, tuple[Finding, ...]]:
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
        message = "waypoints lie outside the plan; they are no taps"
        findings.append(
            Finding(kind="taps_outside_plan", file=ref.path.name, count=int((~inside).sum()), message=message)
        )
    phone = " ".join(trace.header[part] for part in ("Brand", "Model") if trace.header.get(part))
    walk = LoggedWalk(
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
    )
    return walk, tuple(findings)


def _on_plan(position: FloatArray, floor: FloorInfo) -> BoolArray:
    """Mask (n,) of the taps at these positions (n, 2) that lie on the plan, or a few metres beside it."""
    size = np.array([size_m or FARTHEST_M for size_m in (floor.width_m, floor.height_m)])
    low = -BESIDE_M if floor.width_m else -FARTHEST_M
    inside: BoolArray = np.all((position >= low) & (position <= size + BESIDE_M), axis=1)
    return inside


READS = ImportFormat("ilc20", read, recognises)
