"""Where a data set has fingerprints, and which walkable places have none near.

A place counts as covered when a fingerprint lies within a radius of its cell's centre. Its default, 2 m, is half of
what is walked between the scans of a phone (3 to 4 s at 1 m/s), so an unbroken walk covers its own way; and it is
what Wi-Fi fingerprinting can tell apart (the paper's Table IV: mean errors of 2 to 3 m).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
import polars as pl
from scipy.ndimage import distance_transform_edt

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.cell_grid import CellGrid, WalkableArea, around_most
from vislam2tag.core.status import Status
from vislam2tag.dataset.by_session import each_session
from vislam2tag.dataset.model import Dataset, Storey
from vislam2tag.dataset.schema import IMU_WINDOWS, MAGNETIC
from vislam2tag.dataset.settings import CoverageSettings
from vislam2tag.dataset.statistics.record import UNKNOWN

_FLOOR = ("building", "floor")
_CELL: Mapping[str, pl.DataType] = MappingProxyType(
    {"building": pl.String(), "floor": pl.Int32(), "row": pl.Int64(), "column": pl.Int64()}
)
_PATHS = (
    (MAGNETIC, "x", "y", "sigma"),
    (IMU_WINDOWS, "x_start", "y_start", "sigma_start"),
    (IMU_WINDOWS, "x_end", "y_end", "sigma_end"),
)
"""Further tables that say where a walk went, and how sure that is."""
_PARTS = 16
_EPSILON = 1e-9


@dataclass(frozen=True)
class FloorCoverage:
    """The cells of one floor; all arrays have the grid's shape (rows, columns)."""

    storey: Storey
    grid: CellGrid
    fingerprints: Mapping[str, IntArray]
    """Labelled fingerprints a cell, by device."""
    walkable: BoolArray
    """Cells that a labelled walk touched (as far as that is sure), and those of a walkable area that is given."""
    covered: BoolArray
    """Walkable cells with a fingerprint near."""
    far: int
    """Labelled fingerprints that lie too far from the others to be drawn, and are left out."""

    @property
    def total(self) -> IntArray:
        """(rows, columns) labelled fingerprints a cell, of all devices."""
        return _sum(self.fingerprints, self.grid)

    @property
    def gaps(self) -> BoolArray:
        """(rows, columns) walkable cells without a fingerprint near."""
        missing: BoolArray = self.walkable & ~self.covered
        return missing

    @property
    def tells(self) -> bool:
        """Whether more is walkable than the fingerprints' own cells: else coverage says nothing."""
        return bool((self.walkable & (self.total == 0)).any())

    @property
    def share(self) -> float | None:
        """Share of the walkable cells that are covered; None where there is no walkable cell."""
        walkable = int(self.walkable.sum())
        return int(self.covered.sum()) / walkable if walkable else None


def coverage(
    dataset: Dataset,
    technology: str = "wifi",
    settings: CoverageSettings | None = None,
    walkable: Mapping[Storey, WalkableArea] | None = None,
) -> tuple[FloorCoverage, ...]:
    """Count the cells of every floor that has a label or a walkable area, in order.

    One walk at a time is in memory, and the cells.
    """
    settings, walkable = settings or CoverageSettings(), walkable or {}
    cells = _CellCounts(_grid_table(walkable), settings.cell_m)
    for tables in each_session(dataset.fingerprints, dataset.readings):
        scans = tables.fingerprints.with_columns(pl.col("building").fill_null(""), pl.col("device").fill_null(UNKNOWN))
        readings = tables.readings.join(scans.select("scan_id", "building"), on="scan_id", how="left")
        labelled = scans.filter((pl.col("technology") == technology) & (pl.col("status") == Status.OK.label)).lazy()
        cells.count(labelled)
        cells.mark(labelled, "x", "y")
        for positions in (scans, readings):
            cells.mark(_known_within(positions.lazy(), "sigma", settings.radius_m), "x", "y")
    for name, x, y, sigma in _PATHS:
        if name in dataset.tables:
            table = dataset.tables[name].with_columns(pl.col("building").fill_null(""))
            cells.mark(_known_within(table, sigma, settings.radius_m), x, y)
    counts, touched = cells.counts, cells.touched
    storeys = sorted({*(Storey(*row) for row in touched.select(_FLOOR).unique().iter_rows()), *walkable})
    return tuple(
        _floor(storey, _at(counts, storey), _at(touched, storey), walkable.get(storey), settings) for storey in storeys
    )


def _known_within(positions: pl.LazyFrame, sigma: str, radius_m: float) -> pl.LazyFrame:
    """Leave out positions less sure than the radius: nobody may have been there. An unknown sigma tells nothing."""
    return positions.filter(pl.col(sigma).fill_null(0.0) <= radius_m)


def _grid_table(walkable: Mapping[Storey, WalkableArea]) -> pl.DataFrame:
    """The grids of the floors that have one of their own: building, floor, left_m, low_m, own_m (side of a cell)."""
    schema = {"building": pl.String, "floor": pl.Int32, "left_m": pl.Float64, "low_m": pl.Float64, "own_m": pl.Float64}
    rows = [(*storey, *area.origin_m, area.cell_m) for storey, area in walkable.items()]
    return pl.DataFrame(rows, schema=schema, orient="row")


