"""Coverage of a data set: the cells with fingerprints, the walkable gaps between them, and walks that fill these gaps.

A place counts as covered if a fingerprint is within a radius of its cell's centre, by default 2 m. This is half of the
distance walked between the scans of a phone (3 to 4 s at 1 m/s), so an unbroken walk covers its own path. It is also
about the resolution of Wi-Fi fingerprinting (the paper's Table IV: mean errors of 2 to 3 m).

The stops of a walk are chosen so that each gap is within a radius of one. Between them the walk takes the shortest path
over walkable cells.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import ClassVar

import numpy as np
import polars as pl
from scipy.ndimage import distance_transform_edt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from vislam2tag.common.records import Record
from vislam2tag.common.tabular import Result
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.cell_grid import CellGrid, WalkableArea, around_most
from vislam2tag.core.status import Status
from vislam2tag.datasets.model import Dataset, RunningTotal, Storey, each_session
from vislam2tag.datasets.schema import IMU_WINDOWS, MAGNETIC
from vislam2tag.datasets.settings import CoverageSettings
from vislam2tag.datasets.statistics_record import UNKNOWN
from vislam2tag.site.walkable.walking_distances import WALKING_M_S, covering_stops, short_order

_FLOOR = ("building", "floor")
_CELL: Mapping[str, pl.DataType] = MappingProxyType(
    {"building": pl.String(), "floor": pl.Int32(), "row": pl.Int64(), "column": pl.Int64()}
)
_PATHS = (
    (MAGNETIC, "x", "y", "sigma"),
    (IMU_WINDOWS, "x_start", "y_start", "sigma_start"),
    (IMU_WINDOWS, "x_end", "y_end", "sigma_end"),
)
"""Tables that contain further positions of walks, with their sigmas."""
_EPSILON = 1e-9


@dataclass(frozen=True)
class FloorCoverage:
    """The cells of one floor; all arrays have the grid's shape (rows, columns)."""

    storey: Storey
    grid: CellGrid
    fingerprints: Mapping[str, IntArray]
    """Labelled fingerprints in each cell, by device."""
    walkable: BoolArray
    """Cells that a labelled walk certainly touched, and those of a given walkable area."""
    covered: BoolArray
    """Walkable cells with a fingerprint within the radius."""
    far: int
    """Labelled fingerprints that are too far from the others to be drawn, and are skipped."""

    @property
    def total(self) -> IntArray:
        """(rows, columns) labelled fingerprints in each cell, of all devices."""
        return _sum(self.fingerprints, self.grid)

    @property
    def gaps(self) -> BoolArray:
        """(rows, columns) walkable cells without a fingerprint within the radius."""
        missing: BoolArray = self.walkable & ~self.covered
        return missing

    @property
    def tells(self) -> bool:
        """Whether more is walkable than the fingerprints' own cells; otherwise coverage is meaningless."""
        return bool((self.walkable & (self.total == 0)).any())

    @property
    def share(self) -> float | None:
        """Share of the walkable cells that are covered; None without walkable cells."""
        walkable = int(self.walkable.sum())
        return int(self.covered.sum()) / walkable if walkable else None


def coverage(
    dataset: Dataset,
    technology: str = "wifi",
    settings: CoverageSettings | None = None,
    walkable: Mapping[Storey, WalkableArea] | None = None,
) -> tuple[FloorCoverage, ...]:
    """Count the cells of every floor that has a label or a walkable area, in order.
    One walk at a time is in memory, besides the cells.
    One walk at a time is in memory, and the cells.
    """
    settings, walkable = settings or CoverageSettings(), walkable or {}
    cells = _CellCounts.of(walkable, settings.cell_m)
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
    counts, touched = cells.counts.table, cells.touched.table
    storeys = sorted({*(Storey(*row) for row in touched.select(_FLOOR).unique().iter_rows()), *walkable})
    return tuple(
        _floor(storey, _at(counts, storey), _at(touched, storey), walkable.get(storey), settings) for storey in storeys
    )


def _known_within(positions: pl.LazyFrame, sigma: str, radius_m: float) -> pl.LazyFrame:
    """Skip positions with a larger sigma than the radius, which may be wrong; those without a sigma are kept."""
    return positions.filter(pl.col(sigma).fill_null(0.0) <= radius_m)


def _grid_table(walkable: Mapping[Storey, WalkableArea]) -> pl.DataFrame:
    """The grids of floors that have their own: building, floor, left_m, low_m, own_m (side of a cell)."""
    schema = {"building": pl.String, "floor": pl.Int32, "left_m": pl.Float64, "low_m": pl.Float64, "own_m": pl.Float64}
    rows = [(*storey, *area.origin_m, area.cell_m) for storey, area in walkable.items()]
    return pl.DataFrame(rows, schema=schema, orient="row")


