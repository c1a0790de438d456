"""Every format shows the same floor at the same place.

What polygons stand for, and where GeoJSON of any reference system lies.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pyproj import Transformer

from tests.site.plans import drawn_floor
from tests.site.plans.drawn_floor import EXTENT, HEIGHT_M, HERE, WIDTH_M, collection, feature, floor_with, is_dark
from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.load import floor_plan, plan_extent
from vislam2tag.site.plans.source import FloorPlan, Use

ANGLE = np.radians(30)
TURNED = np.array([[np.cos(ANGLE), -np.sin(ANGLE)], [np.sin(ANGLE), np.cos(ANGLE)]])
SHIFT = np.array([100.0, -40.0])


def archived(folder: Path) -> Path:
    return drawn_floor.imdf(folder, archive=True)


def points(first: object, second: object) -> dict[str, object]:
    """The floor's lower edge, turned by 30 degrees and shifted; in the plan's own coordinates as given."""
    ends = (TURNED @ np.array([[0.0, WIDTH_M], [0.0, 0.0]])).T + SHIFT
    return {"points": [{"plan": first, "bcs_m": ends[0].tolist()}, {"plan": second, "bcs_m": ends[1].tolist()}]}


def check(floor: Floor, turn: FloatArray | None = None, shift: tuple[float, float] = (0.0, 0.0)) -> FloorPlan:
    """The wall is dark where it must be, and what mirrors it is not."""
    plan = floor_plan(floor)
    matrix = np.eye(2) if turn is None else turn
    for (x, y), dark in {(5, 3): True, (10, 0.05): True, (19.95, 5): True, (15, 3): False, (5, 8): False}.items():
        place = matrix @ (x, y) + shift
        assert is_dark(plan, *place) == dark, (x, y)
    assert floor.plan is not None
    assert floor.source is not None
    assert plan_extent(floor.plan, floor.source, floor.georeference) == pytest.approx(plan.extent_m, abs=1e-6)
    return plan


FORMATS: dict[str, tuple[Callable[[Path], Path], dict[str, object]]] = {
    "png": (drawn_floor.png, {}),
    "svg": (drawn_floor.svg, {}),
    "pdf": (drawn_floor.pdf, {"page": 2}),
    "dxf": (drawn_floor.dxf, {}),
}


@pytest.mark.parametrize("name", FORMATS)
def test_by_extent(tmp_path: Path, name: str) -> None:
    write, options = FORMATS[name]
    floor = floor_with(write(tmp_path), {**options, "extent": EXTENT})
    assert check(floor).extent_m == pytest.approx((0, WIDTH_M, 0, HEIGHT_M))


@pytest.mark.parametrize("name", FORMATS)
def test_by_extent_anywhere(tmp_path: Path, name: str) -> None:
    write, options = FORMATS[name]
    floor = floor_with(write(tmp_path), {**options, "extent": {**EXTENT, "lower_left_m": (-7.5, 30.0)}})
    check(floor, shift=(-7.5, 30.0))


@pytest.mark.parametrize(
    ("name", "first", "second"),
    [
        ("png", (0, 100), (200, 100)),
        ("svg", (0, 40), (80, 40)),
        ("pdf", (0, 0), (400, 0)),
        ("dxf", (0, 0), (20_000, 0)),
    ],
)
def test_by_two_points_and_by_a_distance(
    tmp_path: Path, name: str, first: tuple[float, float], second: tuple[float, float]
) -> None:
    write, options = FORMATS[name]
    plan = write(tmp_path)
    check(floor_with(plan, {**options, **points(first, second)}), TURNED, tuple(SHIFT))
    distance = {"from": first, "to": second, "metres": WIDTH_M, "lower_left_m": (1.0, 2.0)}
    check(floor_with(plan, {**options, "distance": distance}), shift=(1.0, 2.0))


def test_a_drawing_with_units_needs_no_scale(tmp_path: Path) -> None:
    plan = check(floor_with(drawn_floor.dxf(tmp_path), {}))
    assert plan.extent_m == pytest.approx((0, WIDTH_M, 0, HEIGHT_M))
    assert len(plan.walls) == 5
    assert not is_dark(plan, 5.6, 6.6)  # the door's swing is no wall


def test_a_drawing_without_units_needs_them(tmp_path: Path) -> None:
    check(floor_with(drawn_floor.dxf(tmp_path, units=0), {"unit_m": 0.001}))


@pytest.mark.parametrize("layers", [["A-WALL"], ["a-*l"]])
def test_layers_can_be_chosen(tmp_path: Path, layers: list[str]) -> None:
    assert len(floor_plan(floor_with(drawn_floor.dxf(tmp_path), {"layers": layers})).walls) == 5


@pytest.mark.parametrize("write", [drawn_floor.geojson, drawn_floor.imdf, archived])
def test_what_lies_on_earth_needs_no_scale_where_the_floor_does(tmp_path: Path, write: Callable[[Path], Path]) -> None:
    options = {} if write is drawn_floor.geojson else {"level": "G"}
    plan = check(floor_with(write(tmp_path), options, HERE))
    assert plan.extent_m == pytest.approx((0, WIDTH_M, 0, HEIGHT_M), abs=1e-4)


@pytest.mark.parametrize("write", [drawn_floor.geojson, drawn_floor.imdf])
def test_what_lies_on_earth_by_two_points(tmp_path: Path, write: Callable[[Path], Path]) -> None:
    options: dict[str, object] = {} if write is drawn_floor.geojson else {"level": "0"}
    first, second = drawn_floor.lonlat([(0, 0), (WIDTH_M, 0)])
    check(floor_with(write(tmp_path), {**options, **points(first, second)}), TURNED, tuple(SHIFT))


def test_uses_of_imdf(tmp_path: Path) -> None:
    plan = floor_plan(floor_with(drawn_floor.imdf(tmp_path), {"level": "L0"}, HERE))
    assert sorted(each.use for each in plan.polygons) == [
        Use.OBSTACLE,
        Use.OPENING,
        Use.OUTLINE,
        Use.WALKABLE,
    ]
    assert [each.name for each in plan.polygons if each.use == Use.WALKABLE] == ["Hall"]
    opening = next(each.outline for each in plan.polygons if each.use == Use.OPENING)
    assert np.ptp(opening, axis=0) == pytest.approx((0.8, 2.0), abs=1e-3)
    assert not is_dark(plan, 20, 8)


def square(x: float, y: float, side: float) -> list[list[list[float]]]:
    return [[[x, y], [x + side, y], [x + side, y + side], [x, y + side], [x, y]]]


def uses(folder: Path, *features: dict[str, object], **options: object) -> list[str]:
    (folder / "plan.geojson").write_text(collection(*features))
    return [
        each.use.value for each in floor_plan(floor_with(folder / "plan.geojson", {"unit_m": 1, **options})).polygons
    ]


def test_the_polygon_that_holds_all_others_is_the_outline(tmp_path: Path) -> None:
    shop, outline = feature("Polygon", square(210, 10, 5)), feature("Polygon", square(200, 0, 40))
    assert uses(tmp_path, shop, outline) == [Use.OBSTACLE, Use.OUTLINE]
    assert uses(tmp_path, shop, outline, others="walkable") == [Use.WALKABLE, Use.OUTLINE]


def test_without_an_outline_polygons_are_walkable(tmp_path: Path) -> None:
    rooms = [feature("Polygon", square(200 + x, 0, 5)) for x in (0, 5, 10)]
    assert uses(tmp_path, *rooms) == [Use.WALKABLE] * 3
    assert uses(tmp_path, *rooms, others="obstacle") == [Use.OBSTACLE] * 3


def test_what_is_said_counts(tmp_path: Path) -> None:
    said = [
        feature("Polygon", square(200, 0, 40), use="outline"),
        feature("MultiPolygon", [square(201, 1, 3), square(206, 1, 3)], indoor="room"),
        feature("Polygon", square(211, 1, 3), indoor="wall"),
        feature("Polygon", square(216, 1, 3)),
        feature("LineString", [[203, 4], [204, 4]], use="opening"),
        feature("Point", [203, 4], name="a lift"),
    ]
    expected = [
        Use.OUTLINE,
        Use.WALKABLE,
        Use.WALKABLE,
        Use.OBSTACLE,
        Use.OBSTACLE,
        Use.OPENING,
    ]
    assert uses(tmp_path, *said) == expected


def test_mercator_is_placed_like_degrees(tmp_path: Path) -> None:
    degrees = json.loads(drawn_floor.geojson(tmp_path).read_text())
    to_mercator = Transformer.from_crs(4326, 3857, always_xy=True)
    for each in degrees["features"]:
        rings = each["geometry"]["coordinates"]
        for ring in rings if each["geometry"]["type"] == "Polygon" else [rings]:
            ring[:] = [list(to_mercator.transform(*point)) for point in ring]
    degrees["crs"] = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::3857"}}
    (tmp_path / "mercator.geojson").write_text(json.dumps(degrees))
    plan = floor_plan(floor_with(tmp_path / "mercator.geojson", {}, HERE))
    assert plan.extent_m == pytest.approx((0, 20, 0, 10), abs=1e-4)
    assert plan.walls[0] == pytest.approx(np.array([(5, 0), (5, 6)]), abs=1e-4)


def test_a_null_reference_system_means_metres(tmp_path: Path) -> None:
    text = json.loads(collection(feature("Polygon", square(0, 0, 9))))
    (tmp_path / "plan.geojson").write_text(json.dumps({**text, "crs": None}))
    assert floor_plan(floor_with(tmp_path / "plan.geojson", {"unit_m": 1.0})).extent_m == (0, 9, 0, 9)


def test_polygons_and_passages_are_cut_at_an_area(tmp_path: Path) -> None:
    features = [
        feature("Polygon", square(0, 0, 40), use="outline"),
        feature("Polygon", square(10, 10, 20), use="obstacle"),
        feature("Polygon", square(30, 30, 5), use="obstacle"),
        feature("LineString", [[5, 0], [5, 30]], use="wall"),
    ]
    (tmp_path / "plan.geojson").write_text(collection(*features))
    plan = floor_plan(floor_with(tmp_path / "plan.geojson", {"unit_m": 1, "epsg": None, "area": (0, 0, 20, 25)}))
    assert plan.extent_m == pytest.approx((0, 20, 0, 25))
    assert [(each.use, np.ptp(each.outline, axis=0).tolist()) for each in plan.polygons] == [
        (Use.OUTLINE, [20, 25]),
        (Use.OBSTACLE, [10, 15]),
    ]
    assert plan.walls.tolist() == [[[5, 0], [5, 25]]]


def test_degrees_can_be_fitted_to_an_extent(tmp_path: Path) -> None:
    turned_north = {"extent": {**EXTENT, "lower_left_m": (3.0, 4.0)}}
    plan = floor_plan(floor_with(drawn_floor.geojson(tmp_path), turned_north))
    assert plan.extent_m == pytest.approx((3, 23, 4, 14))
