"""Fingerprints on each floor's plan in print: cells covered, gaps and walks that fill them; changes between surveys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import polars as pl
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from vislam2tag.core.arrays import IntArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.datasets.changes import (
    APPEARED,
    CHANGED,
    MOVED,
    NEW,
    NOT_WALKED,
    OUTDATED,
    UNCHANGED,
    VANISHED,
    Changes,
)
from vislam2tag.datasets.coverage import FloorCoverage, GapWalk
from vislam2tag.site.model import Floor
from vislam2tag.views.panels import Extent, draw_cells, floor_panels, print_quality

CLASSES = (1, 2, 3, 6, 11, 21)
"""Least number of fingerprints of each colour."""
COLOURS = [to_hex(colour) for colour in colormaps["YlGnBu"](np.linspace(0.35, 1.0, len(CLASSES)))]
COVERED, GAP, WALK = "#dde7ee", "#e69f00", "#d55e00"


@dataclass(frozen=True)
class CoveredFloor:
    """What is drawn of a floor."""

    title: str
    floor: Floor
    coverage: FloorCoverage
    walks: Sequence[GapWalk] = ()


@print_quality
def coverage_map(floors: Sequence[CoveredFloor]) -> Figure:
    """Draw the fingerprints a cell on each floor's plan, walkable cells near none, and the walks that fill them."""
    extents = [
        _extent([other for other in floors if other.coverage.storey.building == floor.coverage.storey.building])
        for floor in floors
    ]
    titles = [_title(floor) for floor in floors]
    figure, axes = floor_panels([floor.floor for floor in floors], extents, titles, extra_in=0.5)
    for one, floor in zip(axes, floors, strict=True):
        _draw_cells(one, floor.coverage)
        for walk in floor.walks:
            one.plot(*walk.points_m.T, color=WALK, linewidth=1.1, zorder=5)
            one.plot(*walk.points_m[0], "o", color=WALK, markeredgecolor="white", markersize=4, zorder=6)
    _explain(figure, walks=any(floor.walks for floor in floors))
    return figure


def _extent(floors: Sequence[CoveredFloor]) -> Extent:
    """Lower left and upper right corner of the plans and cells of a building, so that its floors can be compared."""
    corners = []
    for floor in floors:
        left, right, low, high = floor.coverage.grid.extent_m
        corners += [(left, low), (right, high)]
        corners += floor.floor.corners_m.tolist()
    return np.min(corners, axis=0), np.max(corners, axis=0)


def _draw_cells(axes: Axes, coverage: FloorCoverage) -> None:
    kind = np.where(coverage.gaps, 1, np.where(coverage.walkable, 0, -1))
    _lay(axes, kind, coverage.grid, (COVERED, GAP), zorder=1)
    _lay(axes, np.searchsorted(CLASSES, coverage.total, side="right") - 1, coverage.grid, COLOURS, zorder=2)


def _lay(axes: Axes, kind: IntArray, grid: CellGrid, colours: Sequence[str], zorder: int) -> None:
    """Paint each cell with the colour of its kind (rows, columns); those below zero stay clear."""
    scale = {"cmap": ListedColormap(colours), "vmin": 0, "vmax": len(colours) - 1}
    shown = np.ma.masked_less(kind, 0)
    draw_cells(axes, shown, grid.extent_m, zorder, interpolation="nearest", alpha=0.85, **scale)


def _title(floor: CoveredFloor) -> str:
    """Name, and the share covered where more is walkable than the fingerprints' own cells."""
    coverage = floor.coverage
    if coverage.share is None or not coverage.tells:
        return floor.title
    stops = sum(len(walk.stops_m) for walk in floor.walks)
    ways = sum(walk.length_m for walk in floor.walks)
    walks = f", {ways:.0f} m to {stops} places fill the gaps" if stops > 1 else ", one place lacks" if stops else ""
    return f"{floor.title}: {100 * coverage.share:.0f} % covered{walks}"


