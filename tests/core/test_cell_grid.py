"""Cells of a floor: x runs along columns, y along rows, both upwards from the origin."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.cell_grid import CellGrid, WalkableArea

GRID = CellGrid(origin_m=(10.0, -4.0), cell_m=0.5, rows=4, columns=6)


def test_points_fall_into_cells_whose_lower_left_edge_belongs_to_them() -> None:
    points = np.array([[10.0, -4.0], [12.9, -2.6], [10.5, -3.5], [9.9, -2.0]])
    assert GRID.cells_of(points).tolist() == [[0, 0], [2, 5], [1, 1], [4, -1]]


def test_centres_lie_in_their_cells() -> None:
    cells = np.argwhere(np.ones(GRID.shape, dtype=bool))
    centres = GRID.centres_m(cells)
    np.testing.assert_array_equal(GRID.cells_of(centres), cells)
    assert centres[0].tolist() == [10.25, -3.75]
    assert GRID.extent_m == (10.0, 13.0, -4.0, -2.0)


def test_an_area_has_the_grid_of_its_mask() -> None:
    assert WalkableArea(np.ones((4, 6), dtype=bool), (10.0, -4.0), 0.5).grid == GRID
