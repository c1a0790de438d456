"""Of several levels one is taken, rooms have walls that doors open, and what became of features is said."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.site.plans.drawn_floor import collection, feature, floor_with
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.site.plan_formats.geojson import read_geojson
from vislam2tag.site.plans.drawing import PlanDrawing
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.source import PlanSource, Use
from vislam2tag.site.plans.taken_parts import Became, TakenPart
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.drawn_cells import polygon_area

Features = list[dict[str, Any]]
METRES = {"unit_m": 1.0}


def box(x: float, y: float, width: float, height: float, **properties: object) -> dict[str, Any]:
    ring = [[x, y], [x + width, y], [x + width, y + height], [x, y + height], [x, y]]
    return feature("Polygon", [ring], **properties)


def door(x: float, y: float, **properties: object) -> dict[str, Any]:
    return feature("Point", [x, y], **({"door": "yes"} | properties))


def ground_and_first_floor() -> Features:
    """A corridor of 10 m x 2 m between two rooms of 5 m x 4 m on level 0, a hall with a core on level 1."""
    return [
        box(0, 4, 6, 2, indoor="corridor", level="0"),
        box(6, 4, 4, 2, indoor="area", level="0", name="Foyer"),
        box(0, 0, 5, 4, indoor="room", level="0", ref="001", name="Office"),
        box(5, 0, 5, 4, indoor="room", level="0"),
        door(2, 4, level="0"),
        door(7, 4, width="0.8"),
        box(0, 0, 10, 8, indoor="area", level="1"),
        box(4, 3, 2, 2, indoor="wall", level="1"),
        box(9, 7, 1, 1, indoor="area", stairs="yes", level="0-2"),
    ]


def read(folder: Path, features: Features, **source: object) -> PlanDrawing:
    (folder / "plan.geojson").write_text(collection(*features))
    known = PlanSource.model_validate({"file": "plan.geojson", **METRES, **source})
    return read_geojson(folder / "plan.geojson", known)


def walkable(folder: Path, features: Features, **source: object) -> WalkableArea:
    """Where the plan is walkable."""
    (folder / "plan.geojson").write_text(collection(*features))
    plan = floor_plan(floor_with(folder / "plan.geojson", {**METRES, **source}))
    area = polygon_area(plan, WalkableSettings(cell_m=0.05))
    assert area is not None
    return area


def test_several_levels_must_be_chosen(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="has the levels 0, 1: choose one"):
        read(tmp_path, ground_and_first_floor())
    with pytest.raises(OSError, match="has no level 2; there are: 0, 1"):
        read(tmp_path, ground_and_first_floor(), level="2")


def test_a_level_has_its_own_features(tmp_path: Path) -> None:
    ground = read(tmp_path, ground_and_first_floor(), level="0")
    first = read(tmp_path, ground_and_first_floor(), level="1")
    assert ground.levels == first.levels == ("0", "1")
    assert [each.use for each in first.polygons] == [Use.OBSTACLE, Use.WALKABLE]
    assert len(ground.passages) == 2
    assert not len(first.walls)


@pytest.mark.parametrize(
    "tags", [{"level": "0;1"}, {"level": "0-1"}, {"level": "0", "repeat_on": "1"}, {"level": "-1", "repeat_on": "0-1"}]
)
def test_a_feature_of_several_levels(tmp_path: Path, tags: dict[str, str]) -> None:
    features = [box(0, 0, 9, 9, indoor="area", level="0"), box(0, 0, 9, 9, indoor="area", level="1")]
    shared = box(2, 2, 1, 1, indoor="column", **tags)
    for level in ("0", "1"):
        uses = [each.use for each in read(tmp_path, [*features, shared], level=level).polygons]
        assert Use.OBSTACLE in uses, level


def test_a_level_by_its_own_name(tmp_path: Path) -> None:
    features = [
        box(0, 0, 9, 9, indoor="level", level="0", **{"level:ref": "EG"}),
        box(0, 0, 5, 9, indoor="level", level="1", **{"level:ref": "1.OG"}),
    ]
    assert read(tmp_path, features, level="1.og").bounds == (0, 5, 0, 9)


def test_floors_called_otherwise(tmp_path: Path) -> None:
    features = [box(0, 0, 9, 9, use="walkable", Geschoss="EG"), box(0, 0, 5, 9, use="walkable", Geschoss="OG")]
    assert read(tmp_path, features, level="OG").bounds == (0, 5, 0, 9)
    material = [box(0, 0, 9, 9, use="walkable", floor="tiles"), box(0, 0, 5, 9, use="walkable", floor="carpet")]
    assert len(read(tmp_path, material).polygons) == 2


def test_rooms_have_walls_that_doors_open(tmp_path: Path) -> None:
    drawing = read(tmp_path, ground_and_first_floor(), level="0")
    assert [np.sort(line[:, 0]).tolist() for line in drawing.passages] == [[1.5, 2.5], [6.6, 7.4]]
    assert len(drawing.walls) == 8
    assert not drawing.notes
    area = walkable(tmp_path, ground_and_first_floor(), level="0")
    assert area.mask.sum() * area.cell_m**2 == pytest.approx(2 * 4.9 * 3.9 + 9.9 * 1.9 + 1, rel=0.01)
    assert [area.mask[round(4 / 0.05), round(x / 0.05)] for x in (2.0, 4.0, 7.0, 9.0)] == [True, False, True, False]


def test_corridors_and_areas_adjoin_without_a_wall(tmp_path: Path) -> None:
    drawing = read(tmp_path, ground_and_first_floor()[:6])
    (whole,) = (each for each in drawing.polygons if np.ptp(each.outline[:, 0]) > 9)
    assert np.ptp(whole.outline, axis=0) == pytest.approx((10, 2))
    assert [text.text for text in drawing.texts] == ["Foyer"]
    assert drawing.polygons[0].name == "001 Office"


def test_a_door_leads_through_a_thick_wall(tmp_path: Path) -> None:
    features = [
        box(0, 0, 4, 4, indoor="area"),
        box(4, 0, 0.3, 4, indoor="wall"),
        box(4.3, 0, 4, 4, indoor="area"),
    ]
    opened = walkable(tmp_path, [*features, door(4, 2)]).mask
    assert opened[round(2 / 0.05), 70:100].all()
    assert not opened[round(3 / 0.05), 70:100].all()


def test_rooms_without_doors_are_noted(tmp_path: Path) -> None:
    features = [box(0, 0, 4, 4, indoor="room"), box(4, 0, 4, 4, indoor="room"), door(2, 0)]
    assert read(tmp_path, features).notes[0].startswith("1 of 2 rooms have no door")


def test_parts_that_were_taken(tmp_path: Path) -> None:
    tree = feature("Point", [90, 90], natural="tree")
    features = [*ground_and_first_floor(), tree, door(2, 20, level="0")]
    assert read(tmp_path, features, level="0").taken == (
        TakenPart("indoor=corridor", Became.WALKABLE, 1),
        TakenPart("indoor=area", Became.WALKABLE, 2),
        TakenPart("indoor=room", Became.WALKABLE, 2),
        TakenPart("door", Became.OPENINGS, 2),
        TakenPart("door", Became.LEFT_OUT, 1, "at no wall"),
        TakenPart("features of other levels", Became.LEFT_OUT, 2),
        TakenPart("features without level", Became.LEFT_OUT, 1),
    )


def test_classes_are_ignored_as_asked(tmp_path: Path) -> None:
    drawing = read(tmp_path, ground_and_first_floor(), level="1", ignore=["*=WALL"])
    assert [each.use for each in drawing.polygons] == [Use.WALKABLE]
    assert TakenPart("indoor=wall", Became.LEFT_OUT, 1, "ignored as asked") in drawing.taken
    with pytest.raises(OSError, match="has no class room; there are: door, indoor=area, indoor=wall"):
        read(tmp_path, ground_and_first_floor(), level="1", ignore=["room"])


def test_nothing_indoors(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="shows no rooms, areas or walls"):
        read(tmp_path, [feature("Point", [1, 1], indoor="yes")])
