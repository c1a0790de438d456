"""What a plan became, a picture of it, and what looks wrong: missing doors, and another size than the file's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import ezdxf.filemanagement
import pytest
from PIL import Image

from tests.site.plans.drawn_floor import HERE, imdf
from vislam2tag.common.errors import SurveyError
from vislam2tag.pipeline.site.init import NewFloor, add_floor
from vislam2tag.pipeline.site.plan_report import PICTURE, report_plan
from vislam2tag.site.plans.source import Extent, PlanSource
from vislam2tag.site.plans.taken_parts import Became, TakenPart
from vislam2tag.site.site_file import FloorPart, GeoreferencePart

ROOMS = [(0, 0, 10, 0), (10, 0, 10, 8), (10, 8, 0, 8), (0, 8, 0, 0), (5, 0, 5, 3), (5, 4, 5, 8)]
"""Two rooms with a door between them, metres."""


def added(folder: Path, *walls: tuple[float, float, float, float], extent: Extent | None = None) -> Path:
    """A site with a floor of these walls."""
    document = ezdxf.filemanagement.new(units=6)
    for x0, y0, x1, y1 in walls:
        document.modelspace().add_line((x0, y0), (x1, y1), {"layer": "A-WALL"})
    document.modelspace().add_line((1, 1), (2, 1), {"layer": "A-FURN"})
    document.saveas(folder / "plan.dxf")
    source = PlanSource(file="plan.dxf", extent=extent)
    add_floor(folder / "site", NewFloor(folder / "plan.dxf", FloorPart(number=0, plan=source)))
    return folder / "site"


def test_what_a_plan_became_is_listed_and_drawn(tmp_path: Path) -> None:
    site = added(tmp_path, *ROOMS)
    found = report_plan(site, 0)
    assert TakenPart("A-WALL", Became.WALLS, len(ROOMS)) in found.taken
    assert ("A-FURN", Became.LEFT_OUT) in [(part.name, part.became) for part in found.taken]
    assert found.warnings == ()
    assert found.picture == site / "floor_0" / PICTURE
    with Image.open(found.picture) as picture:
        assert picture.width > picture.height


def test_closed_rooms_and_another_size_are_warnings(tmp_path: Path) -> None:
    site = added(tmp_path, *ROOMS, (5, 3, 5, 4), extent=Extent(width_m=14.0))
    said = "\n".join(report_plan(site).warnings)
    assert "is closed off" in said
    assert "14.00 m x 11.20 m as given, but 10.00 m x 8.00 m by its file" in said


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"unit_m": 0.01}, ""),
        (
            {"unit_m": 0.002},
            "the floor is 2 m x 1.6 m and its doors are 0.18 m wide, so its scale is wrong: correct --unit-m, or",
        ),
        ({"unit_m": 0.1}, "the floor is 100 m x 80 m and its doors are 9 m wide"),
        ({"distance": {"from": (0, 0), "to": (1000, 0), "metres": 2}}, "scale is wrong: correct --distance, or use"),
    ],
)
def test_a_wrong_scale_is_reported_instead_of_what_follows(tmp_path: Path, given: dict[str, Any], message: str) -> None:
    document = ezdxf.filemanagement.new(units=0)
    for line in ROOMS:
        x0, y0, x1, y1 = (100 * each for each in line)
        document.modelspace().add_line((x0, y0), (x1, y1), {"layer": "A-WALL"})
    for radius in (90, 5):  # a door, and its handle
        document.modelspace().add_arc((500, 300), radius, 0, 90, dxfattribs={"layer": "A-DOOR"})
    document.saveas(tmp_path / "plan.dxf")
    sources = [PlanSource.model_validate({"file": "plan.dxf", **each}) for each in ({"unit_m": 0.0001}, given)]
    impossible, new = (NewFloor(tmp_path / "plan.dxf", FloorPart(number=0, plan=each)) for each in sources)
    with pytest.raises(SurveyError, match=r"correct its scale \(--unit-m 0.01 if a unit is 1 centimetre"):
        add_floor(tmp_path / "site", impossible)
    add_floor(tmp_path / "site", new)
    warnings = report_plan(tmp_path / "site").warnings
    assert len(warnings) == bool(message)
    assert all(
        message in each and each.endswith("use --unit-m 0.01 if a unit is 1 centimetre (10 m x 8 m)")
        for each in warnings
    )


@pytest.mark.parametrize(("level", "warned"), [("0", True), ("1", False)])
def test_the_same_level_twice_is_reported(tmp_path: Path, level: str, warned: bool) -> None:
    venue, earth = imdf(tmp_path), GeoreferencePart(**HERE.model_dump())
    parts = [FloorPart(number=number, plan=PlanSource(file="v", level=one)) for number, one in enumerate(("0", level))]
    for part in parts:
        add_floor(tmp_path / "site", NewFloor(venue, part), georeference=earth)
    warnings = report_plan(tmp_path / "site", 1).warnings
    assert any("floor 1 and floor 0 show the same level 0 of the same file" in each for each in warnings) == warned


def test_a_georeference_with_exchanged_axes_is_reported(tmp_path: Path) -> None:
    exchanged = GeoreferencePart(latitude_deg=HERE.longitude_deg, longitude_deg=HERE.latitude_deg)
    new = NewFloor(imdf(tmp_path), FloorPart(number=0, plan=PlanSource(file="v", level="0")))
    with pytest.raises(SurveyError, match="latitude and longitude of one are exchanged"):
        add_floor(tmp_path / "site", new, georeference=exchanged)
