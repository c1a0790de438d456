"""Data sets made from walks logged by other programs: taps at known places, radio and inertial readings.

Each walk is read, labelled by its taps, and written to the scratch folder, which the tables scan, so that one walk is
in memory at a time. Between taps a walk is straight with constant speed, and sigma reflects how uncertain this is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from types import MappingProxyType
from typing import TypeVar

import numpy as np
import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import scan_parquet, write_parquet
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.datasets.fingerprints import (
    NAMES,
    TECHNOLOGIES,
    SessionWalk,
    access_points_of,
    fingerprints_of,
    radio_parts,
    tables_of,
    write_part,
)
from vislam2tag.datasets.format_registry import ImportContext
from vislam2tag.datasets.model import Dataset, DatasetInfo, Grouping, Storey
from vislam2tag.datasets.phone_motion import PhoneMotion
from vislam2tag.datasets.schema import (
    ACCESS_POINTS,
    FINGERPRINTS,
    MAGNETIC,
    READINGS,
    SESSIONS,
    empty_table,
    in_schema,
)
from vislam2tag.datasets.sensor_windows import magnetic_windows
from vislam2tag.datasets.settings import DatasetSettings
from vislam2tag.labeling.settings import LabelSettings
from vislam2tag.labeling.tables import label_readings, status_text

TAP_SIGMA_M = 0.3
"""Standard deviation per axis of the walker's position at a tap, against the tapped place."""
PACE_M2_S = 0.25
"""Growth of the position's variance after a tap, because of uneven speed (m^2/s), as a Brownian bridge between two
taps.

From real walks: inner taps were removed and interpolated (docs/reference/importing.md, "Positions between taps")."""
FARTHEST_M = 10_000.0
"""A tap farther from the others is an error, because no site is larger."""
LONGEST_LEG_S = 600.0
"""Longest straight leg; positions between taps farther apart in time are unknown."""
_STEP_NS = 500_000_000
"""Interval of the frames, so that sigma between them is nearly linear."""


@dataclass(frozen=True)
class Waypoints:
    """Taps of one walk in time order, with unique times: ``time_ns`` (n,), ``position`` (n, 2) metres, ``floor``
    (n,)."""

    time_ns: IntArray
    position: FloatArray
    floor: IntArray

    @classmethod
    def of(cls, time_ns: IntArray, position: FloatArray, floor: IntArray) -> Waypoints:
        """Put taps (n,) into time order; of several taps at one time the first counts."""
        order = np.unique(time_ns, return_index=True)[1]
        return cls(time_ns[order], position[order], floor[order])

    def __len__(self) -> int:
        """Return the number of taps."""
        return len(self.time_ns)

    @property
    def leg_m(self) -> FloatArray:
        """Straight distance (n - 1,) from each tap to the next, metres; 0 if it is unknown."""
        known: FloatArray = np.where(self.straight, np.linalg.norm(np.diff(self.position, axis=0), axis=1), 0.0)
        return known

    @property
    def straight(self) -> BoolArray:
        """Mask (n - 1,) of the legs on one floor that are not too long in time."""
        known: BoolArray = (np.diff(self.floor) == 0) & (np.diff(self.time_ns) <= LONGEST_LEG_S * 1e9)
        return known


def trajectory_between(taps: Waypoints) -> Trajectory:
    """Make frames at the taps and between them; there are none before the first and after the last.

    Between two taps on different floors, or too far apart in time, there is a frame without a position (``gap``),
    because the path is unknown. The variance per axis is ``TAP_SIGMA_M^2 + PACE_M2_S a b / (a + b)``, with a and b the
    seconds from and to a tap.
    """
    time_ns = _frame_times(taps)
    leg = np.clip(np.searchsorted(taps.time_ns, time_ns, side="right") - 1, 0, max(len(taps) - 2, 0))
    end = np.minimum(leg + 1, len(taps) - 1)
    since, until = (time_ns - taps.time_ns[leg]) * 1e-9, (taps.time_ns[end] - time_ns) * 1e-9
    whole = np.maximum(since + until, 1e-9)
    variance = TAP_SIGMA_M**2 + PACE_M2_S * since * until / whole
    position = taps.position[leg] + (since / whole)[:, None] * (taps.position[end] - taps.position[leg])
    at_tap = (since == 0) | (until == 0)
    unknown = ~np.append(taps.straight, True)[leg] & ~at_tap
    variance[unknown], position[unknown] = np.nan, np.nan
    return Trajectory(
        time_ns=time_ns,
        position_bcs=np.column_stack((position, np.full(len(time_ns), np.nan))),
        orientation_bcs=np.full((len(time_ns), 4), np.nan),
        covariance_bcs=variance[:, None, None] * np.eye(2),
        status=np.where(unknown, np.int8(Status.GAP), np.int8(Status.OK)),
        floor=np.where(until == 0, taps.floor[end], taps.floor[leg]),
    )


