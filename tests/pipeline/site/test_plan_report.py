"""What a plan became, a picture of it, and what looks wrong: missing doors, and another size than the file's."""

from __future__ import annotations

from pathlib import Path

import ezdxf.filemanagement
from PIL import Image

from vislam2tag.pipeline.site.init import NewFloor, add_floor
from vislam2tag.pipeline.site.plan_report import PICTURE, report_plan
from vislam2tag.site.plans.source import Extent, PlanSource
from vislam2tag.site.plans.taken_parts import Became, TakenPart
from vislam2tag.site.site_file import FloorPart

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
