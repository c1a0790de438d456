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