def _frame_times(taps: Waypoints) -> IntArray:
    """Times (k,), ns, of the taps and of enough moments between them (at least one)."""
    if len(taps) < 2:
        return taps.time_ns
    frames = np.where(taps.straight, np.maximum(-(-np.diff(taps.time_ns) // _STEP_NS), 2), 2)
    spans = [
        np.linspace(start, end, count, endpoint=False).round().astype(np.int64)
        for start, end, count in zip(taps.time_ns[:-1], taps.time_ns[1:], frames.tolist(), strict=True)
    ]
    times: IntArray = np.unique(np.concatenate((*spans, taps.time_ns)))
    return times


_LABELS = LabelSettings(max_sigma_m=math.inf)
"""Positions between taps are never too uncertain, because their sigma is stated."""
_ROWS_A_GROUP = 20_000
"""Rows in a group of the joined files: small enough to read one walk without its neighbours."""


@dataclass(frozen=True)
class LoggedWalk:
    """One walk as its file contains it.

    ``taps.floor`` contains indices into the data set's places. ``tables`` are as in
    :class:`~vislam2tag.sessions.model.Session`: ``wifi``, ``ble`` (as from :func:`.fingerprints.radio_rows`) and
    ``sensors``; each is optional.
    """

    slug: str
    name: str
    place: Storey | None
    """Place of the whole walk; None: the places of its taps."""
    device: str | None
    taps: Waypoints
    tables: Mapping[str, pl.DataFrame]
    first_ns: int
    last_ns: int
    """Times of the first and the last row."""
    started: datetime | None
    """Wall clock at the first row."""
    source: str
    """SHA-256 of the file."""
    file: str
    """Name of the file in the data set's inputs."""
    findings: Sequence[Finding] = ()
    """Findings of the file."""


_File = TypeVar("_File")


def walks_dataset(
    context: ImportContext,
    info: DatasetInfo,
    places: Sequence[Storey],
    files: Sequence[_File],
    read: Callable[[_File], LoggedWalk],
    plans: Mapping[str, Path] = MappingProxyType({}),
) -> Dataset:
    """Label the walks, which must be in the order of their slugs, one at a time, and make their data set.

    ``info`` has one source, to which the checksums of the files are added; the findings of the walks are added, too.
    """
    settings, scratch = DatasetSettings(), context.scratch
    findings: list[Finding] = []
    inputs: dict[str, str] = {}
    for number, file in enumerate(files):
        walk = read(file)
        tables, found = _parts(walk, places, settings)
        write_part(scratch, number, tables)
        findings += found
        inputs[walk.file] = walk.source
        context.progress(walk.slug, len(files))
    joined = {name: _joined(scratch, name, rows) for name, rows in tables_of(scratch.path).items()}
    joined[ACCESS_POINTS] = access_points_of(scratch.path, joined[FINGERPRINTS], joined[READINGS]).lazy()
    (source,) = info.sources
    known = {**source.settings, "tap_sigma_m": TAP_SIGMA_M, "pace_m2_s": PACE_M2_S}
    source = source.model_copy(update={"settings": known, "inputs": inputs | source.inputs})
    ble = Grouping(technology="ble", by="window", window_s=settings.ble_window_s)
    made = {
        "groupings": (ble, Grouping(technology="wifi", by="scan")),
        "sources": (source,),
        "findings": (*info.findings, *summed_findings(findings)),
    }
    return Dataset(info.model_copy(update=made), joined, {}, plans)


def _parts(
    walk: LoggedWalk, places: Sequence[Storey], settings: DatasetSettings
) -> tuple[dict[str, pl.DataFrame], list[Finding]]:
    """Label a walk; return its rows of all tables, and its findings."""
    trajectory = trajectory_between(walk.taps)
    motion = PhoneMotion.of(_frames(trajectory))
    who = SessionWalk(walk.slug, "", walk.device or "", walk.name, motion)
    labelled = {name: _labelled(table, trajectory) for name, table in walk.tables.items() if table.height}
    radio = (name for name in TECHNOLOGIES if name in labelled)
    tables, found = radio_parts(
        fingerprints_of({name: labelled[name]}, name, who, settings, math.inf) for name in radio
    )
    names, scans = tables.pop(NAMES), tables[FINGERPRINTS].height
    tables[MAGNETIC] = empty_table(MAGNETIC)
    if "sensors" in labelled:
        sensors = labelled["sensors"].with_columns(device=pl.lit(walk.device, pl.String))
        tables[MAGNETIC] = magnetic_windows(sensors, walk.slug, "", settings.magnetic_window_s)
    tables = {name: _placed(rows, places) for name, rows in tables.items()}
    tables[FINGERPRINTS] = tables[FINGERPRINTS].with_columns(_date(walk), device=pl.lit(walk.device))
    tables[SESSIONS] = _session(walk, places, motion, scans)
    parts = {name: in_schema(name, rows) for name, rows in tables.items()}
    return {**parts, NAMES: names}, [*walk.findings, *_tap_findings(walk), *found]


def _joined(scratch: Folder, table: str, rows: pl.LazyFrame) -> pl.LazyFrame:
    """Stream the walks' files of a table into one, which is read often."""
    whole = f"{table}.parquet"
    write_parquet(rows, scratch, whole, row_group_size=_ROWS_A_GROUP)
    scratch.remove_tree(table)
    return scan_parquet(scratch / whole)


def _placed(rows: pl.DataFrame, places: Sequence[Storey]) -> pl.DataFrame:
    """Turn indices of places into buildings and floors."""
    floors = dict(enumerate(place.floor for place in places))
    placed = rows.with_columns(floor=pl.col("floor").replace_strict(floors, default=None, return_dtype=pl.Int32))
    if "building" not in rows.columns:
        return placed
    buildings = dict(enumerate(place.building for place in places))
    return placed.with_columns(building=rows["floor"].replace_strict(buildings, default="", return_dtype=pl.String))


def _session(walk: LoggedWalk, places: Sequence[Storey], motion: PhoneMotion, fingerprints: int) -> pl.DataFrame:
    visited = [walk.place] if walk.place else [places[index] for index in set(walk.taps.floor.tolist())]
    floors, buildings = ({getattr(place, part) for place in visited} for part in ("floor", "building"))
    known_s = np.diff(walk.taps.time_ns)[walk.taps.straight].sum() * 1e-9
    return pl.DataFrame(
        {
            "session": walk.slug,
            "building": buildings.pop() if len(buildings) == 1 else "",
            "floor": floors.pop() if len(floors) == 1 else None,
            "device": walk.device,
            "name": walk.name,
            "started": walk.started,
            "duration_s": (walk.last_ns - walk.first_ns) * 1e-9,
            "distance_m": float(walk.taps.leg_m.sum()),
            "labelled_s": float(known_s),
            "labelled_m": round(motion.labelled_m, 2),
            "fingerprints": fingerprints,
            "source": walk.source,
        }
    )


def summed_findings(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Sum findings of one kind and message over walks, in order of the first; the first file by name is named."""
    groups: dict[tuple[str, str], list[Finding]] = {}
    for finding in findings:
        groups.setdefault((finding.kind, finding.message), []).append(finding)
    found = []
    for same in groups.values():
        first, count = min(same, key=lambda each: each.file), sum(each.count for each in same)
        found.append(same[0].model_copy(update={"count": count, "file": first.file, "lines": first.lines}))
    return tuple(found)


def _tap_findings(walk: LoggedWalk) -> list[Finding]:
    if len(walk.taps) >= 2:
        return []
    message = "walks with fewer than two taps: none of their readings has a position"
    return [Finding(kind="too_few_taps", file=walk.name, count=1, message=message)]


def _date(walk: LoggedWalk) -> pl.Expr:
    """The date of each fingerprint; a walk may end on the next day."""
    if walk.started is None:
        return pl.lit(None, pl.Date).alias("date")
    since_us = (pl.col("start_ns") - walk.first_ns) // 1000
    return (pl.lit(walk.started) + pl.duration(microseconds=since_us)).dt.date().alias("date")


def _labelled(table: pl.DataFrame, trajectory: Trajectory) -> pl.DataFrame:
    rows = label_readings(table, trajectory, _LABELS)
    return rows if "floor" in rows.columns else rows.with_columns(floor=pl.lit(None, pl.Int32))


def _frames(trajectory: Trajectory) -> pl.DataFrame:
    """The trajectory in the columns that the motion is read from."""
    unknown = pl.lit(None, pl.Float64)
    return pl.DataFrame(
        {
            "time_ns": trajectory.time_ns,
            "x": pl.Series(trajectory.position_bcs[:, 0], nan_to_null=True),
            "y": pl.Series(trajectory.position_bcs[:, 1], nan_to_null=True),
            "status": status_text(trajectory.status),
        }
    ).with_columns(qx=unknown, qy=unknown, qz=unknown, qw=unknown)
