"""Units that cannot be right, what is far from the building, and storeys beside each other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.site.dxf.drawings import WALLS, add_floor, parts, read
from tests.site.plans.drawn_floor import floor_with
from vislam2tag.site.plan_formats.dxf import read_dxf
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.source import PlanSource
from vislam2tag.site.walkable.space import walkable_space


def stated(folder: Path, code: int, scale: float, metric: int = 1, door: float = 0.0, **source: object) -> Any:
    """The floor in units of 1 / ``scale`` metres, with a header that may say others, and swings of a door in metres."""

    def build(document: Any, space: Any) -> None:
        document.header["$INSUNITS"], document.header["$MEASUREMENT"] = code, metric
        add_floor(space, scale=scale)
        if door:
            space.add_arc((0, 0), door * scale, 0, 90, dxfattribs={"layer": "Türen"})

    return read(folder, build, **source)


@pytest.mark.parametrize(
    ("code", "scale", "message"),
    [
        (
            1,
            1,
            "1 inch (0.508 m x 0.254 m), which no floor is: use --unit-m 1 if a unit is 1 metre (20 m x 10 m)",
        ),
        (
            6,
            1000,
            "use --unit-m 0.01 if a unit is 1 centimetre (200 m x 100 m) or --unit-m 0.001 if a unit is 1 millimetre",
        ),
        (4, 1, "a unit is 1 millimetre (0.02 m x 0.01 m), which no floor is: use --unit-m 1 if a unit is 1 metre"),
    ],
)
def test_units_that_make_no_floor_are_refused(tmp_path: Path, code: int, scale: float, message: str) -> None:
    with pytest.raises(OSError, match=r"^says in its header that ") as raised:
        stated(tmp_path, code, scale)
    assert message in str(raised.value)
    assert not stated(tmp_path, code, scale, unit_m=1 / scale).notes


def test_doors_tell_units_apart(tmp_path: Path) -> None:
    with pytest.raises(OSError, match=r"with such doors is: use --unit-m 0\.001 if a unit is 1 millimetre") as raised:
        stated(tmp_path, 5, 1000, door=0.9)
    assert "centimetre (20" not in str(raised.value).partition("use")[2]
    assert not stated(tmp_path, 1, 1 / 0.0254, door=0.9).notes


@pytest.mark.parametrize(("code", "scale", "metric", "noted"), [(1, 1000, 1, 1), (1, 1000, 0, 0), (4, 1000, 0, 0)])
def test_inches_of_a_metric_drawing_are_noted(tmp_path: Path, code: int, scale: float, metric: int, noted: int) -> None:
    notes = stated(tmp_path, code, scale, metric).notes
    assert len(notes) == noted
    assert all("a unit is 1 inch (508 m x 254 m), but also that it is metric: use --unit-m" in note for note in notes)


def test_what_is_far_from_the_building_is_left_out(tmp_path: Path) -> None:
    def build(_: object, space: Any) -> None:
        add_floor(space, 300_000, 5_600_000)
        space.add_line((0, 0), (1, 1), dxfattribs={"layer": "Wand-Rest"})
        space.add_text("north", dxfattribs={"layer": "Text", "insert": (0, 5)})
        space.add_text("room", dxfattribs={"layer": "Text", "insert": (300_002, 5_600_002)})

    drawing = read(tmp_path, build)
    assert drawing.bounds == pytest.approx((300_000, 300_020, 5_600_000, 5_600_010))
    assert [text.text for text in drawing.texts] == ["room"]
    assert ("Wand-Rest", "left out", 1, "far from the building") in parts(drawing)
    assert "5,599,999 m from the building: 1 of the lines on layer Wand-Rest, at (0, 0)" in drawing.notes[0]


def storeys(_: object, space: Any) -> None:
    for left in (0, 30, 60):
        add_floor(space, left)
    space.add_text("first", dxfattribs={"insert": (32, 2)})


def test_storeys_beside_each_other_are_chosen_by_area(tmp_path: Path) -> None:
    with pytest.raises(
        OSError, match=r"^shows 3 drawings beside each other.*; 29,-1,51,11 \(20 m x 10 m\); 59,"
    ) as raised:
        read(tmp_path, storeys)
    area = str(raised.value).partition("from: ")[2].split(" ")[0]
    assert area == "-1,-1,21,11"
    plan = floor_plan(floor_with(tmp_path / "plan.dxf", {"area": (51, -1, 29, 11)}))
    assert plan.extent_m == pytest.approx((30, 50, 0, 10))
    assert len(plan.walls) == WALLS
    assert [text.text for text in plan.texts] == ["first"]
    with pytest.raises(OSError, match="has nothing in that area"):
        read_dxf(tmp_path / "plan.dxf", PlanSource(file="plan.dxf", area=(22, 0, 28, 9)))


def test_walls_at_the_edge_of_an_area_are_cut(tmp_path: Path) -> None:
    drawing = read(tmp_path, storeys, area=(12, 0, 40, 5))
    assert drawing.bounds == pytest.approx((12, 40, 0, 5))


def test_a_shed_near_the_building_belongs_to_it(tmp_path: Path) -> None:
    def build(_: object, space: Any) -> None:
        add_floor(space)
        space.add_lwpolyline([(28, 0), (32, 0), (32, 4), (28, 4)], close=True, dxfattribs={"layer": "Wände"})

    assert read(tmp_path, build).bounds == (0, 32, 0, 10)


@pytest.mark.parametrize("filled", [False, True])
def test_walls_of_two_lines_are_as_thick_as_they_are_apart(tmp_path: Path, filled: bool) -> None:
    """A hall of 19.6 m x 9.6 m within walls of 0.2 m, and a wall of 5 m x 0.1 m in it."""

    def build(_: object, space: Any) -> None:
        rings = [[(x, y), (20 - x, y), (20 - x, 10 - y), (x, 10 - y)] for x, y in ((0.0, 0.0), (0.2, 0.2))]
        for ring in [*rings, [(10.0, 0.2), (10.1, 0.2), (10.1, 5.2), (10.0, 5.2)]]:
            space.add_lwpolyline(ring, close=True, dxfattribs={"layer": "Wand"})
        if filled:
            hatch = space.add_hatch(dxfattribs={"layer": "Wand"})
            for ring in rings:
                hatch.paths.add_polyline_path(ring, is_closed=True)

    read(tmp_path, build)
    area = walkable_space(floor_plan(floor_with(tmp_path / "plan.dxf", {}))).area
    assert area.mask.sum() * area.cell_m**2 == pytest.approx(19.6 * 9.6 - 0.5, rel=0.01)
