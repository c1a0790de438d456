"""Overlapping square cells on every storey, and places as codes within them (Laska and Blankenbach 2022, multi-CEL)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from vislam2tag.common.errors import DatasetError
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.positioning.places import ScanPlaces

NO_CELL = -1
MOST_CELLS = 50_000
"""More than these are a place that is far off, or cells that are far too small: 5 km² in cells of 10 m."""


@dataclass(frozen=True)
class CellCodes:
    """The same ``n`` places seen from each of up to ``k`` cells that reach them, the nearest cell first."""

    cell: IntArray
    """(n, k) NO_CELL where fewer reach the place."""
    code: FloatArray
    """(n, k, 2) offset from the cell's centre; 1 is the end of its reach. 0 where there is no cell."""

    @property
    def valid(self) -> BoolArray:
        """(n, k)"""
        return np.asarray(self.cell != NO_CELL)


@dataclass(frozen=True)
class CellLattice:
    """Cells of all storeys, numbered through; centres lie at multiples of the cell's side."""

    cell_m: float
    """Side of a cell."""
    overlap: float
    """How far a cell reaches past its side, as a share of the side."""
    first: IntArray
    """(s, 2) column and row of each storey's first centre, in sides from the frame's origin."""
    size: IntArray
    """(s, 2) number of columns and rows; 0 on storeys that nothing is known of."""

    @property
    def reach_m(self) -> float:
        """Greatest distance along x or y from a centre that a code can say."""
        return self.cell_m * (0.5 + self.overlap)

    @property
    def count(self) -> int:
        """Number of cells."""
        return int(self.size.prod(axis=1).sum())

    @property
    def storey(self) -> IntArray:
        """(count,) storey of each cell."""
        return np.repeat(np.arange(len(self.size)), self.size.prod(axis=1))

    @property
    def centre_m(self) -> FloatArray:
        """(count, 2)"""
        rows = np.arange(self.count) - self._offset[self.storey]
        columns = np.maximum(self.size[self.storey, 0], 1)
        steps = self.first[self.storey] + np.stack([rows % columns, rows // columns], axis=1)
        return np.asarray(steps * self.cell_m)

    @property
    def _offset(self) -> IntArray:
        """(s,) number of each storey's first cell."""
        cells = self.size.prod(axis=1)
        return np.asarray(np.cumsum(cells) - cells)

    def codes(self, storey: IntArray, xy: FloatArray) -> CellCodes:
        """Encode places (n) and (n, 2) on storeys that have cells.

        Outside the lattice the nearest cell still counts; its code is then beyond 1.
        """
        within = np.rint(xy / self.cell_m).astype(np.int64) - self.first[storey]
        nearest = np.clip(within, 0, self.size[storey] - 1)
        step = int(np.floor(1 + self.overlap))
        steps = np.array([(dx, dy) for dy in range(-step, step + 1) for dx in range(-step, step + 1)])
        steps = steps[np.argsort(np.abs(steps).sum(axis=1), kind="stable")]
        at = nearest[:, None] + steps
        code = (xy[:, None] - (self.first[storey][:, None] + at) * self.cell_m) / self.reach_m
        valid = ((at >= 0) & (at < self.size[storey][:, None]) & (np.abs(code) < 1)).all(axis=2)
        valid[:, 0] = True
        cell = self._offset[storey][:, None] + at[..., 1] * self.size[storey, 0][:, None] + at[..., 0]
        kept = valid.any(axis=0)
        return CellCodes(
            cell=np.where(valid, cell, NO_CELL)[:, kept], code=np.where(valid[..., None], code, 0.0)[:, kept]
        )


def lattice_over(places: ScanPlaces, cell_m: float, overlap: float) -> CellLattice:
    """Cover the extent of the places on each storey, one row and column more than fits.

    Raises DatasetError where that takes more than MOST_CELLS.
    """
    first = np.zeros((len(places.storeys), 2), dtype=np.int64)
    size = np.zeros_like(first)
    for storey in np.unique(places.storey):
        xy = places.xy[places.storey == storey] / cell_m
        first[storey] = np.floor(xy.min(axis=0))
        size[storey] = np.ceil(xy.max(axis=0)) - first[storey] + 1
    lattice = CellLattice(cell_m, overlap, first, size)
    if lattice.count > MOST_CELLS:
        width, height = size.max(axis=0) * cell_m
        raise DatasetError(
            f"places of a floor extend over {width:.0f} x {height:.0f} m: {lattice.count} cells of {cell_m:g} m; "
            f"correct the labels, or make cells larger (at most {MOST_CELLS} can be)"
        )
    return lattice


def decoded(centre_m: Any, code: Any, reach_m: float) -> Any:
    """Return the places that codes say (NumPy or PyTorch)."""
    return centre_m + reach_m * code
