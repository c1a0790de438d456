"""What can be asked of the studio: one function for each endpoint, whose annotations say what it takes and gives.

What plans, prints and adjusts is imported when it is
first asked for: packages of extras, which the rest does without.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import count
from typing import Annotated, TypeAlias
from urllib.parse import quote

import numpy as np
from pydantic import Field

from vislam2tag.common.addresses import code_of, url_for
from vislam2tag.site.plans.source import PlanSource
from vislam2tag.studio import corrections_view, preparing, session_view, survey_view
from vislam2tag.studio import series as charts
from vislam2tag.studio.collecting import CollectingView, CoveredFloors, Handover, covered_floors
from vislam2tag.studio.events import Events
from vislam2tag.studio.export import SharedView, shared_view
from vislam2tag.studio.guard import Guard
from vislam2tag.studio.jobs import JobQueue, Worker
from vislam2tag.studio.layer_registry import LAYERS
from vislam2tag.studio.messages import (
    MOST_PIXELS,
    RadioLayer,
    SessionDetail,
    SessionList,
    SurveyView,
    TapsView,
    Text,
    WindowQuery,
)
from vislam2tag.studio.outputs import ARROW, FULL, LABELS, arrow, arrow_stream, window
from vislam2tag.studio.preparing import (
    AddedFloor,
    DroppedFile,
    DroppedFiles,
    FloorRequest,
    Name,
    PlanChange,
    PlanLookView,
    PlannedView,
    PlanWish,
    RegisterRequest,
    RegistrationView,
    SheetsView,
    SheetsWish,
    WallsRequest,
    WallsView,
    Written,
)
from vislam2tag.studio.radio import RadioView
from vislam2tag.studio.routing import Binary, endpoint
from vislam2tag.studio.work_messages import (
    ComparisonView,
    CorrectionsText,
    CorrectionsView,
    CorrectionTables,
    DiagnosisView,
    Invitation,
    Job,
    JobRequest,
    Jobs,
    LayerInfo,
    Layers,
    LayerView,
    Preview,
    PreviewRequest,
    Undone,
    UndoRequest,
)
from vislam2tag.studio.workspace import Workspace

Side: TypeAlias = Annotated[int, Field(ge=64, le=MOST_PIXELS)]
"""Longer side of a picture, pixels."""
Points: TypeAlias = Annotated[int, Field(ge=2, le=100_000)]
"""How many points of each series may come, of a walk between two times:"""
From: TypeAlias = Annotated[float, Field(alias="from")]
To: TypeAlias = Annotated[float, Field(alias="to")]
"""Seconds after its first frame."""
PlanPage: TypeAlias = Annotated[int, Field(ge=1)]


@dataclass(frozen=True)
class Studio:
    """All that answers are made of."""

    workspace: Workspace
    jobs: JobQueue
    diagnoses: corrections_view.Diagnoses
    events: Events
    guard: Guard
    handover: Handover
    dropped: DroppedFiles
    worker: Worker


@endpoint("GET", "/api/survey")
def _survey(studio: Studio) -> SurveyView:
    studio.workspace.refresh()
    return survey_view.survey_view(studio.workspace)


@endpoint("GET", "/api/floors/{number:short}/plan")
def _plan(studio: Studio, number: int, side: Side = 2048, stamp: Text = "") -> Binary:
    del stamp  # of the plan, by which the browser keeps its picture
    picture = survey_view.plan_png(studio.workspace.now.survey.site.floor(number), side)
    return Binary(picture, "image/png", {"Cache-Control": "private, max-age=86400"})


@endpoint("GET", "/api/sessions")
def _sessions(studio: Studio) -> SessionList:
    return session_view.session_list(studio.workspace)


@endpoint("GET", "/api/sessions/{id}")
def _session(studio: Studio, id: str) -> SessionDetail:
    return session_view.session_detail(studio.workspace, id)


@endpoint("GET", "/api/sessions/{id}/taps")
def _taps(studio: Studio, id: str) -> TapsView:
    return session_view.taps(studio.workspace, id)


@endpoint("GET", "/api/tracks")
def _overview(studio: Studio, output: Text = LABELS) -> Binary:
    workspace = studio.workspace
    stamp = workspace.outputs[output].stamp()
    version = f"{output}-{stamp}-{workspace.refresh().sessions}-{len(workspace.before_slugs)}"
    columns, stride = session_view.overview(workspace, output)
    return Binary(arrow_stream(columns), ARROW, {"Studio-Stride": str(stride)}, version)


@endpoint("GET", "/api/tracks/window")
def _window(studio: Studio, query: WindowQuery) -> Binary:
    workspace, box = studio.workspace, (query.left, query.right, query.low, query.high)
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
    studio: Studio, id: str, output: Text = LABELS, points: Points = 2000, start: From = -1e9, end: To = 1e9
) -> Binary:
    del points  # all of them are given
    track = studio.workspace.track(id, output)
    if track is None:
        return Binary(arrow([], tuple(FULL)), ARROW)
    t = track.columns["t"]
    inside = np.asarray((t >= start) & (t <= end))
    index = studio.workspace.now.ids.index(id)
    return Binary(arrow([(index, track.rows(inside))], tuple(FULL)), ARROW)


@endpoint("GET", "/api/sessions/{id}/series")
def _series(
    studio: Studio, id: str, output: Text = LABELS, points: Points = 2000, start: From = -1e9, end: To = 1e9
) -> Binary:
    found = charts.session_series(studio.workspace, id, output)
    return Binary(arrow_stream(charts.series_columns(found, points, (start, end))), ARROW)


@endpoint("GET", "/api/scans")
def _scans(studio: Studio, output: Text = LABELS) -> Binary:
    table = charts.scans_table(studio.workspace, output)
    return Binary(arrow_stream({name: table[name].to_numpy() for name in table.columns}), ARROW)


@endpoint("GET", "/api/corrections")
def _corrections(studio: Studio) -> CorrectionsView:
    return corrections_view.corrections_view(studio.workspace)


@endpoint("GET", "/api/corrections/tables")
def _tables(_studio: Studio) -> CorrectionTables:
    return corrections_view.correction_tables()


@endpoint("POST", "/api/corrections/preview")
def _preview(studio: Studio, body: PreviewRequest) -> Preview:
    return corrections_view.preview(studio.workspace, body)


@endpoint("PUT", "/api/corrections")
def _save(studio: Studio, body: CorrectionsText, version: str) -> CorrectionsView:
    return corrections_view.saved(studio.workspace, body.text, version.strip('"'))


@endpoint("POST", "/api/corrections/undo")
def _undo(studio: Studio, body: UndoRequest) -> Undone:
    return corrections_view.undone(studio.workspace, body)


@endpoint("GET", "/api/jobs")
def _jobs(studio: Studio) -> Jobs:
    return Jobs(jobs=studio.jobs.all())


@endpoint("POST", "/api/jobs", status=202)
def _new_job(studio: Studio, body: JobRequest) -> Job:
    return studio.jobs.submit(body)


@endpoint("DELETE", "/api/jobs/{number:short}")
def _cancel(studio: Studio, number: int) -> Job:
    return studio.jobs.cancel(number)


@endpoint("GET", "/api/diagnosis")
def _diagnosis(studio: Studio) -> DiagnosisView:
    return studio.diagnoses.view()


@endpoint("GET", "/api/compare")
def _compare(studio: Studio, a: Text, b: Text) -> ComparisonView:
    return survey_view.comparison(studio.workspace, a, b)


@endpoint("GET", "/api/layers")
def _layers(_studio: Studio) -> Layers:
    return Layers(layers=[LayerInfo(name=n, title=one.title, shown=one.shown) for n, one in LAYERS.all().items()])


@endpoint("GET", "/api/layers/{name}")
def _layer(studio: Studio, name: str, floor: int) -> LayerView:
    return LayerView(features=LAYERS.all()[name].features(studio.workspace, floor))


@endpoint("GET", "/api/radio")
def _radio(studio: Studio) -> RadioView:
    if studio.jobs.radio is None:
        return RadioView(state="none", floors=[], changes=[])
    made, labels = studio.jobs.radio
    return made.view(stale=labels != studio.workspace.refresh().labels)


@endpoint("GET", "/api/radio/map")
def _radio_map(studio: Studio, floor: int, technology: Text, layer: RadioLayer, bssid: Text = "") -> Binary:
    if studio.jobs.radio is None:
        raise KeyError("radio map")
    _, cells = studio.jobs.radio[0].layer(floor, technology, layer, bssid)
    return Binary(arrow_stream({"v": cells.ravel()}), ARROW)


@endpoint("GET", "/api/collecting")
def _collecting(studio: Studio) -> CollectingView:
    return studio.handover.view()


@endpoint("POST", "/api/collecting")
def _collect(studio: Studio) -> CollectingView:
    return studio.handover.open()


@endpoint("DELETE", "/api/collecting")
def _end_collecting(studio: Studio) -> CollectingView:
    return studio.handover.close()


@endpoint("GET", "/api/covered")
def _covered(studio: Studio) -> CoveredFloors:
    return covered_floors(studio.workspace)


@endpoint("GET", "/api/shared")
def _shared(studio: Studio) -> SharedView:
    return shared_view(studio.workspace)


@endpoint("POST", "/api/invitations")
def _invite(studio: Studio) -> Invitation:
    url = url_for(studio.guard.host, studio.guard.port, studio.guard.invite())
    return Invitation(url=url, code=code_of(url))


@endpoint("POST", "/api/prepare/files")
def _drop(studio: Studio, name: Name, content: bytes) -> DroppedFile:
    return studio.dropped.keep(name, content)


@endpoint("GET", "/api/prepare/files/{number:short}/look")
def _look(studio: Studio, number: int, page: PlanPage = 1, level: str | None = None) -> PlanLookView:
    source = PlanSource(file="plan", page=page, level=level)
    return preparing.look(studio.dropped.path(number), source, studio.workspace.root)


@endpoint("GET", "/api/prepare/files/{number:short}/picture")
def _picture(studio: Studio, number: int, page: PlanPage = 1, level: str | None = None) -> Binary:
    source = PlanSource(file="plan", page=page, level=level)
    return Binary(preparing.picture_png(studio.dropped.path(number), source), "image/png")


@endpoint("POST", "/api/prepare/floors")
def _add_floor(studio: Studio, body: FloorRequest) -> AddedFloor:
    return preparing.add_dropped(studio.workspace, studio.dropped.path(body.file), body)


_PLANS = count(1)


@endpoint("POST", "/api/prepare/plans")
def _plan_landmarks(studio: Studio, body: PlanWish) -> PlannedView:
    from vislam2tag.studio.planning import make_plan

    workspace = studio.workspace
    workspace.now.survey.site.floor(body.floor)
    return studio.worker.do(make_plan, next(_PLANS), workspace.root, body, workspace.settings)


@endpoint("POST", "/api/prepare/plans/change")
def _change(studio: Studio, body: PlanChange) -> PlannedView:
    from vislam2tag.studio.planning import change_plan

    return studio.worker.do_latest(change_plan, body)


@endpoint("POST", "/api/prepare/plans/write")
def _write_plan(studio: Studio, body: PlanChange) -> Written:
    from vislam2tag.studio.planning import write_plan

    written = studio.worker.do(write_plan, body, studio.workspace.root)
    studio.workspace.refresh()
    return Written(count=written, where=str(studio.workspace.root))


@endpoint("POST", "/api/prepare/sheets")
def _sheets(studio: Studio, body: SheetsWish) -> SheetsView:
    from vislam2tag.studio.planning import made_sheets

    return studio.worker.do(made_sheets, studio.workspace.root, body, studio.workspace.settings.sheets)


@endpoint("GET", "/api/prepare/sheets/pdf")
def _sheets_pdf(studio: Studio) -> Binary:
    from vislam2tag.studio.planning import sheets_folder, sheets_pdf

    name = sheets_folder(studio.workspace.root).name
    headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{quote(name)}.pdf"}
    return Binary(sheets_pdf(studio.workspace.root), "application/pdf", headers)


@endpoint("POST", "/api/prepare/positions")
def _register(studio: Studio, body: RegisterRequest) -> RegistrationView:
    workspace = studio.workspace
    found = preparing.registered(workspace.root, studio.dropped, body, workspace.settings.registration)
    if body.write:
        workspace.refresh()
    return found


@endpoint("POST", "/api/prepare/walls")
def _walls(studio: Studio, body: WallsRequest) -> WallsView:
    from vislam2tag.studio.planning import corrected_floor

    workspace = studio.workspace
    found = studio.worker.do(corrected_floor, workspace.root, body, workspace.settings.walkable)
    if body.write:
        workspace.refresh()
    return found
