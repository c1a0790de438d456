from __future__ import annotations

import base64
import io
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.views.factory import HEIGHT_M, WIDTH_M, failed_result, make_result, make_survey, unplaced
from vislam2tag.core.status import STATUS_LABELS, EventKind
from vislam2tag.labeling.results import Drawing, EventMark, LandmarkContradiction, SessionResult, Stretch, VisitMark
from vislam2tag.site.model import ControlPoints, Floor, Survey
from vislam2tag.views.floor_map import (
    BAND,
    MAX_PIXELS,
    PATHS,
    RAW,
    VISITS,
    WIFI,
    contradicting,
    event_layer,
    floor_figure,
    plan_data_uri,
    session_part,
    session_traces,
    size_m,
)
from vislam2tag.views.run_report import TimeBar, time_figure

PLAN = "data:image/jpeg;base64,"


def parsed(survey: Survey, floor: Floor, plan: str | None = None) -> Any:
    return json.loads(floor_figure(floor, survey.site.landmarks, plan))


def test_plan_covers_the_floor_in_metres(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, plan=False)
    layout = parsed(survey, survey.site.floors[0], PLAN)["layout"]
    (image,) = layout["images"]
    assert (image["x"], image["y"], image["sizex"], image["sizey"]) == (0, HEIGHT_M, WIDTH_M, HEIGHT_M)
    assert (image["sizing"], image["layer"], image["xref"], image["yref"]) == ("stretch", "below", "x", "y")
    assert layout["yaxis"]["scaleanchor"] == "x"
    assert layout["xaxis"]["range"] == [-1, WIDTH_M + 1]
    assert not layout["xaxis"]["showgrid"]


def test_plan_lies_where_the_floor_has_it(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, plan=False)
    floor = replace(survey.site.floors[0], lower_left_m=(-100.0, 50.0))
    layout = parsed(survey, floor, PLAN)["layout"]
    (image,) = layout["images"]
    assert (image["x"], image["y"], image["sizex"], image["sizey"]) == (-100, 50 + HEIGHT_M, WIDTH_M, HEIGHT_M)
    assert layout["xaxis"]["range"][0] == -101
    assert layout["yaxis"]["range"][1] == 51 + HEIGHT_M


def test_without_a_plan_there_is_a_metric_grid(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, plan=False)
    layout = parsed(survey, survey.site.floors[0])["layout"]
    assert "images" not in layout
    assert layout["xaxis"]["showgrid"]
    assert layout["yaxis"]["showgrid"]


def test_axes_span_what_was_surveyed_outside_the_plan(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, plan=False)
    points = ControlPoints(("far",), np.array([(2.0, 70.0)]))
    survey.site.landmarks.position_bcs[0] = (-38.0, 5.0)
    floor = replace(survey.site.floors[0], control_points=points)
    for size, right, low in ((WIDTH_M, WIDTH_M, -1), (None, 75.0, 4)):
        layout = parsed(survey, replace(floor, width_m=size))["layout"]
        assert layout["xaxis"]["range"] == [-39, right + 1]
        assert layout["yaxis"]["range"] == [low, 71]


def test_axes_of_an_unknown_floor_are_open(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, plan=False)
    nothing = ControlPoints((), np.zeros((0, 2)))
    elsewhere = replace(survey.site.floors[0], number=9, width_m=None, height_m=None, control_points=nothing)
    layout = parsed(survey, elsewhere)["layout"]
    assert "range" not in layout["xaxis"]
    assert "range" not in layout["yaxis"]


def test_landmarks_of_this_floor_by_how_well_they_are_known(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, plan=False)
    traces = {trace["name"]: trace for trace in parsed(survey, survey.site.floors[1])["data"]}
    assert traces["landmark"]["text"] == ["9", "10", "11", "12", "13", "14"]
    assert traces["landmark (not surveyed)"]["text"] == ["15"]
    assert traces["control point"]["text"] == ["A", "B", "C"]
    assert traces["landmark"]["x"][:2] == [9.0, 42.0]


def test_every_trace_is_drawn_as_svg(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, plan=False)
    assert {trace["type"] for trace in parsed(survey, survey.site.floors[0])["data"]} == {"scatter"}


def test_time_figure_stacks_minutes_and_marks_failures() -> None:
    bars = [
        TimeBar("floor 1", "A / 1", "session-a", {"ok": 90.0, "break": 30.0}, failed=False),
        TimeBar("floor 1", "<A> / 2", "session-b", {}, failed=True),
    ]
    figure = json.loads(time_figure(bars))
    traces = {trace["name"]: trace for trace in figure["data"]}
    assert set(traces) == {"labelled (ok)", "break", "failed session"}
    assert traces["labelled (ok)"]["y"] == [1.5, 0.0]
    assert traces["failed session"]["x"] == [1]
    assert traces["failed session"]["hovertext"] == ["floor 1, &lt;A&gt; / 2"]
    assert traces["failed session"]["customdata"] == ["session-b"]
    assert figure["layout"]["barmode"] == "stack"
    assert [note["text"] for note in figure["layout"]["annotations"]] == ["floor 1"]


def test_time_figure_of_no_session_is_empty() -> None:
    assert json.loads(time_figure([]))["data"] == []


def result_with(tmp_path: Path, **changes: object) -> SessionResult:
    return make_result(make_survey(tmp_path, plan=False).sessions[0]).model_copy(update=changes)


def test_there_is_a_trace_for_every_layer(tmp_path: Path) -> None:
    layers = {trace["meta"] for trace in session_traces()}
    assert layers == {BAND, RAW, *PATHS, WIFI, VISITS, *STATUS_LABELS, *map(event_layer, EventKind)}
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


