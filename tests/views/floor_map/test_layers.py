from __future__ import annotations

from pathlib import Path

from tests.views.factory import failed_result, make_result, make_survey
from vislam2tag.core.faults import EventKind
from vislam2tag.core.status import STATUS_LABELS
from vislam2tag.labeling.results import Drawing, EventMark, SessionResult, Stretch, VisitMark
from vislam2tag.views.floor_map import BAND, RAW, VISITS, WIFI, event_layer, session_part, session_traces


def result_with(tmp_path: Path, **changes: object) -> SessionResult:
    return make_result(make_survey(tmp_path, plan=False).sessions[0]).model_copy(update=changes)


def test_there_is_a_trace_for_every_layer(tmp_path: Path) -> None:
    layers = {trace["meta"] for trace in session_traces()}
    assert layers == {BAND, RAW, WIFI, VISITS, *STATUS_LABELS, *map(event_layer, EventKind)}
    assert set(session_part(result_with(tmp_path))["layers"]) <= layers - {BAND}


def test_stretches_of_a_layer_stay_apart(tmp_path: Path) -> None:
    drawing = Drawing(
        mapped=[Stretch(status="ok", points=[(0.0, 1.0), (2.004, 3.0)]), Stretch(status="ok", points=[(4.0, 5.0)])],
        discarded=[Stretch(status="break", points=[]), Stretch(status="tracking_lost", points=[(6.0, 7.0)])],
        raw=[],
        wifi=[(8.0, 9.0)],
    )
    layers = session_part(result_with(tmp_path, drawing=drawing, visits=[], events=[]))["layers"]
    assert layers == {
        "ok": {"x": [0.0, 2.0, None, 4.0], "y": [1.0, 3.0, None, 5.0]},
        "tracking_lost": {"x": [6.0], "y": [7.0]},
        "wifi": {"x": [8.0], "y": [9.0]},
    }


def test_sigma_stays_with_its_points(tmp_path: Path) -> None:
    stretches = [
        Stretch(status="ok", points=[(0.0, 0.0), (1.0, 0.0)], sigma_m=[0.1, 0.2]),
        Stretch(status="uncertain", points=[(1.0, 0.0)], sigma_m=[0.6]),
        Stretch(status="ok", points=[(2.0, 0.0)]),
    ]
    drawing = Drawing(mapped=stretches)
    layers = session_part(result_with(tmp_path, drawing=drawing, visits=[], events=[]))["layers"]
    assert layers["ok"]["sigma"] == [0.1, 0.2, None, None]
    assert layers["uncertain"]["sigma"] == [0.6]


def test_events_are_drawn_by_kind_where_they_have_a_place(tmp_path: Path) -> None:
    events = [
        EventMark(time_ns=5_000_000_000, kind=EventKind.BREAK, size_m=1.234, turn_rad=-0.1, position=(1.0, 2.0)),
        EventMark(time_ns=6_000_000_000, kind=EventKind.LOSS, size_m=0.5, turn_rad=None, position=None),
        EventMark(time_ns=7_000_000_000, kind=EventKind.BREAK, size_m=0.5, turn_rad=None, position=(3.0, 4.0)),
    ]
    part = session_part(result_with(tmp_path, events=events, start_ns=2_000_000_000, drawing=Drawing(), visits=[]))
    assert set(part["layers"]) == {"event_break"}
    columns = part["layers"]["event_break"]
    assert (columns["x"], columns["y"]) == ([1.0, 3.0], [2.0, 4.0])
    assert columns["hover"][0].endswith(": break of 1.23 m, turned by -5.7° after 3 s")
    assert columns["hover"][1].endswith(": break of 0.50 m after 5 s")


def test_only_mapped_visits_are_drawn_and_text_is_escaped(tmp_path: Path) -> None:
    visits = [
        VisitMark(landmark="<b>7", time_ns=5_000_000_000, distance_m=0.5, position=(1.0, 2.0)),
        VisitMark(landmark="8", time_ns=6_000_000_000, distance_m=0.5, position=None),
    ]
    part = session_part(result_with(tmp_path, visits=visits, start_ns=2_000_000_000, device="A&B"))
    assert part["name"].startswith("A&B / ")
    assert part["hover"].startswith("A&amp;B / ")
    columns = part["layers"][VISITS]
    assert (columns["x"], columns["y"]) == ([1.0], [2.0])
    assert columns["hover"][0].endswith(": landmark &lt;b&gt;7, 0.50 m away after 3 s")


def test_each_floor_has_its_own_share_of_a_walk(tmp_path: Path) -> None:
    own = Drawing(mapped=[Stretch(status="ok", points=[(0.0, 1.0)])], raw=[(0.0, 1.0)])
    other = Drawing(mapped=[Stretch(status="ok", points=[(5.0, 6.0)])])
    visits = [
        VisitMark(landmark="7", time_ns=0, distance_m=0.5, position=(1.0, 2.0)),
        VisitMark(landmark="107", time_ns=0, distance_m=0.5, position=(3.0, 4.0), floor=2),
    ]
    result = result_with(tmp_path, drawing=own, elsewhere={2: other}, visits=visits, events=[])
    here, there = session_part(result), session_part(result, 2)
    assert here["layers"].keys() == {"ok", RAW, VISITS}
    assert there["layers"].keys() == {"ok", VISITS}
    assert (here["layers"][VISITS]["x"], there["layers"][VISITS]["x"]) == ([1.0], [3.0])
    assert there["layers"]["ok"]["y"] == [6.0]
    assert here["name"] == there["name"]


def test_failed_session_draws_nothing(tmp_path: Path) -> None:
    assert session_part(failed_result(make_survey(tmp_path, plan=False).sessions[0]))["layers"] == {}
