from __future__ import annotations

from pathlib import Path

from tests.report.factory import failed_result, make_result, make_survey
from vislam2tag.core.status import STATUS_LABELS
from vislam2tag.report.layers import RAW, VISITS, WIFI, session_part, session_traces
from vislam2tag.results import Drawing, SessionResult, Stretch, VisitMark


def result_with(tmp_path: Path, **changes: object) -> SessionResult:
    return make_result(make_survey(tmp_path, plan=False).sessions[0]).model_copy(update=changes)


def test_there_is_a_trace_for_every_layer(tmp_path: Path) -> None:
    layers = {trace["meta"] for trace in session_traces()}
    assert layers == {RAW, WIFI, VISITS, *STATUS_LABELS}
    assert set(session_part(result_with(tmp_path))["layers"]) <= layers


def test_stretches_of_a_layer_stay_apart(tmp_path: Path) -> None:
    drawing = Drawing(
        mapped=[Stretch(status="ok", points=[(0.0, 1.0), (2.004, 3.0)]), Stretch(status="ok", points=[(4.0, 5.0)])],
        discarded=[Stretch(status="break", points=[]), Stretch(status="tracking_lost", points=[(6.0, 7.0)])],
        raw=[],
        wifi=[(8.0, 9.0)],
    )
    layers = session_part(result_with(tmp_path, drawing=drawing, visits=[]))["layers"]
    assert layers == {
        "ok": [[0.0, 2.0, None, 4.0], [1.0, 3.0, None, 5.0]],
        "tracking_lost": [[6.0], [7.0]],
        "wifi": [[8.0], [9.0]],
    }


def test_only_mapped_visits_are_drawn_and_text_is_escaped(tmp_path: Path) -> None:
    visits = [
        VisitMark(landmark="<b>7", time_ns=5_000_000_000, distance_m=0.5, position=(1.0, 2.0)),
        VisitMark(landmark="8", time_ns=6_000_000_000, distance_m=0.5, position=None),
    ]
    part = session_part(result_with(tmp_path, visits=visits, start_ns=2_000_000_000, device="A&B"))
    assert part["name"].startswith("A&B / ")
    assert part["hover"].startswith("A&amp;B / ")
    x, y, text = part["layers"][VISITS]
    assert (x, y) == ([1.0], [2.0])
    assert text[0].endswith(": landmark &lt;b&gt;7, 0.50 m away after 3 s")


def test_failed_session_draws_nothing(tmp_path: Path) -> None:
    assert session_part(failed_result(make_survey(tmp_path, plan=False).sessions[0]))["layers"] == {}