@dataclass
class _CellCounts:
    """Cells by building, floor, row and column of the floor's own grid, or of one from the BCS origin."""

    grids: pl.DataFrame
    cell_m: float
    counts: RunningTotal
    touched: RunningTotal

    @classmethod
    def of(cls, walkable: Mapping[Storey, WalkableArea], cell_m: float) -> _CellCounts:
        """Start with no counts; ``cell_m`` is the side of cells on floors without a walkable area."""
        counts = {**_CELL, "device": pl.String(), "count": pl.Int64()}
        return cls(
            _grid_table(walkable),
            cell_m,
            RunningTotal((*_CELL, "device"), (pl.col("count").sum(),), counts),
            RunningTotal(tuple(_CELL), schema=_CELL),
        )

    def count(self, fingerprints: pl.LazyFrame) -> None:
        """Count labelled fingerprints by cell and device."""
        counts = self._located(fingerprints, "x", "y").group_by(*_CELL, "device").agg(count=pl.len().cast(pl.Int64))
        self.counts.add(counts.collect(engine="streaming"))

    def mark(self, positions: pl.LazyFrame, x: str, y: str) -> None:
        """Mark the cells that contain positions."""
        self.touched.add(self._located(positions, x, y).select(*_CELL).unique().collect(engine="streaming"))

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


def _at(cells: pl.DataFrame, storey: Storey) -> pl.DataFrame:
    return cells.filter((pl.col("building") == storey.building) & (pl.col("floor") == storey.floor))


def _floor(
    storey: Storey, counts: pl.DataFrame, touched: pl.DataFrame, area: WalkableArea | None, settings: CoverageSettings
) -> FloorCoverage:
    """Put the cells of one floor into arrays."""
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
    return sum(by_device.values(), start=np.zeros(grid.shape, dtype=np.int64))


def _laid(grid: CellGrid, counts: pl.DataFrame) -> IntArray:
    """Counts by row and column as an array (rows, columns)."""
    laid = np.zeros(grid.shape, dtype=np.int64)
    laid[counts["row"].to_numpy(), counts["column"].to_numpy()] = counts["count"].to_numpy()
    return laid


def _distance_m(found: BoolArray, cell_m: float) -> FloatArray:
    """Distance (rows, columns) from each cell's centre to that of the nearest ``found`` cell, metres, or infinity."""
    if not found.any():
        return np.full(found.shape, np.inf)
    return np.asarray(distance_transform_edt(~found, sampling=cell_m), dtype=np.float64)


@dataclass(frozen=True)
class GapWalk:
    """A walk over walkable cells of one floor. A floor with unconnected parts needs several."""

    points_m: FloatArray
    """Corners of the path (k, 2), BCS."""
    stops_m: FloatArray
    """Stops near the gaps, in order (s, 2), BCS."""
    length_m: float
    gap_cells: int
    """Number of cells that it fills."""

    def minutes(self, speed_m_s: float = WALKING_M_S) -> float:
        """Duration of the walk."""
        return self.length_m / speed_m_s / 60


def gap_walks(
    coverage: FloorCoverage, radius_m: float = 2.0, start_m: tuple[float, float] | None = None
) -> tuple[GapWalk, ...]:
    """Plan walks that come within ``radius_m`` of every gap, the most useful one first.

    A walk starts at the walkable cell nearest to ``start_m`` if that is in its part of the floor, else anywhere.
    """
    if not coverage.gaps.any():
        return ()
    places_m, graph = walk_graph(coverage)
    _, part = connected_components(graph, directed=False)
    gap = coverage.gaps[coverage.walkable]
    start = None if start_m is None else int(np.argmin(np.linalg.norm(places_m - start_m, axis=1)))
    walks = []
    for own in np.unique(part[gap]):
        begin = start if start is not None and part[start] == own else None
        walks.append(_walk(places_m, graph, np.flatnonzero(gap & (part == own)), radius_m, begin))
    return tuple(sorted(walks, key=lambda walk: -walk.gap_cells))


def walk_graph(coverage: FloorCoverage) -> tuple[FloatArray, csr_array]:
    """The walkable cells as a graph: their centres (n, 2), and the distances (n, n) between neighbours, metres.

    A diagonal step needs both adjacent cells, so that paths do not cut corners.
    """
    walkable, cell_m = coverage.walkable, coverage.grid.cell_m
    number = np.cumsum(walkable.ravel()).reshape(walkable.shape) - 1
    right, up = (walkable[:, :-1] & walkable[:, 1:]), (walkable[:-1] & walkable[1:])
    square = right[:-1] & right[1:] & up[:, :-1] & up[:, 1:]
    steps = (
        (number[:, :-1][right], number[:, 1:][right], cell_m),
        (number[:-1][up], number[1:][up], cell_m),
        (number[:-1, :-1][square], number[1:, 1:][square], np.sqrt(2) * cell_m),
        (number[:-1, 1:][square], number[1:, :-1][square], np.sqrt(2) * cell_m),
    )
    ends = [np.concatenate([step[side] for step in steps]) for side in (0, 1)]
    length = np.concatenate([np.full(len(step[0]), step[2]) for step in steps])
    size = int(walkable.sum())
    graph = csr_array((length, (ends[0], ends[1])), shape=(size, size))
    return coverage.grid.centres_m(np.argwhere(walkable)), graph


