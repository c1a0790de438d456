"""Where a session's floor can be walked, by its plan."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.estimation.dead_reckoning.ilc20 import make_site
from vislam2tag.sessions.drawn_floor import drawing_mark, drawn_area
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.registry import open_survey
from vislam2tag.site.corrections.file import Corrections


def feature(left: float, low: float, right: float, high: float, use: str) -> dict[str, object]:
    corners = [(left, low), (right, low), (right, high), (left, high), (left, low)]
    return {
        "type": "Feature",
        "properties": {"use": use},
        "geometry": {"type": "Polygon", "coordinates": [corners]},
    }


@pytest.fixture
def site(tmp_path: Path) -> Path:
    """A made site whose plan has one block of shops."""
    made = make_site(tmp_path / "site1")
    features = [feature(0, 0, 60, 40, "outline"), feature(20, 10, 40, 30, "obstacle")]
    plan = {"type": "FeatureCollection", "features": features}
    (made / "F1" / "geojson_map.json").write_text(json.dumps(plan), encoding="utf-8")
    return made


def test_a_drawing_tells_a_session_without_poses_where_shops_are(site: Path) -> None:
    survey = open_survey(site)
    area = prepared_session(SessionTask(survey.sessions[0], survey.site, Corrections())).session.camera.area
    assert area is not None
    assert area is drawn_area(survey.site.floor(0)), "it is read once"
    free = area.mask[tuple(area.grid.cells_of(np.array(((5.0, 5.0), (30.0, 20.0), (50.0, 20.0)))).T)]
    assert free.tolist() == [True, False, True]


def test_the_mark_follows_the_drawing(site: Path) -> None:
    floor = open_survey(site).site.floor(0)
    assert floor.plan is not None
    before = drawing_mark(floor)
    floor.plan.write_text(floor.plan.read_text(encoding="utf-8").replace("20", "22"), encoding="utf-8")
    assert None not in (before, drawing_mark(floor))
    assert drawing_mark(floor) != before


def test_images_and_what_cannot_be_read_tell_nothing(site: Path) -> None:
    floor = open_survey(site).site.floor(0)
    assert floor.plan is not None
    assert drawn_area(replace(floor, plan=None)) is None
    assert drawing_mark(replace(floor, plan=floor.plan.with_name("floor_image.png"))) is None
    floor.plan.write_text("no drawing", encoding="utf-8")
    assert drawn_area(floor) is None
