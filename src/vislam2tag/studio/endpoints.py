"""The endpoints of the studio: one function each, with annotations of input and output.

Planning, printing and adjusting need packages of extras and are imported on first use.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count
from typing import Annotated, TypeAlias
from urllib.parse import quote

import numpy as np
from pydantic import Field

from vislam2tag.common.addresses import code_of, url_for
from vislam2tag.studio import messages, preparing, session_view, survey_view, work_messages
from vislam2tag.studio.collecting import CollectingView, Handover
from vislam2tag.studio.events import Events
from vislam2tag.studio.fault_view import Diagnoses
from vislam2tag.studio.guard import Guard
from vislam2tag.studio.jobs import JobQueue, Worker
from vislam2tag.studio.layer_registry import LAYERS
from vislam2tag.studio.messages import Text
from vislam2tag.studio.outputs import ARROW, FULL, LABELS, arrow, arrow_stream, window
from vislam2tag.studio.radio import RadioView
from vislam2tag.studio.routing import Binary, endpoint
from vislam2tag.studio.workspace import Workspace

Side: TypeAlias = Annotated[int, Field(ge=64, le=messages.MOST_PIXELS)]
"""Longer side of a picture, pixels."""
Points: TypeAlias = Annotated[int, Field(ge=2, le=100_000)]
"""Maximum number of points of each series of a walk between two times:"""
From: TypeAlias = Annotated[float, Field(alias="from")]
To: TypeAlias = Annotated[float, Field(alias="to")]
"""Seconds after its first frame."""


@dataclass(frozen=True)
class Studio:
    """Data for all answers."""

    workspace: Workspace
    jobs: JobQueue
    diagnoses: Diagnoses
    events: Events
    guard: Guard
    handover: Handover
    dropped: preparing.DroppedFiles
    worker: Worker
    command: str
    """Starts this studio."""


@endpoint("GET", "/api/survey")
def _survey(workspace: Workspace, command: str) -> messages.SurveyView:
    workspace.refresh()
    return survey_view.survey_view(workspace, command)


@endpoint("GET", "/api/floors/{number:short}/plan")
def _plan(workspace: Workspace, number: int, side: Side = 2048, stamp: Text = "") -> Binary:
    del stamp  # version of the plan, for the browser's cache
    picture = survey_view.plan_png(workspace.now.survey.site.floor(number), side)
    return Binary(picture, "image/png", {"Cache-Control": "private, max-age=86400"})


@endpoint("GET", "/api/tracks")
def _overview(workspace: Workspace, output: Text = LABELS) -> Binary:
    stamp = workspace.outputs[output].stamp()
    version = f"{output}-{stamp}-{workspace.refresh().sessions}-{len(workspace.before_slugs)}"
    columns, stride = session_view.overview(workspace, output)
    return Binary(arrow_stream(columns), ARROW, {"Studio-Stride": str(stride)}, version)


@endpoint("GET", "/api/tracks/window")
def _window(workspace: Workspace, query: messages.WindowQuery) -> Binary:
    box = (query.left, query.right, query.low, query.high)
    found = (
        (i, track)
        for i, id in enumerate(workspace.now.ids)
        if (query.sessions is None or i in query.sessions)
        and session_view.may_be_within(workspace.result(id, query.output), query.floor, box)
        and (track := workspace.track(id, query.output)) is not None
    )
    content, stride = window(found, query.floor, box, query.points)
    return Binary(content, ARROW, {"Studio-Stride": str(stride)})


@endpoint("GET", "/api/sessions/{id}/track")
def _track(
    workspace: Workspace,
    id: str,
    output: Text = LABELS,
    points: Points = 2000,
    start: From = -1e9,
    end: To = 1e9,
) -> Binary:
    del points  # all of them are present
    track = workspace.track(id, output)
    if track is None:
        return Binary(arrow([], tuple(FULL)), ARROW)
    t = track.columns["t"]
    inside = np.asarray((t >= start) & (t <= end))
    index = workspace.now.ids.index(id)
    return Binary(arrow([(index, track.rows(inside))], tuple(FULL)), ARROW)


@endpoint("GET", "/api/sessions/{id}/series")
def _series(
    workspace: Workspace,
    id: str,
    output: Text = LABELS,
    points: Points = 2000,
    start: From = -1e9,
    end: To = 1e9,
) -> Binary:
    found = session_view.session_series(workspace, id, output)
    return Binary(arrow_stream(session_view.series_columns(found, points, (start, end))), ARROW)


@endpoint("GET", "/api/scans")
def _scans(workspace: Workspace, output: Text = LABELS) -> Binary:
    table = session_view.scans_table(workspace, output)
    return Binary(arrow_stream({name: table[name].to_numpy() for name in table.columns}), ARROW)


@endpoint("GET", "/api/jobs")
def _jobs(jobs: JobQueue) -> work_messages.Jobs:
    return work_messages.Jobs(jobs=jobs.all())


@endpoint("POST", "/api/jobs", status=202)
def _new_job(jobs: JobQueue, body: work_messages.JobRequest) -> work_messages.Job:
    return jobs.submit(body)


@endpoint("DELETE", "/api/jobs/{number:short}")
def _cancel(jobs: JobQueue, number: int) -> work_messages.Job:
    return jobs.cancel(number)


@endpoint("GET", "/api/diagnosis")
def _diagnosis(diagnoses: Diagnoses) -> work_messages.DiagnosisView:
    return diagnoses.view()


@endpoint("GET", "/api/layers")
def _layers() -> work_messages.Layers:
    return work_messages.Layers(
        layers=[work_messages.LayerInfo(name=n, title=one.title, shown=one.shown) for n, one in LAYERS.all().items()]
    )


@endpoint("GET", "/api/layers/{name}")
def _layer(workspace: Workspace, name: str, floor: int) -> work_messages.LayerView:
    return work_messages.LayerView(features=LAYERS.all()[name].features(workspace, floor))


@endpoint("GET", "/api/radio")
def _radio(workspace: Workspace, jobs: JobQueue) -> RadioView:
    if jobs.radio is None:
        return RadioView(state="none", floors=[], changes=[])
    made, labels = jobs.radio
    return made.view(stale=labels != workspace.refresh().labels)


@endpoint("GET", "/api/radio/map")
def _radio_map(jobs: JobQueue, floor: int, technology: Text, layer: messages.RadioLayer, bssid: Text = "") -> Binary:
    if jobs.radio is None:
        raise KeyError("radio map")
    _, cells = jobs.radio[0].layer(floor, technology, layer, bssid)
    return Binary(arrow_stream({"v": cells.ravel()}), ARROW)


@endpoint("GET", "/api/collecting")
def _collecting(handover: Handover) -> CollectingView:
    return handover.view()


@endpoint("POST", "/api/collecting")
def _collect(handover: Handover) -> CollectingView:
    return handover.open()


@endpoint("DELETE", "/api/collecting")
def _end_collecting(handover: Handover) -> CollectingView:
    return handover.close()


@endpoint("POST", "/api/invitations")
def _invite(guard: Guard) -> work_messages.Invitation:
    url = url_for(guard.host, guard.port, guard.invite())
    return work_messages.Invitation(url=url, code=code_of(url))


@endpoint("POST", "/api/prepare/files")
def _drop(dropped: preparing.DroppedFiles, name: preparing.Name, content: bytes) -> preparing.DroppedFile:
    return dropped.keep(name, content)


_PLANS = count(1)


@endpoint("POST", "/api/prepare/plans")
def _plan_landmarks(workspace: Workspace, worker: Worker, body: preparing.PlanWish) -> preparing.PlannedView:
    from vislam2tag.studio.planning import make_plan

    workspace.now.survey.site.floor(body.floor)
    return worker.do(make_plan, next(_PLANS), workspace.root, body, workspace.settings)


@endpoint("POST", "/api/prepare/rooms")
def _rooms(workspace: Workspace, worker: Worker, body: preparing.RoomsRequest) -> preparing.RoomsView:
    from vislam2tag.studio.planning import excluded_rooms

    found = worker.do(excluded_rooms, workspace.root, body, workspace.settings.walkable)
    if body.at is not None:
        workspace.refresh()
    return found


@endpoint("POST", "/api/prepare/floors/change")
def _change_floor(workspace: Workspace, worker: Worker, body: preparing.FloorChange) -> preparing.ChangedFloor:
    from vislam2tag.studio.planning import changed_floor

    done = worker.do(changed_floor, workspace.root, body)
    workspace.refresh()
    return done


@endpoint("DELETE", "/api/prepare/floors/{number:short}")
def _remove_floor(workspace: Workspace, worker: Worker, number: int) -> preparing.ChangedFloor:
    from vislam2tag.studio.planning import removed_floor

    done = worker.do(removed_floor, workspace.root, number)
    workspace.refresh()
    return done


@endpoint("POST", "/api/prepare/plans/change")
def _change(worker: Worker, body: preparing.PlanChange) -> preparing.PlannedView:
    from vislam2tag.studio.planning import change_plan

    return worker.do_latest(change_plan, body)


@endpoint("POST", "/api/prepare/plans/write")
def _write_plan(workspace: Workspace, worker: Worker, body: preparing.PlanChange) -> preparing.Written:
    from vislam2tag.studio.planning import write_plan

    written = worker.do(write_plan, body, workspace.root)
    workspace.refresh()
    return preparing.Written(count=written, where=str(workspace.root))


@endpoint("POST", "/api/prepare/sheets")
def _sheets(workspace: Workspace, worker: Worker, body: preparing.SheetsWish) -> preparing.SheetsView:
    from vislam2tag.studio.planning import made_sheets

    return worker.do(made_sheets, workspace.root, body, workspace.settings.sheets)


@endpoint("GET", "/api/prepare/sheets/pdf")
def _sheets_pdf(workspace: Workspace) -> Binary:
    from vislam2tag.studio.planning import sheets_folder, sheets_pdf

    name = sheets_folder(workspace.root).name
    headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(name)}.pdf"}
    return Binary(sheets_pdf(workspace.root), "application/pdf", headers)


@endpoint("POST", "/api/prepare/walls")
def _walls(workspace: Workspace, worker: Worker, body: preparing.WallsRequest) -> preparing.WallsView:
    from vislam2tag.studio.planning import corrected_floor

    found = worker.do(corrected_floor, workspace.root, body, workspace.settings.walkable)
    if body.write:
        workspace.refresh()
    return found
