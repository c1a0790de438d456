from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from tests.report.factory import HEIGHT_M, WIDTH_M, make_survey
from vislam2tag.report.figures import TimeBar, floor_figure, time_figure
from vislam2tag.survey.model import Floor, Survey


def parsed(survey: Survey, floor: Floor) -> Any:
    return json.loads(floor_figure(floor, survey.site.landmarks))


def test_plan_covers_the_floor_in_metres(tmp_path: Path) -> None:
    survey = make_survey(tmp_path)
    layout = parsed(survey, survey.site.floors[0])["layout"]
    (image,) = layout["images"]
    assert (image["x"], image["y"], image["sizex"], image["sizey"]) == (0, HEIGHT_M, WIDTH_M, HEIGHT_M)
    assert (image["sizing"], image["layer"], image["xref"], image["yref"]) == ("stretch", "below", "x", "y")
    assert layout["yaxis"]["scaleanchor"] == "x"
    assert layout["xaxis"]["range"] == [-1, WIDTH_M + 1]
    assert not layout["xaxis"]["showgrid"]


def test_without_a_plan_there_is_a_metric_grid(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, plan=False)
    layout = parsed(survey, survey.site.floors[0])["layout"]
    assert "images" not in layout
    assert layout["xaxis"]["showgrid"]
    assert layout["yaxis"]["showgrid"]


def test_a_plan_of_unknown_size_is_not_drawn(tmp_path: Path) -> None:
    survey = make_survey(tmp_path)
    layout = parsed(survey, replace(survey.site.floors[0], width_m=None))["layout"]
    assert "images" not in layout
    assert "range" not in layout["xaxis"]


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
