"""What polygons stand for, and where GeoJSON of any reference system lies."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from pyproj import Transformer

from tests.site.plans import drawn_floor
from tests.site.plans.drawn_floor import EXTENT, HERE, collection, feature, floor_with
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.source import Use


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


def test_degrees_can_be_fitted_to_an_extent(tmp_path: Path) -> None:
    turned_north = {"extent": {**EXTENT, "lower_left_m": (3.0, 4.0)}}
    plan = floor_plan(floor_with(drawn_floor.geojson(tmp_path), turned_north))
    assert plan.extent_m == pytest.approx((3, 23, 4, 14))
