"""Sessions as the page sees them: the list to search and filter, and one with all that happened in it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from typing import Any

import numpy as np

from vislam2tag.common.findings import Severity
from vislam2tag.core.status import Status, has_position, labelled_share
from vislam2tag.datasets.label_comparison import mean_error_m
from vislam2tag.labeling.results import Drawing, EventMark, SessionResult, VisitMark
from vislam2tag.pipeline.run.selection import session_task
from vislam2tag.sessions.prepared import prepared_session
from vislam2tag.site.corrections.file import session_start
from vislam2tag.site.model import SessionKey
from vislam2tag.studio import messages, outputs
from vislam2tag.studio.messages import seen_as
from vislam2tag.studio.outputs import Columns
from vislam2tag.studio.routing import endpoint
from vislam2tag.studio.workspace import Workspace

DRAWN_M = 5.0
"""Frames lie at most so far from a drawn path, whose points are chosen by distance walked."""
_WORST = (Severity.ERROR, Severity.WARNING, Severity.INFO)


@endpoint("GET", "/api/sessions")
def session_list(workspace: Workspace) -> messages.SessionList:
    """All sessions in the order of their folders."""
    version = workspace.refresh().sessions
    stale = workspace.stale()
    return messages.SessionList(version=version, sessions=[_session(workspace, id, stale) for id in workspace.now.ids])


@endpoint("GET", "/api/sessions/{id}")
def session_detail(workspace: Workspace, id: str) -> messages.SessionDetail:
    """Everything of a session but its frames; raises KeyError where there is none of this id."""
    key = workspace.now.refs[id].key
    view, result = _session(workspace, id, workspace.stale()), workspace.result(id)
    if result is None:
        nothing = {name: list[Any]() for name in messages.SessionDetail.model_fields if name != "session"}
        return messages.SessionDetail(session=view, **nothing)
    start_ns = workspace.start_ns(id)
    return seen_as(
        messages.SessionDetail,
        result,
        session=view,
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
    )


def _moment(mark: VisitMark | EventMark, key: SessionKey, start_ns: int) -> dict[str, Any]:
    """When and where something happened."""
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
        **(_NO_LABELS if result is None else _labels(result)),
    )


_NO_LABELS: dict[str, Any] = {
    "labelled": False,
    "duration_s": 0.0,
    "distance_m": 0.0,
    "scans": 0,
    **dict.fromkeys(("error", "labelled_share", "sigma_median_m", "error_m", "severity")),
    "frames": {},
    "findings": {},
    "events": {},
    "bounds": {},
    "landmarks": [],
    "floors": [],
}
"""Of a session without a result."""


def _labels(result: SessionResult) -> dict[str, Any]:
    """What the list shows of a session's result."""
    severities = {finding.severity for finding in result.findings}
    drawings = _drawings(result)
    return {
        "labelled": result.error is None,
        "error": result.error,
        "duration_s": result.duration_s,
        "distance_m": result.distance_m,
        "frames": result.frames,
        "labelled_share": labelled_share(result.frames),
        "sigma_median_m": result.sigma.median_m if result.sigma else None,
        "error_m": mean_error_m([result]),
        "findings": {str(finding.kind): finding.count for finding in result.findings},
        "severity": next((severity for severity in _WORST if severity in severities), None),
        "events": dict(Counter(event.kind.value for event in result.events)),
        "landmarks": list(dict.fromkeys(visit.landmark for visit in result.visits if visit.landmark)),
        "scans": result.scans.scans if result.scans else 0,
        "floors": sorted(floor for floor, drawing in drawings.items() if drawing.mapped),
        "bounds": {str(floor): box for floor, drawing in drawings.items() if (box := _box(drawing)) is not None},
    }


@endpoint("GET", "/api/sessions/{id}/taps")
def taps(workspace: Workspace, id: str) -> messages.TapsView:
    """Where a walk was by its fixes, corrected, whether it could be mapped or not.

    Raises KeyError where there is no session of this id, SessionError where it cannot be read.
    """
    now = workspace.now
    camera = prepared_session(
        session_task(now.refs[id], now.survey, now.corrections, workspace.settings)
    ).session.camera
    if camera.tracked:
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
    """Tell whether a session's walk may lead through a part of a floor, by its thinned path."""
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
