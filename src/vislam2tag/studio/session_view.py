"""Sessions for the page: the list, and the details of one session.

Its charts show measured and computed values over time, thinned without losing extremes.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from enum import IntEnum
from typing import Any, TypeAlias

import numpy as np
import polars as pl

from vislam2tag.common.findings import Severity
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.status import Status, has_position, labelled_share
from vislam2tag.core.tracks import LandmarkLog
from vislam2tag.datasets.label_comparison import mean_error_m
from vislam2tag.labeling.results import Drawing, EventMark, SessionResult, VisitMark
from vislam2tag.labeling.tables import STATUS_TYPE
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.sessions.prepared import prepared_session
from vislam2tag.site.corrections.file import session_start
from vislam2tag.site.model import SessionKey
from vislam2tag.studio import messages, outputs
from vislam2tag.studio.messages import seen_as
from vislam2tag.studio.outputs import Columns, Track
from vislam2tag.studio.routing import endpoint
from vislam2tag.studio.used_corrections import used_corrections
from vislam2tag.studio.workspace import Workspace
from vislam2tag.views.run_summary import expected_mean_error

DRAWN_M = 5.0
"""Maximum distance of frames from a drawn path, because its points are chosen by distance walked."""
_WORST = (Severity.ERROR, Severity.WARNING, Severity.INFO)


@endpoint("GET", "/api/sessions")
def session_list(workspace: Workspace) -> messages.SessionList:
    """All sessions in the order of their folders."""
    version = workspace.refresh().sessions
    stale = workspace.stale()
    return messages.SessionList(version=version, sessions=[_session(workspace, id, stale) for id in workspace.now.ids])


@endpoint("GET", "/api/sessions/{id}")
def session_detail(workspace: Workspace, id: str) -> messages.SessionDetail:
    """Everything about a session except its frames; raises KeyError for an unknown id."""
    view, result = _session(workspace, id, workspace.stale()), workspace.result(id)
    now = workspace.now
    key = now.refs[id].key
    used = used_corrections(now.corrections, now.folder_keys[id], key, result)
    if result is None:
        lists = messages.SessionDetail.model_fields.keys() - {"session", "placing", "used"}
        return messages.SessionDetail(session=view, placing=None, used=used, **{name: list[Any]() for name in lists})
    start_ns = workspace.start_ns(id)
    return seen_as(
        messages.SessionDetail,
        result,
        session=view,
        used=used,
        files=[seen_as(messages.FileView, file) for file in result.files],
        visits=[seen_as(messages.VisitView, visit, **_moment(visit, key, start_ns)) for visit in result.visits],
        events=[
            seen_as(messages.EventView, event, kind=event.kind.value, **_moment(event, key, start_ns))
            for event in result.events
        ],
        discarded=[
            seen_as(messages.DiscardedView, stretch, floor=floor)
            for floor, drawing in _drawings(result).items()
            for stretch in drawing.discarded
        ],
        placing=_placing(result, start_ns),
    )


def _placing(result: SessionResult, start_ns: int) -> messages.PlacingView | None:
    """How a walk was placed on the plan; None if it was not."""
    placing = result.placing
    if placing is None:
        return None
    return seen_as(
        messages.PlacingView,
        placing,
        t=[round((time_ns - start_ns) * 1e-9, 2) for time_ns in placing.time_ns],
        candidates=[seen_as(messages.CandidateView, path) for path in placing.candidates],
        tap_s=placing.best_tap_s(start_ns),
    )


def _moment(mark: VisitMark | EventMark, key: SessionKey, start_ns: int) -> dict[str, Any]:
    """Time and place of an event."""
    x, y = mark.position or (None, None)
    floor = key.floor if mark.floor is None else mark.floor
    return {"t": (mark.time_ns - start_ns) * 1e-9, "x": x, "y": y, "floor": floor}


def _session(workspace: Workspace, id: str, stale: Collection[str]) -> messages.SessionView:
    now, result = workspace.now, workspace.result(id)
    ref, folder = now.refs[id], now.folder_keys[id]
    start = session_start(folder.session)
    return seen_as(
        messages.SessionView,
        ref,
        index=now.ids.index(id),
        id=id,
        folder=folder,
        start=start.isoformat() if start else None,
        date=start.date().isoformat() if start else None,
        excluded=now.corrections.excludes(ref.key),
        stale=id in stale,
        changed=id in workspace.before_slugs,
        tap_s=_tap_s(workspace, id, result),
        **(_NO_LABELS if result is None else _labels(result)),
    )


def _tap_s(workspace: Workspace, id: str, result: SessionResult | None) -> float | None:
    """When a tap would help a walk most; only then its frames are read."""
    if result is None or result.placing is None or result.placing.best_tap_ns is None:
        return None
    return result.placing.best_tap_s(workspace.start_ns(id))


_NO_LABELS: dict[str, Any] = {
    "labelled": False,
    "duration_s": 0.0,
    "distance_m": 0.0,
    "scans": 0,
    **dict.fromkeys(
        ("error", "labelled_share", "sigma_median_m", "expected_error_m", "error_m", "severity", "refused")
    ),
    "frames": {},
    "findings": {},
    "events": {},
    "bounds": {},
    "landmarks": [],
    "floors": [],
}
"""Columns of a session without a result."""


def _labels(result: SessionResult) -> dict[str, Any]:
    """Columns of the list from a session's result."""
    severities = {finding.severity for finding in result.findings}
    placing = result.placing
    drawings = _drawings(result)
    return {
        "labelled": result.error is None,
        "error": result.error,
        "duration_s": result.duration_s,
        "distance_m": result.distance_m,
        "frames": result.frames,
        "labelled_share": labelled_share(result.frames),
        "sigma_median_m": result.sigma.median_m if result.sigma else None,
        "expected_error_m": expected_mean_error(result.sigma) if result.sigma else None,
        "error_m": mean_error_m([result]),
        "findings": {str(finding.kind): finding.count for finding in result.findings},
        "severity": next((severity for severity in _WORST if severity in severities), None),
        "events": dict(Counter(event.kind.value for event in result.events)),
        "landmarks": list(dict.fromkeys(visit.landmark for visit in result.visits if visit.landmark)),
        "scans": result.scans.scans if result.scans else 0,
        "floors": sorted(floor for floor, drawing in drawings.items() if drawing.mapped),
        "bounds": {str(floor): box for floor, drawing in drawings.items() if (box := _box(drawing)) is not None},
        "refused": placing.reason if placing is not None and placing.refused else None,
    }


