"""Every format shows the same floor at the same place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.site.plans import drawn_floor
from tests.site.plans.drawn_floor import EXTENT, HEIGHT_M, HERE, WIDTH_M, floor_with, is_dark
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
