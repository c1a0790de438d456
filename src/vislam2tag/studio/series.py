"""Charts of one session: what was measured and computed over time, thinned so that no extreme is lost."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import TypeAlias

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.tracks import LandmarkLog
from vislam2tag.labeling.schemas import STATUS_TYPE
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.sessions.prepared import prepared_session
from vislam2tag.studio.outputs import Columns, Track
from vislam2tag.studio.workspace import Workspace

Points: TypeAlias = tuple[FloatArray, FloatArray]
"""Times (k,), seconds since the walk's first frame, and values (k,)."""


class Series(IntEnum):
    """What a chart shows, by the number in the column ``series``."""

    SPEED = 0
    HEADING = 1
    HEIGHT = 2
    SIGMA = 3
    LANDMARKS = 4
    """Landmarks in sight."""
    ACCESS_POINTS = 5
    """Heard by each Wi-Fi scan."""
    ACCELERATION = 6
    TURN_RATE = 7
    MAGNETIC_FIELD = 8
    PRESSURE = 9


SCAN_SCHEMA = {
    "session": pl.UInt16,
    "t": pl.Float32,
    "x": pl.Float32,
    "y": pl.Float32,
    "floor": pl.Int16,
    "access_points": pl.UInt16,
    "status": pl.UInt8,
}
_SENSORS = {
    "ACC": Series.ACCELERATION,
    "GYRO": Series.TURN_RATE,
    "MAG": Series.MAGNETIC_FIELD,
    "PRESSURE": Series.PRESSURE,
}
_OF_TRACK = {"speed": Series.SPEED, "heading": Series.HEADING, "z": Series.HEIGHT, "sigma": Series.SIGMA}


def session_series(workspace: Workspace, id: str, output: str) -> dict[Series, Points]:
    """Everything that is known of a session over time: labels of an output, and its raw files as corrections have them.

    Raises KeyError where there is no session of this id, SessionError where it cannot be read.
    """
    now = workspace.now
    track = workspace.track(id, output)
    task = session_task(now.refs[id], now.survey, now.corrections, workspace.settings)
    session = prepared_session(task).session
    usable_ns = session.camera.time_ns[session.camera.usable]
    start_ns = track.start_ns if track is not None else int(usable_ns[0]) if len(usable_ns) else 0
    return {
        **(track_series(track) if track is not None else {}),
        **landmark_series(session.landmarks, session.camera.time_ns, start_ns),
        **table_series(session.tables, start_ns),
    }


def scans_table(workspace: Workspace, output: str) -> pl.DataFrame:
    """All Wi-Fi scans with a position, of all sessions (:data:`SCAN_SCHEMA`)."""
    parts = []
    for index, id in enumerate(workspace.now.ids):
        result, start_ns = workspace.result(id, output), workspace.start_ns(id)
        if result is not None:
            scans = workspace.output_of(id, output).scans(result)
            parts.append(
                scans.select(
                    pl.lit(index, pl.UInt16).alias("session"),
                    ((pl.col("time_ns") - start_ns) * 1e-9).cast(pl.Float32).alias("t"),
                    pl.col("x", "y").cast(pl.Float32),
                    pl.col("floor").cast(pl.Int16),
                    pl.col("len").cast(pl.UInt16).alias("access_points"),
                    pl.col("status").cast(STATUS_TYPE).to_physical().cast(pl.UInt8),
                )
            )
    return pl.concat(parts) if parts else pl.DataFrame(schema=SCAN_SCHEMA)


def track_series(track: Track) -> dict[Series, Points]:
    """What the labels tell."""
    t = track.columns["t"].astype(np.float64)
    found: dict[Series, Points] = {
        series: (t, track.columns[name].astype(np.float64)) for name, series in _OF_TRACK.items()
    }
    return {series: points for series, points in found.items() if np.isfinite(points[1]).any()}


def landmark_series(log: LandmarkLog, time_ns: IntArray, start_ns: int) -> dict[Series, Points]:
    """How many landmarks were in sight at each frame that any was logged for."""
    seen = ~log.lost if log.seen is None else log.seen & ~log.lost
    if not len(log.frame):
        return {}
    frames = np.unique(log.frame)
    count = np.bincount(log.frame[seen], minlength=int(frames[-1]) + 1)[frames]
    return {Series.LANDMARKS: (np.asarray((time_ns[frames] - start_ns) * 1e-9, np.float64), count.astype(np.float64))}


def table_series(tables: Mapping[str, pl.DataFrame], start_ns: int) -> dict[Series, Points]:
    """What the readings tell: scans by the number of access points, sensors by their length."""
    found: dict[Series, Points] = {}
    if "wifi" in tables and not tables["wifi"].is_empty():
        scans = tables["wifi"].group_by("scan").agg(pl.col("time_ns").min(), pl.len()).sort("time_ns")
        found[Series.ACCESS_POINTS] = (_seconds(scans, start_ns), scans["len"].to_numpy().astype(np.float64))
    if "sensors" in tables:
        for (name,), rows in tables["sensors"].group_by("sensor", maintain_order=True):
            series = _SENSORS.get(str(name))
            if series is not None:
                found[series] = (_seconds(rows, start_ns), _length(rows, series))
    return found


def _length(rows: pl.DataFrame, series: Series) -> FloatArray:
    axes = ("v1",) if series is Series.PRESSURE else ("v1", "v2", "v3")
    values = rows.select(axes).fill_null(float("nan")).to_numpy()
    return values[:, 0] if series is Series.PRESSURE else np.linalg.norm(values, axis=1)


def _seconds(rows: pl.DataFrame, start_ns: int) -> FloatArray:
    return np.asarray((rows["time_ns"].to_numpy() - start_ns) * 1e-9)


def thinned(points: Points, most: int) -> Points:
    """Of each bin of time the least and the greatest value, in the order of time, ``most`` points or so in all."""
    order = np.argsort(points[0], kind="stable")
    t, v = points[0][order], points[1][order]
    known = np.isfinite(v)
    t, v = t[known], v[known]
    if len(t) <= most or most < 2:
        return t, v
    bins = np.minimum(((t - t[0]) / max(t[-1] - t[0], 1e-9) * (most // 2)).astype(np.int64), most // 2 - 1)
    by_value = np.lexsort((v, bins))
    edges = np.flatnonzero(np.diff(bins[by_value]))
    least, greatest = by_value[[0, *(edges + 1)]], by_value[[*edges, len(by_value) - 1]]
    kept = np.unique(np.concatenate((least, greatest)))
    return t[kept], v[kept]


def series_columns(found: Mapping[Series, Points], most: int, span_s: tuple[float, float]) -> Columns:
    """All series within a span of time, of each ``most`` points: ``series`` uint8, ``t`` and ``v`` float32."""
    parts = []
    for series, (t, v) in sorted(found.items()):
        inside = (t >= span_s[0]) & (t <= span_s[1])
        kept_t, kept_v = thinned((t[inside], v[inside]), most)
        parts.append((np.full(len(kept_t), series, np.uint8), kept_t.astype(np.float32), kept_v.astype(np.float32)))
    empty = np.empty(0, np.uint8), np.empty(0, np.float32), np.empty(0, np.float32)
    columns = [np.concatenate(column) for column in zip(empty, *parts, strict=True)]
    return dict(zip(("series", "t", "v"), columns, strict=True))
