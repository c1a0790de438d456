from __future__ import annotations

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.site.plans.source import FloorPlan
from vislam2tag.site.walkable.plan_cells import cells_in, line_walls, plan_grid
from vislam2tag.site.walkable.space import WalkableSettings

GRID = CellGrid((-2.0, 1.0), 0.5, 30, 40)
NUMBER = st.floats(-4, 20, allow_nan=False).map(lambda value: round(value, 3))


@settings(max_examples=30)
@given(st.lists(st.tuples(NUMBER, NUMBER, st.floats(0.5, 6)), min_size=1, max_size=4))
def test_cells_in_polygons_are_those_whose_centre_is(discs: list[tuple[float, float, float]]) -> None:
    rings = [shapely.Point(x, y).buffer(r).difference(shapely.Point(x, y).buffer(r / 2)) for x, y, r in discs]
    shape = shapely.union_all(rings)
    every = np.argwhere(np.ones(GRID.shape))
    centres = shapely.points(GRID.centres_m(every))
    clear = ~shapely.dwithin(shape.boundary, centres, 1e-6)
    expected = shapely.contains(shape, centres)
    assert (cells_in(shape, GRID)[every[:, 0], every[:, 1]] == expected)[clear].all()


def test_no_polygon_holds_no_cell() -> None:
    assert not cells_in(shapely.GeometryCollection(), GRID).any()


def test_lines_are_as_thick_as_walls() -> None:
    cells = line_walls(np.array([((0.0, 5.0), (10.0, 5.0))]), CellGrid((0.0, 0.0), 0.1, 100, 120), 0.3)
    assert int(cells[:, 50].sum()) in (2, 3, 4)
    assert abs(int(cells[:50, 50].sum()) - int(cells[50:, 50].sum())) <= 1


def test_cells_are_larger_on_a_large_plan() -> None:
    plan = FloorPlan((10, 1010, 0, 500), np.zeros((5, 10, 3), dtype=np.uint8))
    grid = plan_grid(plan, WalkableSettings(max_cells=1_000_000))
    assert grid.rows * grid.columns <= 1_001_000
    assert grid.extent_m[0] == 10
    assert grid.extent_m[1] - 1010 < grid.cell_m
