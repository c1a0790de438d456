"""What changed on each floor between two surveys: places, and access points that appeared, vanished or moved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from vislam2tag.core.arrays import FloatArray
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
from vislam2tag.figures.panels import aspect_of, draw_plan, in_metres, letter, panel_grid, show
from vislam2tag.figures.style import PAGE_IN, print_quality
from vislam2tag.site.model import Floor

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
    extents = [_extent(floor, changes) for floor in floors]
    aspect = max(aspect_of(extent) for extent in extents)
    figure, axes = panel_grid(len(floors), min(2, len(floors)), PAGE_IN, aspect, extra_in=0.5)
    for one, floor, extent in zip(axes, floors, extents, strict=True):
        draw_plan(one, floor.floor)
        _draw_places(one, _on(changes, floor), changes.cell_m)
        _draw_points(one, changes.access_points, floor.floor.number)
        in_metres(one)
        show(one, extent)
    letter(axes, [floor.title for floor in floors])
    _explain(figure)
    return figure


def _on(changes: Changes, floor: ChangedFloor) -> pl.DataFrame:
    own = (pl.col("building").fill_null("") == floor.building) & (pl.col("floor") == floor.floor.number)
    return changes.places.filter(own)


def _extent(floor: ChangedFloor, changes: Changes) -> tuple[FloatArray, FloatArray]:
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


def _explain(figure: Figure) -> None:
    handles: list[Patch | Line2D] = [Patch(color=colour, alpha=0.6, label=name) for colour, name in PLACES.values()]
    handles += [
        Line2D([], [], color="black", marker=marker, markersize=4, linestyle="", label=f"access point {change}")
        for change, marker in POINTS.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4)
