"""Square cells over a floor: where points fall, and which cells of a floor can be walked."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.limits import MAX_REACH_CELLS


@dataclass(frozen=True)
class CellGrid:
    """``rows`` x ``columns`` squares of ``cell_m``; row 0 and column 0 begin at ``origin_m`` (x, y), BCS."""

    origin_m: tuple[float, float]
    cell_m: float
    rows: int
    columns: int

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of an array with one element a cell: y first, as images have it, but upwards."""
        return self.rows, self.columns

    @property
    def extent_m(self) -> tuple[float, float, float, float]:
        """Left, right, lower and upper edge, BCS metres."""
        left, low = self.origin_m
        return left, left + self.columns * self.cell_m, low, low + self.rows * self.cell_m

    def cells_of(self, points_m: FloatArray) -> IntArray:
        """Row and column (n, 2) of each point (n, 2: x, y); they may lie outside the grid."""
        cells: IntArray = np.floor((points_m - self.origin_m) / self.cell_m).astype(np.int64)[:, ::-1]
        return cells

    def centres_m(self, cells: IntArray) -> FloatArray:
        """Centres (n, 2: x, y) of cells (n, 2: row, column)."""
        centres: FloatArray = np.array(self.origin_m) + (cells[:, ::-1] + 0.5) * self.cell_m
        return centres


def around_most(cells: IntArray) -> BoolArray:
    """Which cells (n, 2) lie around most others: a few far away must not fill the memory."""
    if not len(cells):
        return np.zeros(0, dtype=np.bool_)
    near: BoolArray = (np.abs(cells - np.median(cells, axis=0)) <= MAX_REACH_CELLS).all(axis=1)
    return near


GAP_M, RUN_M, STROKE_M, THIN_M = 1.5, 1.0, 0.4, 0.3
"""A wall goes on beyond a gap of this width if it is straight for so long before it: strokes of at least this length
and at most this thickness.
"""
SLIT_M = 0.5
"""A gap in a wall that is not wider is no door: ink is missing there."""
_ALONG = (np.array([[0, 1, 0]] * 3), np.array([[0] * 3, [1] * 3, [0] * 3]))
"""Neighbours along each axis."""


def continuing_walls(walls: BoolArray, pieces: BoolArray, cell_m: float) -> BoolArray:
    """Cells (rows, columns) of straight ``pieces`` that lie in one line, along an axis, with ``walls``: missing ink
    parts them. Without that line they would be lettering or furniture.
    """
    from scipy.ndimage import label  # slow to load, and few commands read plans

    gap, run, stroke, thin = (max(round(length_m / cell_m), 1) for length_m in (GAP_M, RUN_M, STROKE_M, THIN_M))
    free, _ = label(~np.pad(pieces, 1))
    filled = (free != free[0, 0])[1:-1, 1:-1]
    solid = _narrowed(_narrowed(filled, thin + 1, 0), thin + 1, 1)
    numbers, count = label(pieces, np.ones((3, 3)))
    # Furniture and letters are, or enclose, areas wider than a line.
    of_lines = np.ones(count + 1, dtype=np.bool_)
    of_lines[np.unique(numbers[_widened(_widened(solid, thin + 3, 0), thin + 3, 1)])] = False
    straight = pieces & of_lines[numbers]
    if not straight.any():
        return straight
    found = np.zeros_like(walls)
    for axis in (0, 1):
        thick = _opened(walls, thin + 1, 1 - axis)
        firm = _opened(walls & ~thick, run, axis)
        strokes = _opened((walls & ~thick) | straight, stroke, axis)
        lines, _ = label(_closed(_widened(strokes, 3, 1 - axis), gap + 1, axis), _ALONG[axis])
        of_walls = np.zeros(int(lines.max()) + 1, dtype=np.bool_)
        of_walls[lines[_widened(firm, 3, 1 - axis)]] = True
        of_walls[0] = False
        found |= straight & strokes & of_walls[lines]
    return found


def without_slits(walls: BoolArray, cell_m: float) -> BoolArray:
    """The walls (rows, columns), with gaps filled that are no wider than :data:`SLIT_M` along an axis."""
    cells = round(SLIT_M / cell_m) + 1
    return _closed(walls, cells, 0) | _closed(walls, cells, 1)


def _opened(mask: BoolArray, cells: int, axis: int) -> BoolArray:
    """Runs (rows, columns) along an axis of at least so many ``cells``."""
    return _widened(_narrowed(mask, cells, axis), cells, axis)


def _closed(mask: BoolArray, cells: int, axis: int) -> BoolArray:
    """The mask (rows, columns) with gaps along an axis filled that have fewer ``cells``."""
    return mask | _narrowed(_widened(mask, cells, axis), cells, axis)


def _widened(mask: BoolArray, cells: int, axis: int) -> BoolArray:
    from scipy.ndimage import maximum_filter1d

    return np.asarray(maximum_filter1d(mask.view(np.uint8), cells, axis, mode="constant")) > 0


def _narrowed(mask: BoolArray, cells: int, axis: int) -> BoolArray:
    from scipy.ndimage import minimum_filter1d

    origin = -1 if cells % 2 == 0 else 0  # or even lengths would be centred as they are when it is widened
    return np.asarray(minimum_filter1d(mask.view(np.uint8), cells, axis, mode="constant", origin=origin)) > 0


@dataclass(frozen=True)
class WalkableArea:
    """Where a floor can be walked: ``mask`` (rows, columns), row 0 at the lower edge of the plan."""

    mask: BoolArray
    origin_m: tuple[float, float]
    """Lower left corner of the first cell, BCS."""
    cell_m: float

    @property
    def grid(self) -> CellGrid:
        """The mask's grid."""
        return CellGrid(self.origin_m, self.cell_m, *self.mask.shape)

    @cached_property
    def into_walls_m(self) -> FloatArray:
        """How far (rows, columns) cells' centres are beyond the nearest wall, metres; negative where one can walk."""
        from scipy.ndimage import distance_transform_edt  # a quarter of a second, which only walks between walls need

        free, built = (np.asarray(distance_transform_edt(mask)) for mask in (self.mask, ~self.mask))
        return np.asarray(np.where(self.mask, 0.5 - free, built - 0.5) * self.cell_m)