def _explain(figure: Figure, *, walks: bool) -> None:
    last = f"over {CLASSES[-1] - 1}"
    names = [f"{low}" if high - low == 1 else f"{low} to {high - 1}" for low, high in pairwise(CLASSES)]
    counts = [Patch(color=colour, label=name) for colour, name in zip(COLOURS, [*names, last], strict=True)]
    figure.legend(handles=counts[::-1], title="fingerprints\na cell", loc="outside right upper", title_fontsize=6)
    handles: list[Patch | Line2D] = [
        Patch(color=COVERED, label="walkable, a fingerprint is near"),
        Patch(color=GAP, label="walkable, none is near"),
    ]
    if walks:
        handles.append(Line2D([], [], color=WALK, marker="o", markersize=3.5, label="walk that fills the gaps"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3)


PLACES = {
    CHANGED: ("#d55e00", "RSSI changed (the fuller, the more)"),
    OUTDATED: ("#e69f00", "not walked again, heard what changed"),
    UNCHANGED: ("#a6cee3", "unchanged"),
    NEW: ("#009e73", "walked for the first time"),
    NOT_WALKED: ("#dddddd", "not walked again"),
}
"""Colour and name of each kind of place."""
FULL_DB = 10.0
"""Root mean square change that fills a place."""
POINTS = {APPEARED: "P", VANISHED: "X", MOVED: "o"}
"""Marker of each kind of access point that changed."""


@dataclass(frozen=True)
class ChangedFloor:
    """A floor to draw."""

    title: str
    building: str
    floor: Floor


@print_quality
def change_map(floors: Sequence[ChangedFloor], changes: Changes) -> Figure:
    """Draw each floor's places by how they changed, the access points that changed, and where those went that moved."""
    extents = [_extent_of_changes(floor, changes) for floor in floors]
    titles = [floor.title for floor in floors]
    figure, axes = floor_panels([floor.floor for floor in floors], extents, titles, extra_in=0.5)
    for one, floor in zip(axes, floors, strict=True):
        _draw_places(one, _on(changes, floor), changes.cell_m)
        _draw_points(one, changes.access_points, floor.floor.number)
    _explain_changes(figure)
    return figure


def _on(changes: Changes, floor: ChangedFloor) -> pl.DataFrame:
    own = (pl.col("building").fill_null("") == floor.building) & (pl.col("floor") == floor.floor.number)
    return changes.places.filter(own)


def _extent_of_changes(floor: ChangedFloor, changes: Changes) -> Extent:
    centres = _on(changes, floor).select("x", "y").to_numpy()
    corners = [centres - changes.cell_m / 2, centres + changes.cell_m / 2]
    every = np.concatenate((*corners, floor.floor.corners_m))
    return every.min(axis=0), every.max(axis=0)


def _draw_places(axes: Axes, places: pl.DataFrame, cell_m: float) -> None:
    for x, y, change, size_db in places.select("x", "y", "change", "size_db").iter_rows():
        corner = (x - cell_m / 2, y - cell_m / 2)
        alpha = min(1.0, 0.15 + size_db / FULL_DB) if change == CHANGED else 0.6
        axes.add_patch(Rectangle(corner, cell_m, cell_m, color=PLACES[change][0], alpha=alpha, linewidth=0, zorder=2))


def _draw_points(axes: Axes, points: pl.DataFrame, number: int) -> None:
    for row in points.filter(pl.col("change").is_in(list(POINTS))).iter_rows(named=True):
        old, new = ((row[f"{survey}_x"], row[f"{survey}_y"]) for survey in ("base", "later"))
        change = row["change"]
        if change == MOVED and row["base_floor"] == row["later_floor"] == number:
            axes.annotate("", new, old, arrowprops={"arrowstyle": "->", "linewidth": 0.8}, zorder=5)
        if change != APPEARED and row["base_floor"] == number:
            _mark(axes, old, change)
        if change == APPEARED and row["later_floor"] == number:
            _mark(axes, new, change)


def _mark(axes: Axes, at: tuple[float, float], change: str) -> None:
    axes.plot(*at, POINTS[change], color="black", markersize=5, markeredgecolor="white", markeredgewidth=0.5, zorder=6)


def _explain_changes(figure: Figure) -> None:
    handles: list[Patch | Line2D] = [Patch(color=colour, alpha=0.6, label=name) for colour, name in PLACES.values()]
    handles += [
        Line2D([], [], color="black", marker=marker, markersize=4, linestyle="", label=f"access point {change}")
        for change, marker in POINTS.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
