from __future__ import annotations

import io
from pathlib import Path

import pytest
from PIL import Image

from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.studio.receiving.server import PLAN_SIDE_PX, plan_jpeg, survey_facts
from vislam2tag.survey.discover import read_site


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("survey")
    simulate(regular_survey(5, "none", (0, 1), ("LG",), 1, 5.0), folder, WritingOptions())
    for plan in (folder / "floor_1").glob("floorplan.*"):
        plan.unlink()
    return folder


def test_floors_are_told_as_the_survey_has_them(survey: Path) -> None:
    facts = survey_facts(survey)
    assert facts.name == survey.name
    assert [(floor.number, floor.plan) for floor in facts.floors] == [(0, True), (1, False)]
    extents = {floor.number: floor.extent_m for floor in read_site(survey)[0].floors}
    assert {floor.number: floor.extent_m for floor in facts.floors} == extents
    assert extents[0] is not None
    landmarks = read_site(survey)[0].landmarks
    for floor in facts.floors:
        own = landmarks.on_floor(floor.number)
        assert floor.landmarks.keys() == set(own.ids)
        assert floor.landmarks[own.ids[0]] == pytest.approx(own.position_bcs[0])


def test_a_plan_is_a_picture_of_exactly_the_floor_s_extent(survey: Path) -> None:
    data = plan_jpeg(survey, 0)
    assert data is not None
    width, height = Image.open(io.BytesIO(data)).size
    extent = survey_facts(survey).floors[0].extent_m
    assert extent is not None
    left, right, low, high = extent
    assert max(width, height) <= PLAN_SIDE_PX
    assert width / height == pytest.approx((right - left) / (high - low), rel=0.01)
    assert plan_jpeg(survey, 1) is None
    assert plan_jpeg(survey, 9) is None


def test_a_folder_without_floors_has_its_name_only(tmp_path: Path) -> None:
    assert survey_facts(tmp_path).model_dump() == {"name": tmp_path.name, "floors": ()}
