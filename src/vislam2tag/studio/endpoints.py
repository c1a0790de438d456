"""What can be asked of the studio: each endpoint with what it takes and gives, and the function that answers.

Routes and ``openapi.json`` are both made of :data:`ENDPOINTS`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from vislam2tag.common.records import FiniteRecord
from vislam2tag.studio import corrections_view, diagnosis_view, session_view, survey_view, tracks
from vislam2tag.studio import series as charts
from vislam2tag.studio.collect.covered import covered_floors
from vislam2tag.studio.collect.handover import Handover
from vislam2tag.studio.collect.messages import CollectingView, CoveredFloors
from vislam2tag.studio.comparison import comparison
from vislam2tag.studio.events import Events
from vislam2tag.studio.guard import Guard
from vislam2tag.studio.jobs import JobQueue
from vislam2tag.studio.layer_registry import LAYERS
from vislam2tag.studio.messages import SessionDetail, SessionList, SurveyView, TapsView
from vislam2tag.studio.prepare.dropped import DroppedFiles
from vislam2tag.studio.prepare.work import Worker
from vislam2tag.studio.queries import (
    CompareQuery,
    FloorQuery,
    NoQuery,
    OfOutput,
    PlanQuery,
    RadioQuery,
    SeriesQuery,
    WindowQuery,
)
from vislam2tag.studio.radio.messages import RadioView
from vislam2tag.studio.receiving.address import code_of, url_for
from vislam2tag.studio.sharing.shared import SharedView, shared_view
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

_Record = TypeVar("_Record", bound=FiniteRecord)


@dataclass(frozen=True)
class Studio:
    """All that answers are made of."""

    workspace: Workspace
    jobs: JobQueue
    diagnoses: diagnosis_view.Diagnoses
    events: Events
    guard: Guard
    handover: Handover
    dropped: DroppedFiles
    worker: Worker


@dataclass(frozen=True)
class Asked:
    """A request that was let in: what stands in its path, its query and body as records, its header If-Match, and the
    file that it brings.
    """

    path: dict[str, str]
    query: FiniteRecord
    body: FiniteRecord
    if_match: str | None
    content: bytes = b""

    def of(self, kind: type[_Record]) -> _Record:
        """The query or body, whichever is of a kind."""
        found = self.query if isinstance(self.query, kind) else self.body
        assert isinstance(found, kind)
        return found


@dataclass(frozen=True)
class Binary:
    """An answer that is no JSON; ``version`` tells whether the browser has it already."""

    content: bytes
    media_type: str
    headers: dict[str, str] = field(default_factory=dict)
    version: str | None = None


def _survey(studio: Studio, _asked: Asked) -> SurveyView:
    studio.workspace.refresh()
    return survey_view.survey_view(studio.workspace)


def _plan(studio: Studio, asked: Asked) -> Binary:
    floor = studio.workspace.now.survey.site.floor(int(asked.path["number"]))
    return Binary(
        survey_view.plan_png(floor, asked.of(PlanQuery).side), "image/png", {"Cache-Control": "private, max-age=86400"}
    )


def _session(studio: Studio, asked: Asked) -> SessionDetail:
    return session_view.session_detail(studio.workspace, asked.path["id"])


def _overview(studio: Studio, asked: Asked) -> Binary:
    workspace, output = studio.workspace, asked.of(OfOutput).output
    chosen = workspace.outputs[output]
    version = f"{output}-{chosen.stamp()}-{workspace.refresh().sessions}-{len(workspace.before_slugs)}"
    columns, stride = session_view.overview(workspace, output)
    return Binary(tracks.arrow_stream(columns), tracks.ARROW, {"Studio-Stride": str(stride)}, version)


def _window(studio: Studio, asked: Asked) -> Binary:
    workspace, query = studio.workspace, asked.of(WindowQuery)
    box = (query.left, query.right, query.low, query.high)
    found = (
        (i, track)
        for i, id in enumerate(workspace.now.ids)
        if (query.sessions is None or i in query.sessions)
        and session_view.may_be_within(workspace.result(id, query.output), query.floor, box)
        and (track := workspace.track(id, query.output)) is not None
    )
    content, stride = tracks.window(found, query.floor, box, query.points)
    return Binary(content, tracks.ARROW, {"Studio-Stride": str(stride)})


def _track(studio: Studio, asked: Asked) -> Binary:
    id, query = asked.path["id"], asked.of(SeriesQuery)
    track = studio.workspace.track(id, query.output)
    if track is None:
        return Binary(tracks.arrow([], tuple(tracks.FULL)), tracks.ARROW)
    t = track.columns["t"]
    inside = np.asarray((t >= query.start) & (t <= query.end))
    index = studio.workspace.now.ids.index(id)
    return Binary(tracks.arrow([(index, track.rows(inside))], tuple(tracks.FULL)), tracks.ARROW)


def _series(studio: Studio, asked: Asked) -> Binary:
    query = asked.of(SeriesQuery)
    found = charts.session_series(studio.workspace, asked.path["id"], query.output)
    columns = charts.series_columns(found, query.points, (query.start, query.end))
    return Binary(tracks.arrow_stream(columns), tracks.ARROW)


def _scans(studio: Studio, asked: Asked) -> Binary:
    table = charts.scans_table(studio.workspace, asked.of(OfOutput).output)
    return Binary(tracks.arrow_stream({name: table[name].to_numpy() for name in table.columns}), tracks.ARROW)


def _corrections(studio: Studio, _asked: Asked) -> CorrectionsView:
    return corrections_view.corrections_view(studio.workspace)


def _tables(_studio: Studio, _asked: Asked) -> CorrectionTables:
    return corrections_view.correction_tables()


def _preview(studio: Studio, asked: Asked) -> Preview:
    return corrections_view.preview(studio.workspace, asked.of(PreviewRequest))


def _save(studio: Studio, asked: Asked) -> CorrectionsView:
    version = (asked.if_match or "").strip('"')
    return corrections_view.saved(studio.workspace, asked.of(CorrectionsText).text, version)


def _undo(studio: Studio, asked: Asked) -> Undone:
    return corrections_view.undone(studio.workspace, asked.of(UndoRequest))


def _jobs(studio: Studio, _asked: Asked) -> Jobs:
    return Jobs(jobs=studio.jobs.all())


def _new_job(studio: Studio, asked: Asked) -> Job:
    return studio.jobs.submit(asked.of(JobRequest))


def _cancel(studio: Studio, asked: Asked) -> Job:
    return studio.jobs.cancel(int(asked.path["number"]))


def _diagnosis(studio: Studio, _asked: Asked) -> DiagnosisView:
    return studio.diagnoses.view()


def _compare(studio: Studio, asked: Asked) -> ComparisonView:
    query = asked.of(CompareQuery)
    return comparison(studio.workspace, query.a, query.b)


def _layers(_studio: Studio, _asked: Asked) -> Layers:
    found = LAYERS.all()
    return Layers(layers=[LayerInfo(name=name, title=layer.title, shown=layer.shown) for name, layer in found.items()])


def _layer(studio: Studio, asked: Asked) -> LayerView:
    layer = LAYERS.all()[asked.path["name"]]
    return LayerView(features=layer.features(studio.workspace, asked.of(FloorQuery).floor))


def _radio(studio: Studio, _asked: Asked) -> RadioView:
    made = studio.jobs.radio
    if made is None:
        return RadioView(state="none", floors=[], changes=[])
    return made[0].view(stale=made[1] != studio.workspace.refresh().labels)


def _radio_map(studio: Studio, asked: Asked) -> Binary:
    query, made = asked.of(RadioQuery), studio.jobs.radio
    if made is None:
        raise KeyError("radio map")
    _, cells = made[0].layer(query.floor, query.technology, query.layer, query.bssid)
    return Binary(tracks.arrow_stream({"v": cells.ravel()}), tracks.ARROW)


def _collecting(studio: Studio, _asked: Asked) -> CollectingView:
    return studio.handover.view()


def _collect(studio: Studio, _asked: Asked) -> CollectingView:
    return studio.handover.open()


def _end_collecting(studio: Studio, _asked: Asked) -> CollectingView:
    return studio.handover.close()


def _covered(studio: Studio, _asked: Asked) -> CoveredFloors:
    return covered_floors(studio.workspace)


def _invite(studio: Studio, _asked: Asked) -> Invitation:
    url = url_for(studio.guard.host, studio.guard.port, studio.guard.invite())
    return Invitation(url=url, code=code_of(url))


@dataclass(frozen=True)
class Endpoint:
    """A method and path, the function that answers, and records of query, body and answer (None: no JSON)."""

    method: str
    path: str
    answer: Callable[[Studio, Asked], FiniteRecord | Binary]
    gives: type[FiniteRecord] | None
    query: type[FiniteRecord] = NoQuery
    body: type[FiniteRecord] = NoQuery
    status: int = 200
    takes_file: bool = False
    """Whether the body is a file in place of JSON."""


ENDPOINTS = (
    Endpoint("GET", "/api/survey", _survey, SurveyView),
    Endpoint("GET", "/api/floors/{number:short}/plan", _plan, None, PlanQuery),
    Endpoint("GET", "/api/sessions", lambda studio, _: session_view.session_list(studio.workspace), SessionList),
    Endpoint("GET", "/api/sessions/{id}", _session, SessionDetail),
    Endpoint(
        "GET", "/api/sessions/{id}/taps", lambda s, asked: session_view.taps(s.workspace, asked.path["id"]), TapsView
    ),
    Endpoint("GET", "/api/sessions/{id}/track", _track, None, SeriesQuery),
    Endpoint("GET", "/api/sessions/{id}/series", _series, None, SeriesQuery),
    Endpoint("GET", "/api/tracks", _overview, None, OfOutput),
    Endpoint("GET", "/api/tracks/window", _window, None, WindowQuery),
    Endpoint("GET", "/api/scans", _scans, None, OfOutput),
    Endpoint("GET", "/api/corrections", _corrections, CorrectionsView),
    Endpoint("PUT", "/api/corrections", _save, CorrectionsView, body=CorrectionsText),
    Endpoint("POST", "/api/corrections/preview", _preview, Preview, body=PreviewRequest),
    Endpoint("POST", "/api/corrections/undo", _undo, Undone, body=UndoRequest),
    Endpoint("GET", "/api/corrections/tables", _tables, CorrectionTables),
    Endpoint("GET", "/api/jobs", _jobs, Jobs),
    Endpoint("POST", "/api/jobs", _new_job, Job, body=JobRequest, status=202),
    Endpoint("DELETE", "/api/jobs/{number:short}", _cancel, Job),
    Endpoint("GET", "/api/diagnosis", _diagnosis, DiagnosisView),
    Endpoint("GET", "/api/compare", _compare, ComparisonView, CompareQuery),
    Endpoint("GET", "/api/layers", _layers, Layers),
    Endpoint("GET", "/api/layers/{name}", _layer, LayerView, FloorQuery),
    Endpoint("GET", "/api/radio", _radio, RadioView),
    Endpoint("GET", "/api/radio/map", _radio_map, None, RadioQuery),
    Endpoint("GET", "/api/collecting", _collecting, CollectingView),
    Endpoint("POST", "/api/collecting", _collect, CollectingView),
    Endpoint("DELETE", "/api/collecting", _end_collecting, CollectingView),
    Endpoint("GET", "/api/covered", _covered, CoveredFloors),
    Endpoint("GET", "/api/shared", lambda studio, _: shared_view(studio.workspace), SharedView),
    Endpoint("POST", "/api/invitations", _invite, Invitation),
)