def _ways_between(graph: csr_array, places: IntArray) -> tuple[FloatArray, IntArray]:
    """Lengths (s, s) of the shortest paths between places, and the predecessor of each cell on the way back (s, n)."""
    rows = [dijkstra(graph, directed=False, indices=place, return_predecessors=True) for place in places]
    return np.array([length[places] for length, _ in rows]), np.array([before for _, before in rows])


def _walk(places_m: FloatArray, graph: csr_array, gaps: IntArray, radius_m: float, start: int | None) -> GapWalk:
    """Plan one walk past gaps (g,), from the cell ``start`` if given; cells are indices."""
    stops = gaps[covering_stops(places_m[gaps], radius_m)]
    places = stops if start is None else np.append(start, stops)
    length_m, before = _ways_between(graph, places)
    order = short_order(length_m, free=start is None)
    legs = [_way(before[a], int(places[a]), int(places[b])) for a, b in pairwise(order)]
    cells = np.concatenate([places[order[:1]], *legs])
    return GapWalk(
        points_m=_corners(places_m[cells]),
        stops_m=places_m[places[order[0 if start is None else 1 :]]],
        length_m=float(length_m[order[:-1], order[1:]].sum()),
        gap_cells=len(gaps),
    )


def _way(before: IntArray, start: int, stop: int) -> IntArray:
    """Cells (k,) from ``start`` (excluded) to ``stop``; ``before`` (n,) is the predecessor of each cell."""
    way = []
    while stop != start:
        way.append(stop)
        stop = int(before[stop])
    return np.array(way[::-1], dtype=np.int64)


def _corners(points_m: FloatArray) -> FloatArray:
    """Remove the points (k, 2) at which a path goes straight on."""
    if len(points_m) < 3:
        return points_m
    into, out = np.diff(points_m[:-1], axis=0), np.diff(points_m[1:], axis=0)
    turns = np.abs(into - out).max(axis=1) > _EPSILON
    return np.asarray(points_m[np.concatenate([[True], turns, [True]])])


class WalkRecord(Record):
    """One walk to make. Corners and stops are in the BCS, metres, in order."""

    length_m: float
    minutes: float
    gap_m2: float
    points_m: list[tuple[float, float]]
    stops_m: list[tuple[float, float]]


class FloorCoverageRecord(Record):
    """Coverage of one floor."""

    building: str
    floor: int
    cell_m: float
    walkable_m2: float
    covered_m2: float
    share: float | None
    """Covered share of the walkable cells; None if only the fingerprints themselves show what is walkable."""
    fingerprints: int
    far: int
    """Fingerprints too far from the others to be counted."""
    walks: list[WalkRecord]


class CoverageRecord(Result):
    """Coverage of all floors."""

    main_table: ClassVar[str] = "floors"

    settings: CoverageSettings
    technology: str
    floors: list[FloorCoverageRecord]


def floor_record(coverage: FloorCoverage, walks: Sequence[GapWalk]) -> FloorCoverageRecord:
    """Summarise one floor's cells."""
    building, floor = coverage.storey
    cell_m2 = coverage.grid.cell_m**2
    return FloorCoverageRecord(
        building=building,
        floor=floor,
        cell_m=coverage.grid.cell_m,
        walkable_m2=round(float(coverage.walkable.sum()) * cell_m2, 3),
        covered_m2=round(float(coverage.covered.sum()) * cell_m2, 3),
        share=round(coverage.share, 6) if coverage.share is not None and coverage.tells else None,
        fingerprints=int(coverage.total.sum()),
        far=coverage.far,
        walks=[_walk_record(walk, cell_m2) for walk in walks],
    )


def _walk_record(walk: GapWalk, cell_m2: float) -> WalkRecord:
    return WalkRecord(
        length_m=round(walk.length_m, 3),
        minutes=round(walk.minutes(), 3),
        gap_m2=round(walk.gap_cells * cell_m2, 3),
        points_m=[(round(x, 3), round(y, 3)) for x, y in walk.points_m.tolist()],
        stops_m=[(round(x, 3), round(y, 3)) for x, y in walk.stops_m.tolist()],
    )
