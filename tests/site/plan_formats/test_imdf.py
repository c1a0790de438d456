"""A level of an IMDF archive: what its categories become, and what is ignored."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.site.plans.drawn_floor import LINES, collection, feature, imdf, lonlat
from vislam2tag.site.plan_formats.imdf import read_imdf
from vislam2tag.site.plans.source import PlanSource, Use
from vislam2tag.site.plans.taken_parts import Became, TakenPart


def test_parts_that_were_taken(tmp_path: Path) -> None:
    folder = imdf(tmp_path)
    booth = feature("Polygon", [lonlat(LINES[0])], level_id="L0")
    (folder / "kiosk.geojson").write_text(collection(booth))
    drawing = read_imdf(folder, PlanSource(file="venue", level="g", ignore=("unit=column",)))
    assert drawing.levels == ("0", "1")
    assert drawing.taken == (
        TakenPart("level", Became.OUTLINE, 1),
        TakenPart("unit=column", Became.LEFT_OUT, 1, "ignored as asked"),
        TakenPart("unit=walkway", Became.WALKABLE, 1),
        TakenPart("kiosk", Became.OBSTACLES, 1),
        TakenPart("opening", Became.OPENINGS, 1),
    )
    assert [each.use for each in drawing.polygons] == [Use.OUTLINE, Use.WALKABLE, Use.OBSTACLE]


def test_materials_are_no_floor(tmp_path: Path) -> None:
    folder = imdf(tmp_path)
    wall = feature("Polygon", [lonlat(LINES[0])], level_id="L0", category="brick")
    (folder / "unit.geojson").write_text(collection(wall))
    drawing = read_imdf(folder, PlanSource(file="venue", level="0"))
    assert TakenPart("unit=brick", Became.OBSTACLES, 1) in drawing.taken


def test_a_level_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="has no level 7; there are: 0, 1"):
        read_imdf(imdf(tmp_path), PlanSource(file="venue", level="7"))