@dataclass
class _CellCounts:
    """Cells by building, floor, row and column of the floor's own grid, else of one that begins at the BCS's origin."""

    grids: pl.DataFrame
    cell_m: float
    _counts: list[pl.DataFrame] = field(default_factory=list)
    _touched: list[pl.DataFrame] = field(default_factory=list)

    def count(self, fingerprints: pl.LazyFrame) -> None:
        """Count labelled fingerprints by cell and device."""
        counts = self._located(fingerprints, "x", "y").group_by(*_CELL, "device").agg(count=pl.len().cast(pl.Int64))
        self._counts.append(counts.collect(engine="streaming"))
        if len(self._counts) == _PARTS:
            self._counts = [self.counts]

    def mark(self, positions: pl.LazyFrame, x: str, y: str) -> None:
        """Note the cells in which positions lie."""
        self._touched.append(self._located(positions, x, y).select(*_CELL).unique().collect(engine="streaming"))
        if len(self._touched) == _PARTS:
            self._touched = [self.touched]

    @property
    def counts(self) -> pl.DataFrame:
        return (
            _joined(self._counts, {**_CELL, "device": pl.String(), "count": pl.Int64()})
            .group_by(*_CELL, "device")
            .agg(pl.col("count").sum())
        )

    @property
    def touched(self) -> pl.DataFrame:
        return _joined(self._touched, _CELL).unique()

    def _located(self, positions: pl.LazyFrame, x: str, y: str) -> pl.LazyFrame:
        cell_m = pl.col("own_m").fill_null(self.cell_m)
        left_m, low_m = pl.col("left_m").fill_null(0.0), pl.col("low_m").fill_null(0.0)
        return (
            positions.drop_nulls([x, y, "floor"])
            .join(self.grids.lazy(), on=_FLOOR, how="left")
            .with_columns(
                row=((pl.col(y) - low_m) / cell_m).floor().cast(pl.Int64),
                column=((pl.col(x) - left_m) / cell_m).floor().cast(pl.Int64),
            )
        )


def _joined(parts: Sequence[pl.DataFrame], schema: Mapping[str, pl.DataType]) -> pl.DataFrame:
    return pl.concat([pl.DataFrame(schema=dict(schema)), *parts])


def _at(cells: pl.DataFrame, storey: Storey) -> pl.DataFrame:
    return cells.filter((pl.col("building") == storey.building) & (pl.col("floor") == storey.floor))


def _floor(
    storey: Storey, counts: pl.DataFrame, touched: pl.DataFrame, area: WalkableArea | None, settings: CoverageSettings
) -> FloorCoverage:
    """Lay the cells of one floor into arrays."""
    cells = touched.select("row", "column").to_numpy()
    near = around_most(cells)
    first, last = _span(cells[near], area.mask.shape if area else (0, 0))
    cell_m, (left_m, low_m) = (area.cell_m, area.origin_m) if area else (settings.cell_m, (0.0, 0.0))
    origin = (left_m + cell_m * float(first[1]), low_m + cell_m * float(first[0]))
    grid = CellGrid(origin, cell_m, *(last - first).tolist())
    walkable = np.zeros(grid.shape, dtype=np.bool_)
    if area is not None:
        row, column = (-first).tolist()
        walkable[row : row + area.mask.shape[0], column : column + area.mask.shape[1]] = area.mask
    walkable[tuple((cells[near] - first).T)] = True
    counted = counts.with_columns(pl.col("row") - int(first[0]), pl.col("column") - int(first[1]))
    inside = pl.col("row").is_between(0, grid.rows - 1) & pl.col("column").is_between(0, grid.columns - 1)
    by_device = {
        device: _laid(grid, counted.filter(inside & (pl.col("device") == device)))
        for device in counts["device"].unique().sort()
    }
    found = _sum(by_device, grid) > 0
    covered = walkable & (_distance_m(found, cell_m) <= settings.radius_m * (1 + _EPSILON))
    far = int(counted.filter(~inside)["count"].sum())
    return FloorCoverage(storey, grid, by_device, walkable, covered, far)


def _span(cells: IntArray, shape: tuple[int, ...]) -> tuple[IntArray, IntArray]:
    """The first row and column, and those beyond the last, of a grid of cells (n, 2) and an array at its origin."""
    ends = [np.zeros((1, 2), dtype=np.int64), np.array([shape], dtype=np.int64)] if all(shape) else []
    both = np.concatenate([cells, cells + 1, *ends])
    if not len(both):
        return np.zeros(2, dtype=np.int64), np.zeros(2, dtype=np.int64)
    return both.min(axis=0), both.max(axis=0)


def _sum(by_device: Mapping[str, IntArray], grid: CellGrid) -> IntArray:
    """Sum of all devices' counts (rows, columns)."""
    total = np.zeros(grid.shape, dtype=np.int64)
    for counts in by_device.values():
        total += counts
    return total


def _laid(grid: CellGrid, counts: pl.DataFrame) -> IntArray:
    """Counts by row and column as an array (rows, columns)."""
    laid = np.zeros(grid.shape, dtype=np.int64)
    laid[counts["row"].to_numpy(), counts["column"].to_numpy()] = counts["count"].to_numpy()
    return laid


def _distance_m(found: BoolArray, cell_m: float) -> FloatArray:
    """Metres (rows, columns) from each cell's centre to that of the nearest ``found`` one; infinite where none is."""
    if not found.any():
        return np.full(found.shape, np.inf)
    return np.asarray(distance_transform_edt(~found, sampling=cell_m), dtype=np.float64)