@endpoint("GET", "/api/sessions/{id}/taps")
def taps(workspace: Workspace, id: str) -> messages.TapsView:
    """The corrected fixes of a walk, mapped or not.

    Raises KeyError if there is no session of this id, SessionError if it cannot be read.
    """
    now = workspace.now
    camera = prepared_session(
        session_task(now.refs[id], now.survey, now.corrections, workspace.settings)
    ).session.camera
    if camera.tracked and all(plan.number != camera.own_floor for plan in camera.plans):
        return messages.TapsView(taps=None)
    if camera.fixes is None:
        return messages.TapsView(taps=[])
    at_s = (camera.fixes.time_ns - camera.time_ns[0]) * 1e-9
    rows = zip(at_s.tolist(), camera.fixes.position_bcs.tolist(), camera.fixes.name, strict=True)
    return messages.TapsView(taps=[messages.TapView(at_s=round(t, 2), x=x, y=y, name=name) for t, (x, y), name in rows])


def _drawings(result: SessionResult) -> dict[int, Drawing]:
    return {result.floor: result.drawing, **result.elsewhere}


def _box(drawing: Drawing) -> messages.Box | None:
    points = [point for stretch in drawing.mapped for point in stretch.points]
    if not points:
        return None
    (left, low), (right, high) = np.min(points, axis=0).tolist(), np.max(points, axis=0).tolist()
    return left, right, low, high


def may_be_within(result: SessionResult | None, floor: int, box: messages.Box) -> bool:
    """Whether a session's walk may lead through a part of a floor, according to its thinned path."""
    drawing = _drawings(result).get(floor) if result else None
    around = _box(drawing) if drawing else None
    if around is None:
        return False
    (left, right, low, high), slack = around, DRAWN_M
    return box[0] - slack <= right and left - slack <= box[1] and box[2] - slack <= high and low - slack <= box[3]


def overview(workspace: Workspace, output: str) -> tuple[Columns, int]:
    """All walks of an output, thinned to be drawn at once; and the stride (:func:`.outputs.overview`)."""
    ids = workspace.now.ids
    results = [workspace.result(id, output) for id in ids]
    frames = sum(n for result in results if result for label, n in result.frames.items() if _POSITIONED[label])
    found = ((i, track) for i, id in enumerate(ids) if (track := workspace.track(id, output)) is not None)
    return outputs.overview(found, frames)


_POSITIONED = {status.label: bool(has_position(np.array([status]))[0]) for status in Status}


Points: TypeAlias = tuple[FloatArray, FloatArray]
"""Times (k,), seconds since the walk's first frame, and values (k,)."""


class Series(IntEnum):
    """Quantities of charts by the number in the column ``series``."""

    SPEED = 0
    HEADING = 1
    HEIGHT = 2
    SIGMA = 3
    LANDMARKS = 4
    """Landmarks in sight."""
    ACCESS_POINTS = 5
    """Access points of each Wi-Fi scan."""
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
    """All time series of a session: labels of an output, and its corrected raw files.

    Raises KeyError if there is no session of this id, SessionError if it cannot be read.
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
    """Time series from the labels."""
    t = track.columns["t"].astype(np.float64)
    found: dict[Series, Points] = {
        series: (t, track.columns[name].astype(np.float64)) for name, series in _OF_TRACK.items()
    }
    return {series: points for series, points in found.items() if np.isfinite(points[1]).any()}


def landmark_series(log: LandmarkLog, time_ns: IntArray, start_ns: int) -> dict[Series, Points]:
    """Number of landmarks in sight at each frame with logged landmarks."""
    seen = ~log.lost if log.seen is None else log.seen & ~log.lost
    if not len(log.frame):
        return {}
    frames = np.unique(log.frame)
    count = np.bincount(log.frame[seen], minlength=int(frames[-1]) + 1)[frames]
    return {Series.LANDMARKS: (np.asarray((time_ns[frames] - start_ns) * 1e-9, np.float64), count.astype(np.float64))}


def table_series(tables: Mapping[str, pl.DataFrame], start_ns: int) -> dict[Series, Points]:
    """Time series from readings: number of access points of scans, and norm of sensor vectors."""
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
    """Minimum and maximum of each bin of time, in the order of time, about ``most`` points in total."""
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
    """All series within a span of time, at most ``most`` points each: ``series`` uint8, ``t`` and ``v`` float32."""
    parts = []
    for series, (t, v) in sorted(found.items()):
        inside = (t >= span_s[0]) & (t <= span_s[1])
        kept_t, kept_v = thinned((t[inside], v[inside]), most)
        parts.append((np.full(len(kept_t), series, np.uint8), kept_t.astype(np.float32), kept_v.astype(np.float32)))
    empty = np.empty(0, np.uint8), np.empty(0, np.float32), np.empty(0, np.float32)
    columns = [np.concatenate(column) for column in zip(empty, *parts, strict=True)]
    return dict(zip(("series", "t", "v"), columns, strict=True))
