"""Cells of a floor: x runs along columns, y along rows, both upwards from the origin."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.cell_grid import CellGrid, WalkableArea, continuing_walls

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


@pytest.mark.parametrize("turned", [False, True])
def test_pieces_in_one_line_with_a_wall_continue_it(turned: bool) -> None:
    walls = np.zeros((60, 200), dtype=np.bool_)
    pieces = np.zeros_like(walls)
    walls[30:32, 10:40] = True
    in_line = ((30, 50, 58), (30, 70, 80), (31, 92, 97))  # each 1.0 to 1.2 m on
    beside = ((10, 50, 58), (30, 120, 130))  # on another line, and 2.3 m beyond the last
    for row, start, stop in (*in_line, *beside, (30, 43, 45)):  # the last is shorter than a stroke
        pieces[row : row + 2, start:stop] = True
    found = continuing_walls(walls.T, pieces.T, 0.1).T if turned else continuing_walls(walls, pieces, 0.1)
    expected = np.zeros_like(walls)
    for row, start, stop in in_line:
        expected[row : row + 2, start:stop] = True
    np.testing.assert_array_equal(found, expected)
