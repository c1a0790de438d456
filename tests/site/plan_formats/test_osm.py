"""OpenStreetMap's XML shows the same as GeoJSON with its tags: nodes, ways and multipolygons."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.site.plans.drawn_floor import HERE, floor_with, lonlat
from vislam2tag.site.plans.drawing import PlanDrawing, format_of, read_drawing
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.source import PlanSource, Use
from vislam2tag.site.plans.taken_parts import Became, TakenPart

POINTS = {
    1: (0, 0), 2: (4, 0), 3: (8, 0), 4: (8, 4), 5: (4, 4), 6: (0, 4), 7: (0, 9), 8: (8, 9), 9: (2, 4),
    21: (5, 1), 22: (7, 1), 23: (7, 3), 24: (5, 3),
}  # fmt: skip
"""Places of nodes, metres; 9 is a door."""
DOOR = '<tag k="door" v="yes"/>'


def tags(**values: str) -> str:
    return "".join(f'<tag k="{key}" v="{value}"/>' for key, value in values.items())


def way(number: int, nodes: list[int], **values: str) -> str:
    return f'<way id="{number}">' + "".join(f'<nd ref="{node}"/>' for node in nodes) + tags(**values) + "</way>"


WAYS = [
    way(1, [1, 2, 5, 9, 6, 1], indoor="room", level="0", ref="1"),
    way(2, [6, 9, 5, 4, 8, 7, 6], indoor="corridor", level="0"),
    way(3, [2, 3, 4]),
    way(4, [4, 5, 2]),
    way(5, [21, 22, 23, 24, 21]),
    '<relation id="6"><member type="way" ref="3" role="outer"/><member type="way" ref="4" role="outer"/>'
    '<member type="way" ref="5" role="inner"/>'
    + tags(type="multipolygon", indoor="room", level="0", name="Ring")
    + "</relation>",
    way(7, [1, 3, 8, 7, 1], indoor="area", level="1"),
    way(8, [1, 3, 8, 7, 1], building="yes"),
    f'<way id="9" action="delete"><nd ref="1"/><nd ref="3"/>{tags(indoor="wall", level="0")}</way>',
]


def osm(folder: Path, *elements: str, name: str = "plan.osm", before: str = "") -> Path:
    nodes = "".join(
        f'<node id="{number}" lon="{lon!r}" lat="{lat!r}">{DOOR if number == 9 else ""}</node>'
        for number, (lon, lat) in zip(POINTS, lonlat(list(POINTS.values())), strict=True)
    )
    whole = f'<?xml version="1.0"?>{before}<osm version="0.6">{nodes}{"".join(elements)}</osm>'
    (folder / name).write_text(whole)
    return folder / name


def read(path: Path, **source: object) -> PlanDrawing:
    return read_drawing(path, PlanSource.model_validate({"file": path.name, **source}))


@pytest.mark.parametrize("name", ["plan.osm", "plan.osm.xml"])
def test_a_level(tmp_path: Path, name: str) -> None:
    plan = floor_plan(floor_with(osm(tmp_path, *WAYS, name=name), {"level": "0"}, HERE))
    assert plan.extent_m == pytest.approx((0, 8, 0, 9), abs=1e-3)
    rooms = [each for each in plan.polygons if each.name]
    assert [(each.name, len(each.holes)) for each in rooms] == [("1", 0), ("Ring", 1)]
    assert np.ptp(rooms[1].holes[0], axis=0) == pytest.approx((2, 2), abs=1e-3)
    (opening,) = (each.outline for each in plan.polygons if each.use is Use.OPENING)
    assert opening.mean(axis=0) == pytest.approx((2, 4), abs=1e-3)
    assert sorted(np.ptp(opening, axis=0)) == pytest.approx((0.8, 1.0), abs=5e-3)


def test_what_is_no_part_of_a_floor(tmp_path: Path) -> None:
    drawing = read(osm(tmp_path, *WAYS), level="1")
    assert drawing.levels == ("0", "1")
    assert TakenPart("features without level", Became.LEFT_OUT, 1) in drawing.taken
    assert [each.use for each in drawing.polygons] == [Use.WALKABLE]


def test_parts_of_ways_that_are_not_there(tmp_path: Path) -> None:
    drawing = read(osm(tmp_path, *WAYS[:2], way(10, [1, 99], indoor="wall", level="0"), way(11, [1, 99])))
    assert drawing.notes[-1].startswith("1 indoor ways or multipolygons refer to elements that are not in the file")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<osm><node", "is not XML"),
        ('<!DOCTYPE osm [<!ENTITY a "b">]><osm/>', "has a document type declaration"),
        ('<osm>\n<node id="1" lon="x" lat="2"/></osm>', "without a proper id, position or reference in line 2"),
        ('<osm>\n<node lon="1" lat="2"/></osm>', "without a proper id"),
        ("<osm/>", "shows no rooms, areas or walls"),
    ],
)
def test_files_that_are_wrong(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "plan.osm").write_text(text)
    with pytest.raises(OSError, match=message):
        read(tmp_path / "plan.osm")


def test_other_xml_is_no_plan(tmp_path: Path) -> None:
    (tmp_path / "plan.xml").write_text("<LandXML/>")
    with pytest.raises(OSError, match="has an unknown format"):
        format_of(tmp_path / "plan.xml")