def test_possible_paths_are_drawn_apart_with_their_weights_on_the_own_floor(tmp_path: Path) -> None:
    result = result_with(tmp_path, placing=unplaced(), elsewhere={2: Drawing()}, device="A&B")
    layers = session_part(result)["layers"]
    first, second = (layers[layer] for layer in PATHS if layer in layers)
    assert (first["x"], first["y"]) == ([0.0, 4.0], [1.0, 1.0])
    assert (second["x"], second["y"]) == ([9.0, 9.0], [2.0, 6.0])
    assert [text.partition(": ")[2] for text in first["hover"]] == ["possible path 1 of 2, 60 % probable"] * 2
    assert [text.partition(": ")[2] for text in second["hover"]] == ["possible path 2 of 2, 38 % probable"] * 2
    assert first["hover"][0].startswith("A&amp;B / ")
    assert not set(PATHS) & session_part(result, 2)["layers"].keys()
    assert not set(PATHS) & session_part(result_with(tmp_path))["layers"].keys()


def test_possible_paths_differ_and_the_most_probable_one_is_the_widest() -> None:
    lines = [trace["line"] for trace in session_traces() if trace["meta"] in PATHS]
    assert len({line["color"] for line in lines}) == len(lines) == len(PATHS)
    widths = [line["width"] for line in lines]
    assert widths[0] > widths[1] > widths[2]
    assert widths == sorted(widths, reverse=True)


def test_failed_session_draws_nothing(tmp_path: Path) -> None:
    assert session_part(failed_result(make_survey(tmp_path, plan=False).sessions[0]))["layers"] == {}


def contradiction(offset_m: tuple[float, float], landmark: str = "7") -> LandmarkContradiction:
    return LandmarkContradiction(
        floor=1, landmark=landmark, sessions=2, seen=5, greatest_m=9.0, surveyed_m=(10.0, 20.0), offset_m=offset_m
    )


def test_an_arrow_leads_from_the_survey_to_where_the_walks_put_it() -> None:
    (trace,) = contradicting([contradiction((3.0, -4.0), "<7>")])
    points = np.array([trace["x"][:5], trace["y"][:5]]).T
    np.testing.assert_allclose(points[[0, 1, 3]], [[10, 20], [13, 16], [13, 16]])
    barbs = points[[2, 4]] - points[1]
    np.testing.assert_allclose(np.linalg.norm(barbs, axis=1), 0.25 * 5, atol=1e-3)
    np.testing.assert_allclose(barbs @ [3.0, -4.0] / 25, -0.25 * np.cos(np.pi / 7), atol=1e-3)
    assert trace["x"][5] is None
    assert trace["text"][1] == "&lt;7&gt;: 5.00 m off"
    assert "in 2 of the 5 sessions" in trace["hovertext"][0]
    assert {len(trace[name]) for name in ("x", "y", "text", "textposition", "hovertext")} == {6}


def test_the_text_stands_ahead_of_the_tip() -> None:
    (trace,) = contradicting([contradiction((1.0, 0.0)), contradiction((-1.0, 0.0))])
    assert (trace["textposition"][1], trace["textposition"][7]) == ("middle right", "middle left")


def test_nothing_contradicts_nothing_is_drawn() -> None:
    assert contradicting([]) == []
    assert size_m(contradiction((0.3, 0.4))) == pytest.approx(0.5)


def floor_with(plan: Path) -> Floor:
    return Floor(1, "Floor 1", 20.0, 10.0, None, plan, ControlPoints((), np.empty((0, 2))))


def decoded(uri: str) -> Image.Image:
    head, data = uri.split(",", 1)
    assert head == "data:image/jpeg;base64"
    return Image.open(io.BytesIO(base64.b64decode(data)))


@pytest.mark.parametrize("name", ["plan.jpg", "plan.png", "plan.bmp"])
def test_large_plan_is_scaled_and_keeps_its_shape(tmp_path: Path, name: str) -> None:
    Image.new("RGB", (3000, 1500), "red").save(tmp_path / name)
    image = decoded(plan_data_uri(floor_with(tmp_path / name)))
    assert image.size == (MAX_PIXELS, MAX_PIXELS // 2)
    red, green, blue = image.convert("RGB").resize((1, 1)).tobytes()
    assert red > 240
    assert max(green, blue) < 20


def test_small_plan_keeps_its_size(tmp_path: Path) -> None:
    Image.new("L", (40, 20), 128).save(tmp_path / "plan.png")
    assert decoded(plan_data_uri(floor_with(tmp_path / "plan.png"))).size == (40, 20)


def test_transparent_plan_lies_on_white(tmp_path: Path) -> None:
    Image.new("RGBA", (40, 20), (0, 0, 0, 0)).save(tmp_path / "plan.png")
    assert decoded(plan_data_uri(floor_with(tmp_path / "plan.png"))).convert("L").tobytes() == b"\xff" * 800


@pytest.mark.parametrize("content", [b"", b"no image", b"\xff\xd8\xff\xe0half a JPEG"])
def test_unreadable_plan_is_an_error(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "plan.jpg").write_bytes(content)
    for name, message in (("plan.jpg", "cannot be read as an image"), ("missing.jpg", "does not exist")):
        with pytest.raises(OSError, match=message):
            plan_data_uri(floor_with(tmp_path / name))


def test_cut_off_plan_is_an_error(tmp_path: Path) -> None:
    whole = tmp_path / "whole.png"
    Image.effect_noise((300, 300), 60).save(whole)
    (tmp_path / "half.png").write_bytes(whole.read_bytes()[:20_000])
    with pytest.raises(OSError, match="cannot be read as an image"):
        plan_data_uri(floor_with(tmp_path / "half.png"))
