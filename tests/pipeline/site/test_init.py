"""Options that do not apply to a plan's format are errors that name the formats they apply to."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.site.plans import drawn_floor
from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.pipeline.site.init import NewFloor, add_floor, settled_source
from vislam2tag.site.plans.source import PlanSource
from vislam2tag.site.site_file import FloorPart, GeoreferencePart


@pytest.mark.parametrize(
    ("write", "given", "message"),
    [
        (drawn_floor.png, {"level": "1"}, r"--level: does not apply to .*plan.png.*but to geojson, ifc, imdf, osm"),
        (
            drawn_floor.geojson,
            {"layers": ["W"]},
            "--walls: does not apply to .* of the format geojson, but to dxf",
        ),
        (drawn_floor.dxf, {"page": 2}, "--page: does not apply to .* but to pdf"),
        (drawn_floor.imdf, {"level": "0", "others": "walkable"}, "--others: does not apply to .* but to geojson"),
        (drawn_floor.svg, {"epsg": 25832}, "--epsg: does not apply to .* but to dxf, geojson"),
        (drawn_floor.geojson, {"area": [0, 0, 1, 1]}, "--area: does not apply to .* but to dxf, pdf, raster, svg"),
    ],
)
def test_options_of_other_formats(tmp_path: Path, write: object, given: dict[str, object], message: str) -> None:
    assert callable(write)
    path = write(tmp_path)
    with pytest.raises(UsageError, match=message):
        settled_source(path, PlanSource.model_validate({"file": path.name, **given}))


def test_what_a_page_of_the_studio_always_sends_is_no_option(tmp_path: Path) -> None:
    path = drawn_floor.geojson(tmp_path)
    source = PlanSource(file=path.name, page=1, level=None, area=None)
    assert settled_source(path, source) == (source, [])


def test_an_imdf_folder_becomes_a_floor(tmp_path: Path) -> None:
    folder, survey = drawn_floor.imdf(tmp_path), tmp_path / "survey"
    source, _ = settled_source(folder, PlanSource(file="venue", level="0"))
    here = GeoreferencePart(latitude_deg=50.78, longitude_deg=6.06, bearing_deg=25.0)
    site = add_floor(survey, NewFloor(folder, FloorPart(number=1, plan=source)), georeference=here)
    assert site.floors[0].plan is not None
    assert site.floors[0].plan.file == "floor_1/venue"
    assert sorted(path.name for path in (survey / "floor_1" / "venue").iterdir()) == [
        "level.geojson",
        "opening.geojson",
        "unit.geojson",
    ]


def test_other_folders_are_no_plan(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="is a folder, but not an IMDF archive"):
        settled_source(tmp_path, PlanSource(file="venue"))
