from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tests.views.factory import HEIGHT_M, WIDTH_M, make_survey
from vislam2tag.survey.model import ControlPoints, Floor, Survey
from vislam2tag.views.floor_map import TimeBar, floor_figure, time_figure

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
    assert traces["landmark, not surveyed"]["text"] == ["15"]
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
