"""Trajectories as columns of small numbers, thinned for a whole survey or in full, as Arrow for the page."""

from __future__ import annotations

import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import polars as pl

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, StatusArray
from vislam2tag.core.status import Status, has_position
from vislam2tag.evaluation.point_errors import walking_velocity
from vislam2tag.labeling.schemas import SCHEMAS, TRAJECTORY, status_codes

Columns: TypeAlias = Mapping[str, npt.NDArray[Any]]
ARROW = "application/vnd.apache.arrow.stream"
OVERVIEW_POINTS = 120_000
"""Of all sessions together, drawn at once by any machine with a browser."""
WINDOW_POINTS = 400_000
"""Of one window at most; the page asks for fewer."""
LONGEST_GAP_S = 1.0
"""A path is interrupted where there is no frame for longer."""
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
"""Columns of a session's track, metres, seconds and radians; NaN: not known."""
OVERVIEW = tuple(name for name in FULL if not name.startswith("cov_") and name != "heading")


@dataclass(frozen=True)
class Track:
    """The columns of one session, one row a frame in the order of the file: those of :data:`FULL`.

    ``path`` numbers the unbroken stretches of frames with a position, from 0; frames without a position have the number
    of the stretch before.
    """

    columns: Columns
    start_ns: int
    """Time of the walk's first frame on the phone's clock: ``t`` counts from there, as corrections do."""

    def __len__(self) -> int:
        return len(self.columns["t"])

    @property
    def size_bytes(self) -> int:
        """Memory that it takes."""
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
    """All sessions by index, thinned so that ``frames`` positions in all become few; and the stride."""
    stride = max(1, -(-frames // OVERVIEW_POINTS))
    return joined([(index, track.thinned(stride)) for index, track in tracks], OVERVIEW), stride


def window(
    tracks: Iterable[tuple[int, Track]], floor: int, box: tuple[float, float, float, float], most: int = WINDOW_POINTS
) -> tuple[bytes, int]:
    """Frames of sessions, by index, within a box (left, right, lower, upper edge) of a floor, as Arrow; and the stride.

    The stride is more than 1 only where there are more than ``most``. A path that leaves the box ends there; where it
    comes back, another begins.
    """
    inside = [(index, _part(track, floor, box)) for index, track in tracks]
    stride = max(1, -(-sum(len(track) for _, track in inside) // most))
    return arrow([(index, track.rows(slice(None, None, stride))) for index, track in inside], tuple(FULL)), stride


def _part(track: Track, floor: int, box: tuple[float, float, float, float]) -> Track:
    """The frames within a box, their paths numbered anew."""
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
