from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from tests.views.factory import make_survey
from vislam2tag.survey.model import Floor, Survey
from vislam2tag.views.run_report import FloorView


def view_of(survey: Survey, floor: Floor | None = None) -> FloorView:
    return FloorView(floor or survey.site.floors[0], survey.site.landmarks, iter(()))


def test_a_floor_with_its_plan_needs_no_note(tmp_path: Path) -> None:
    view = view_of(make_survey(tmp_path, floors=1, sessions=1))
    assert view.notes == []
    assert "images" in json.loads(view.figure)["layout"]
    assert view.unplaced == ["7", "8"]


@pytest.mark.parametrize("content", [b"", b"<html>", b"\xff\xd8\xff\xe0half a JPEG"])
def test_a_plan_that_is_no_image_is_said(tmp_path: Path, content: bytes) -> None:
    survey = make_survey(tmp_path, floors=1, sessions=1)
    plan = survey.site.floors[0].plan
    assert plan is not None
    plan.write_bytes(content)
    view = view_of(survey)
    assert view.notes == ["floorplan.jpg cannot be read as an image: a grid is drawn instead."]
    assert "images" not in json.loads(view.figure)["layout"]


def test_a_missing_plan_and_a_plan_of_unknown_size_are_said(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, floors=1, sessions=1)
    floor = survey.site.floors[0]
    assert view_of(survey, replace(floor, plan=None)).notes == [
        "There is no plan of this floor: a grid is drawn instead."
    ]
    view = view_of(survey, replace(floor, width_m=None))
    assert view.notes == ["floorplan.jpg is not drawn, as no file gives the floor's size: a grid is drawn instead."]
    assert "images" not in json.loads(view.figure)["layout"]


def test_surveyed_landmarks_outside_the_plan_are_named(tmp_path: Path) -> None:
    survey = make_survey(tmp_path, floors=2, sessions=2)
    position = survey.site.landmarks.position_bcs
    for landmark, place in {0: (-38, 5), 2: (5, 43.5), 3: (84.5, -0.5), 6: (-9, 9), 8: (-9, 9)}.items():
        position[landmark] = place
    (note,) = view_of(survey).notes
    assert note == "Surveyed landmarks outside the plan of 84 m x 42 m: 1, 3. Check their positions or its size."
