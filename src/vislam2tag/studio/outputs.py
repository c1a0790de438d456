"""Labels in output folders of ``process``, read on request and cached while unchanged.

Trajectories are sent to the page as Arrow columns, thinned for a whole survey or in full.
"""

from __future__ import annotations

import hashlib
import io
import os
import threading
from collections import OrderedDict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import polars as pl

from vislam2tag.common.errors import DatasetError
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, StatusArray
from vislam2tag.core.status import Status, has_position
from vislam2tag.datasets.label_comparison import settings_of_output
from vislam2tag.datasets.labelled import LabelledSession
from vislam2tag.labeling.results import RESULTS, SessionResult
from vislam2tag.labeling.tables import SCHEMAS, TRAJECTORY, status_codes
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.quality.evaluation.truth import walking_velocity

LABELS, BEFORE = "labels", "before"
KEPT_BYTES = 400_000_000
"""Maximum memory of cached tracks."""
_SCAN_COLUMNS = ("scan", "time_ns", "x", "y", "floor", "status")


@dataclass
class _Kept:
    """Cache of file contents by folder and session, valid while the file does not change."""

    most_bytes: int
    _items: OrderedDict[tuple[Path, str], tuple[int, Track]] = field(default_factory=OrderedDict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def get(self, key: tuple[Path, str], stamp: int) -> Track | None:
        with self._lock:
            found = self._items.get(key)
            if found is None or found[0] != stamp:
                return None
            self._items.move_to_end(key)
            return found[1]

    def put(self, key: tuple[Path, str], stamp: int, track: Track) -> None:
        with self._lock:
            self._items[key] = stamp, track
            while sum(kept.size_bytes for _, kept in self._items.values()) > self.most_bytes and len(self._items) > 1:
                self._items.popitem(last=False)


_tracks = _Kept(KEPT_BYTES)


@dataclass
class Output:
    """The labels in one folder; ``slugs`` are the possible names of a session."""

    name: str
    root: Path
    _results: dict[str, tuple[int, SessionResult]] = field(default_factory=dict)

    def stamp(self) -> str:
        """Version of the labels; empty if there are none."""
        try:
            with os.scandir(self.root / RESULTS) as entries:
                found = sorted((entry.name, entry.stat().st_mtime_ns) for entry in entries)
        except OSError:
            return ""
        return hashlib.sha256(repr(found).encode()).hexdigest()[:16]

    def strategy(self) -> str:
        """The strategy of the labels; empty if unknown."""
        return str(self.settings().get("strategy", ""))

    def settings(self) -> dict[str, object]:
        """Settings of the labels; empty if unknown."""
        return settings_of_output(self.root)

    def result(self, slugs: Sequence[str]) -> SessionResult | None:
        """The first existing result under these names."""
        for slug in slugs:
            stamp = _stamp(self.root / RESULTS / f"{slug}.json")
            kept = self._results.get(slug)
            if kept is not None and kept[0] == stamp:
                return kept[1]
            result = OutputFolder(self.root).result(slug) if stamp else None
            if result is not None:
                self._results[slug] = stamp, result
                return result
        return None

    def track(self, result: SessionResult) -> Track | None:
        """The frames of a session; None if it has none, or while they are being written."""
        stamp = _stamp(self.root / TRAJECTORY / f"{result.slug}.parquet")
        key = (self.root, result.slug)
        track = _tracks.get(key, stamp)
        if track is None and stamp:
            try:
                table = LabelledSession(self.root, result.slug).table(TRAJECTORY, TABLE_COLUMNS)
            except DatasetError:
                return None
            track = track_of(table, start_ns_of(result, table))
            _tracks.put(key, stamp, track)
        return track

    def scans(self, result: SessionResult) -> pl.DataFrame:
        """Wi-Fi scans (t, x, y, floor, access_points, status) of a session that have a position."""
        session = LabelledSession(self.root, result.slug)
        if not session.has("wifi"):
            return pl.DataFrame(schema=SCHEMAS["wifi"]).select(_SCAN_COLUMNS)
        try:
            rows = session.table("wifi", _SCAN_COLUMNS, pl.col("x").is_not_null())
        except DatasetError:
            rows = pl.DataFrame(schema=SCHEMAS["wifi"]).select(_SCAN_COLUMNS)
        return (
            rows.group_by("scan", maintain_order=True)
            .agg(pl.col("time_ns").min(), pl.col("x", "y").mean(), pl.col("floor", "status").first(), pl.len())
            .drop("scan")
        )


def start_ns_of(result: SessionResult, table: pl.DataFrame) -> int:
    """Time of the walk's first frame, which is the origin of times in corrections.

    Results of older versions contain the first frame that is not excluded; then the table's first frame counts.
    """
    first = int(table["time_ns"][0]) if len(table) else 0
    return min(first, result.start_ns) if result.start_ns is not None else first


def _stamp(path: Path) -> int:
    """Modification time of a file; 0 if there is none."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


Columns: TypeAlias = Mapping[str, npt.NDArray[Any]]
ARROW = "application/vnd.apache.arrow.stream"
OVERVIEW_POINTS = 120_000
"""Positions of all sessions together, few enough to draw at once in any browser."""
WINDOW_POINTS = 400_000
"""Maximum number of positions in one window; the page requests fewer."""
LONGEST_GAP_S = 1.0
"""Longer gaps between frames interrupt a path."""
TABLE_COLUMNS = tuple(name for name in SCHEMAS[TRAJECTORY] if name not in ("device", "session"))
FULL = {
    "frame": np.uint32,
    "t": np.float32,
    "floor": np.int16,
    **dict.fromkeys(("x", "y", "z"), np.float32),
    "status": np.uint8,
    **dict.fromkeys(("sigma", "cov_xx", "cov_xy", "cov_yy", "speed", "heading"), np.float32),
    "path": np.uint32,
}
"""Columns of a session's track in metres, seconds and radians; NaN: unknown."""
OVERVIEW = tuple(name for name in FULL if not name.startswith("cov_") and name != "heading")


@dataclass(frozen=True)
class Track:
    """The columns :data:`FULL` of one session, with one row per frame in the order of the file.

    ``path`` numbers the unbroken stretches of frames with a position, from 0; frames without a position have the number
    of the stretch before.
    """

    columns: Columns
    start_ns: int
    """Time of the walk's first frame on the phone's clock, the origin of ``t`` and of times in corrections."""

    def __len__(self) -> int:
        return len(self.columns["t"])

    @property
    def size_bytes(self) -> int:
        """Memory size."""
        return sum(column.nbytes for column in self.columns.values())

    @property
    def positioned(self) -> BoolArray:
        """Mask (n,) of the frames with a position."""
        return has_position(self.columns["status"].astype(np.int8))

    def rows(self, wanted: IntArray | BoolArray | slice) -> Track:
        """Some of its rows."""
        return replace(self, columns={name: column[wanted] for name, column in self.columns.items()})

    def thinned(self, stride: int) -> Track:
        """Frames with a position only, each ``stride``-th, and of each path the first and the last."""
        there = self.rows(self.positioned)
        path = there.columns["path"]
        keep = np.arange(len(there)) % stride == 0
        if len(there):
            change = np.flatnonzero(np.diff(path))
            keep[[0, -1, *change.tolist(), *(change + 1).tolist()]] = True
        return there.rows(keep)


def track_of(table: pl.DataFrame, start_ns: int) -> Track:
    """The columns of a trajectory's table (:data:`TABLE_COLUMNS`); times count from ``start_ns``."""
    time_ns = table["time_ns"].to_numpy()
    status = status_codes(table)
    names = ("x", "y", "z", "sigma", "cov_xx", "cov_xy", "cov_yy", "qx", "qy", "qz", "qw")
    values = {name: table[name].cast(pl.Float64).fill_null(float("nan")).to_numpy() for name in names}
    floor = table["floor"].to_numpy()
    columns = {
        "frame": np.arange(len(table)),
        "t": (time_ns - start_ns) * 1e-9,
        "floor": floor,
        "status": status,
        **{name: values[name] for name in names if name in FULL},
        "speed": _speed(time_ns, values["x"], values["y"], status),
        "heading": _heading(*(values[name] for name in ("qx", "qy", "qz", "qw"))),
        "path": _paths(time_ns, floor, status),
    }
    return Track({name: columns[name].astype(kind, copy=False) for name, kind in FULL.items()}, start_ns)


def overview(tracks: Iterable[tuple[int, Track]], frames: int) -> tuple[Columns, int]:
    """All sessions by index, thinned from ``frames`` positions in total; and the stride."""
    stride = max(1, -(-frames // OVERVIEW_POINTS))
    return joined([(index, track.thinned(stride)) for index, track in tracks], OVERVIEW), stride


def window(
    tracks: Iterable[tuple[int, Track]], floor: int, box: tuple[float, float, float, float], most: int = WINDOW_POINTS
) -> tuple[bytes, int]:
    """Frames of sessions, by index, within a box (left, right, lower, upper edge) of a floor, as Arrow; and the stride.

    The stride is greater than 1 only if there are more than ``most``. A path that leaves the box ends there, and
    another one begins when it returns.
    """
    inside = [(index, _part(track, floor, box)) for index, track in tracks]
    stride = max(1, -(-sum(len(track) for _, track in inside) // most))
    return arrow([(index, track.rows(slice(None, None, stride))) for index, track in inside], tuple(FULL)), stride


def _part(track: Track, floor: int, box: tuple[float, float, float, float]) -> Track:
    """The frames within a box, with new numbers of paths."""
    inside = _within(track, floor, box)
    part = track.rows(inside)
    left_out = np.cumsum(track.positioned & ~inside)[inside]
    broken = (np.diff(part.columns["path"]) != 0) | (np.diff(left_out) != 0)
    path = np.concatenate(([0], np.cumsum(broken)))[: len(part)].astype(FULL["path"])
    return replace(part, columns={**part.columns, "path": path})


def _within(track: Track, floor: int, box: tuple[float, float, float, float]) -> BoolArray:
    left, right, low, high = box
    x, y = track.columns["x"], track.columns["y"]
    inside = (x >= left) & (x <= right) & (y >= low) & (y <= high)
    return np.asarray(track.positioned & (track.columns["floor"] == floor) & inside)


def arrow(tracks: Sequence[tuple[int, Track]], names: Sequence[str]) -> bytes:
    """Tracks by the index of their session as an Arrow stream."""
    return arrow_stream(joined(tracks, names))


def joined(tracks: Sequence[tuple[int, Track]], names: Sequence[str]) -> Columns:
    """Columns of tracks by the index of their session; paths are numbered on over all of them."""
    paths, first = [], 0
    for _, track in tracks:
        paths.append(track.columns["path"] + np.uint32(first))
        first += int(track.columns["path"].max(initial=0)) + 1
    columns = {
        "session": np.repeat(np.array([i for i, _ in tracks], np.uint16), [len(track) for _, track in tracks]),
        **{name: _joined([track.columns[name] for _, track in tracks], FULL[name]) for name in names},
    }
    columns["path"] = _joined(paths, np.uint32)
    return columns


def arrow_stream(columns: Columns) -> bytes:
    """Columns of equal length as an Arrow stream of one batch, without nulls."""
    buffer = io.BytesIO()
    pl.DataFrame(dict(columns)).rechunk().write_ipc_stream(buffer, compression="uncompressed")
    return buffer.getvalue()


def _joined(parts: Sequence[npt.NDArray[Any]], kind: Any) -> npt.NDArray[Any]:
    return np.concatenate([np.empty(0, kind), *parts])


def _speed(time_ns: IntArray, x: FloatArray, y: FloatArray, status: StatusArray) -> FloatArray:
    """Speed (n,) over a stride or so, m/s; NaN without a position."""
    usable = np.flatnonzero((status != Status.DUPLICATE) & (status != Status.INVALID))
    speed = np.full(len(time_ns), np.nan)
    if len(usable):
        path = np.column_stack((x[usable], y[usable]))
        speed[usable] = np.linalg.norm(walking_velocity(time_ns[usable], time_ns[usable], path), axis=1)
    return np.where(has_position(status), speed, np.nan)


def _heading(qx: FloatArray, qy: FloatArray, qz: FloatArray, qw: FloatArray) -> FloatArray:
    """Direction (n,) that a camera looks in on the floor, along its own -z, radians from the BCS x axis."""
    return np.arctan2(-2 * (qy * qz - qw * qx), -2 * (qx * qz + qw * qy))


def _paths(time_ns: IntArray, floor: npt.NDArray[Any], status: StatusArray) -> IntArray:
    """Numbers (n,) of the unbroken stretches; frames recorded twice break none."""
    frames = np.flatnonzero(status != Status.DUPLICATE)
    there = has_position(status[frames])
    broken = np.diff(floor[frames]) != 0
    broken |= (np.abs(np.diff(time_ns[frames])) > LONGEST_GAP_S * 1e9) | ~there[:-1]
    starts = np.zeros(len(time_ns), dtype=np.int64)
    starts[frames[1:][broken & there[1:]]] = 1
    return np.cumsum(starts)
