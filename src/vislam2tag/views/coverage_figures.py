"""Print figures of coverage by floor: cells with fingerprints, gaps, walks to fill them, changes between surveys."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import polars as pl
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

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
from vislam2tag.datasets.model import Storey
from vislam2tag.site.model import Floor, is_own_name
from vislam2tag.views.layers import (
    ORANGE,
    VERMILION,
    Trace,
    area,
    arrows,
    dots,
    grid_cells,
    joined,
    one_colour,
    scatter,
)
from vislam2tag.views.panels import Extent, PlanPanel, extent_over, printed

CLASSES = (1, 2, 3, 6, 11, 21)
"""Minimum number of fingerprints for each colour."""
COLOURS = [to_hex(colour) for colour in colormaps["YlGnBu"](np.linspace(0.35, 1.0, len(CLASSES)))]
COVERED = "#dde7ee"


@dataclass(frozen=True)
class CoveredFloor:
    """A floor to draw."""

    title: str
    floor: Floor
    coverage: FloorCoverage
    walks: Sequence[GapWalk] = ()


def coverage_map(floors: Sequence[CoveredFloor]) -> Figure:
    """Draw fingerprints per cell on each floor's plan, walkable cells without any nearby, and walks to fill them."""
    return printed(
        [
            PlanPanel(
                _title(floor),
                floor.floor,
                [*_cells(floor.coverage), *walk_layers(floor.walks)],
                _extent([one for one in floors if one.coverage.storey.building == floor.coverage.storey.building]),
            )
            for floor in floors
        ],
        extra_in=0.7,
    )


def _extent(floors: Sequence[CoveredFloor]) -> Extent:
    """Lower left and upper right corner of the plans and cells of a building, so that its floors can be compared."""
    return extent_over(*(corners for one in floors for corners in (_corners(one.coverage.grid), one.floor.corners_m)))


def _corners(grid: CellGrid) -> list[tuple[float, float]]:
    left, right, low, high = grid.extent_m
    return [(left, low), (right, high)]


def _cells(coverage: FloorCoverage) -> Iterator[Trace]:
    """Cells near a fingerprint, cells near none, and those with fingerprints by their number."""
    classes = np.searchsorted(CLASSES, coverage.total, side="right") - 1
    names = [f"{low}" if high - low == 1 else f"{low} to {high - 1}" for low, high in pairwise(CLASSES)]
    kinds = [
        ("walkable, fingerprint nearby", coverage.walkable & ~coverage.gaps, COVERED),
        ("walkable, no fingerprint nearby", coverage.gaps, ORANGE),
        *(
            (f"fingerprints per cell: {name}", classes == number, COLOURS[number])
            for number, name in enumerate([*names, f"over {CLASSES[-1] - 1}"])
        ),
    ]
    for name, mask, colour in kinds:
        yield grid_cells(name, coverage.grid, np.where(mask, 1.0, np.nan), opacity=0.85, **one_colour(colour))


def walk_layers(walks: Sequence[GapWalk]) -> list[Trace]:
    """The walks to fill gaps as one line with breaks, and their stops; a walk of one stop is a point."""
    if not walks:
        return []
    name = f"walk to fill the gaps, {sum(walk.length_m for walk in walks):.0f} m"
    line = joined(np.round(walk.points_m, 2) for walk in walks)
    look: dict[str, Any] = {"marker": {"size": 6}, "line": {"color": VERMILION, "width": 3}, "hoverinfo": "name"}
    return [scatter("lines+markers", name, line, **look)]


def _title(floor: CoveredFloor) -> str:
    """Name of the floor, and the share covered if more is walkable than the fingerprints' own cells."""
    coverage = floor.coverage
    if coverage.share is None or not coverage.tells:
        return floor.title
    stops = sum(len(walk.stops_m) for walk in floor.walks)
    ways = sum(walk.length_m for walk in floor.walks)
    walks = f", {ways:.0f} m to {stops} places fill the gaps" if stops > 1 else ", one gap" if stops else ""
    return f"{floor.title}: {100 * coverage.share:.0f} % covered{walks}"


PLACES = {
    CHANGED: (VERMILION, "RSSI changed (fuller: more)"),
    OUTDATED: (ORANGE, "not walked again, received a changed access point"),
    UNCHANGED: ("#a6cee3", "unchanged"),
    NEW: ("#009e73", "walked for the first time"),
    NOT_WALKED: ("#dddddd", "not walked again"),
}
"""Colour and name of each kind of place."""
FULL_DB = 10.0
"""Root mean square change that fills a place."""
POINTS = {APPEARED: "cross", VANISHED: "x", MOVED: "circle"}
"""Marker of each kind of access point that changed."""


@dataclass(frozen=True)
class ChangedFloor:
    """A floor to draw."""

    title: str
    building: str
    floor: Floor


def change_map(floors: Sequence[ChangedFloor], changes: Changes) -> Figure:
    """Draw each floor's places by their change, and the access points that changed or moved."""
    panels = []
    half_m = changes.cell_m / 2
    for one in floors:
        own = (pl.col("building").fill_null("") == one.building) & (pl.col("floor") == one.floor.number)
        places = changes.places.filter(own)
        centres = places.select("x", "y").to_numpy()
        extent = extent_over(centres - half_m, centres + half_m, one.floor.corners_m)
        layers = [*_places(places, half_m), *_points(changes.access_points, one.floor.number)]
        panels.append(PlanPanel(one.title, one.floor, layers, extent))
    return printed(panels, extra_in=0.7)


def _places(places: pl.DataFrame, half_m: float) -> Iterator[Trace]:
    corners = half_m * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    for x, y, change, size_db in places.select("x", "y", "change", "size_db").iter_rows():
        colour, name = PLACES[change]
        opacity = min(1.0, 0.15 + size_db / FULL_DB) if change == CHANGED else 0.6
        yield area(name, corners + np.array((x, y)), colour, opacity)


def _points(points: pl.DataFrame, number: int) -> Iterator[Trace]:
    """Access points at their positions in the earlier survey, new ones, and lines to new positions of moved ones."""
    here = points.with_columns(pl.col("base_floor", "later_floor") == number)
    moved = here.filter((pl.col("change") == MOVED) & pl.col("base_floor") & pl.col("later_floor"))
    ways = moved.select("base_x", "base_y", "later_x", "later_y").to_numpy().reshape(-1, 2, 2)
    yield arrows(
        "moved", "#000000", 2, [(tuple(old), tuple(new - old), "", "") for old, new in ways], 0.03, showlegend=False
    )
    for change, symbol in POINTS.items():
        survey = "later" if change == APPEARED else "base"
        own = here.filter((pl.col("change") == change) & pl.col(f"{survey}_floor"))
        places = own.select(f"{survey}_x", f"{survey}_y").to_numpy()
        yield dots(f"access point {change}", places, "#000000", 12, symbol, edge={"color": "white", "width": 1})


def storey_title(storey: Storey, name: str = "") -> str:
    """Building, name and number of a floor as a heading."""
    building, number = storey
    if is_own_name(name, number):
        return f"{building}, {name} (floor {number})" if building else f"{name} (floor {number})"
    return f"{building}, floor {number}" if building else f"Floor {number}"
