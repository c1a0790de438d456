"""How unlikely it is to walk through each place of a floor, by its plan.

Walking through a wall costs about 4 nats, so one door that is not drawn does not refute a pose. Small obstacles, also
at walls, may be furniture, which people move, and cost little.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from vislam2tag.core.cell_grid import CellGrid, WalkableArea, continuing_walls, without_slits

Float32Array: TypeAlias = npt.NDArray[np.float32]

FINE_M = 0.1
"""Side of the cells that have a cost, metres."""
COARSE = 4
"""A cell of positions is as wide as so many of these."""
POSITION_M = FINE_M * COARSE
OUTSIDE_NATS_M = 10.0
"""Cost of a metre outside the walkable cells ..."""
AT_WALL_NATS_M, NEAR_WALL_M = 6.0, 0.25
"""... and at a wall, which falls to 0 at this distance from it."""
FURNITURE_M, FURNITURE_SHARE = 2.5, 0.1
"""Obstacles that fit into a square of this side cost only this share ..."""
THICK_M, LINE_M = 0.5, 1.0
"""... if they are thicker than walls usually are, or are no straight lines longer than this, which may be walls whose
rest is not drawn.
"""
REACH_M = 14.0
"""Points of a stretch are at most this far from its middle, metres."""


@dataclass(frozen=True)
class WallCosts:
    """Cost of a metre of way, nats, on cells of :data:`FINE_M`: ``cost`` (rows, columns), row 0 and column 0 begin at
    ``origin_m`` (x, y), BCS.
    """

    cost: Float32Array
    origin_m: tuple[float, float]

    @classmethod
    def of(cls, area: WalkableArea) -> WallCosts:
        """Compute them for an area."""
        from scipy.ndimage import distance_transform_edt

        free = _resampled(area)
        blocked = np.pad(~free, 1, constant_values=True)
        furniture = _furniture(blocked)
        walls = blocked & ~furniture
        solid = without_slits(walls | continuing_walls(walls, furniture, FINE_M), FINE_M)
        cost = np.zeros(blocked.shape, dtype=np.float32)
        for walls, share in ((blocked, FURNITURE_SHARE), (solid, 1.0)):
            away_m = (np.asarray(distance_transform_edt(~walls)) - 0.5) * FINE_M
            near = AT_WALL_NATS_M * (1 - away_m / NEAR_WALL_M).clip(0, 1)
            cost = np.maximum(cost, share * np.where(walls, OUTSIDE_NATS_M, near)).astype(np.float32)
        return cls(np.ascontiguousarray(cost[1:-1, 1:-1]), area.origin_m)

    @property
    def positions(self) -> CellGrid:
        """The grid of positions."""
        rows, columns = (-(-side // COARSE) for side in self.cost.shape)
        return CellGrid(self.origin_m, POSITION_M, rows, columns)

    @cached_property
    def interleaved(self) -> Float32Array:
        """(4, 4, rows, columns) the costs that lie at the same place of each coarse cell, with a margin of
        :data:`REACH_M` all around, where a metre costs as much as outside.
        """
        margin, grid = round(REACH_M / POSITION_M) * COARSE, self.positions
        padded = np.full(
            (grid.rows * COARSE + 2 * margin, grid.columns * COARSE + 2 * margin), OUTSIDE_NATS_M, dtype=np.float32
        )
        padded[margin : margin + self.cost.shape[0], margin : margin + self.cost.shape[1]] = self.cost
        rows, columns = (side // COARSE for side in padded.shape)
        parts = padded.reshape(rows, COARSE, columns, COARSE).transpose(1, 3, 0, 2)
        return np.ascontiguousarray(parts)


def on_common_cells(costs: Mapping[int, WallCosts]) -> dict[int, WallCosts]:
    """Costs of floors, by number, all on one rectangle, to a cell; a metre in the margin costs as much as outside."""
    origins = np.array([one.origin_m for one in costs.values()])
    lower = origins.min(axis=0)
    upper = (origins + FINE_M * np.array([one.cost.shape[::-1] for one in costs.values()])).max(axis=0)
    common = {}
    for number, one in costs.items():
        before = np.round((np.array(one.origin_m) - lower) / FINE_M).astype(np.int64)[::-1]
        after = np.ceil((upper - lower) / FINE_M).astype(np.int64)[::-1] - one.cost.shape - before
        padded = np.pad(one.cost, np.stack((before, after), axis=1), constant_values=OUTSIDE_NATS_M)
        common[number] = WallCosts(padded, (float(lower[0]), float(lower[1])))
    return common


def _resampled(area: WalkableArea) -> npt.NDArray[np.bool_]:
    """The area's mask on cells of :data:`FINE_M`; a cell counts as free if its middle is."""
    if abs(area.cell_m - FINE_M) < 1e-9:
        return area.mask
    rows, columns = (
        np.minimum((np.arange(max(round(side * area.cell_m / FINE_M), 1)) + 0.5) * FINE_M / area.cell_m, side - 1)
        for side in area.mask.shape
    )
    return np.asarray(area.mask[np.ix_(rows.astype(np.int64), columns.astype(np.int64))])


def _furniture(blocked: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Blocked cells (rows, columns) of small obstacles, those that touch walls included."""
    from scipy.ndimage import binary_dilation, binary_opening

    radius = int(THICK_M / 2 / FINE_M)
    disc = np.hypot(*np.mgrid[-radius : radius + 1, -radius : radius + 1]) <= radius + 0.3
    filled = blocked | _small_parts(~blocked)  # closed outlines
    thick = _small_parts(np.asarray(binary_opening(filled, disc)))
    around_thick = np.asarray(binary_dilation(thick, np.ones((3, 3), dtype=np.bool_)))
    return blocked & (_small_parts(blocked, LINE_M) | around_thick)


def _small_parts(mask: npt.NDArray[np.bool_], longest_line_m: float = np.inf) -> npt.NDArray[np.bool_]:
    """Cells (rows, columns) of connected parts of a mask that fit into a square of :data:`FURNITURE_M` and are no
    lines along an axis that are longer than ``longest_line_m``.
    """
    from scipy.ndimage import find_objects, label

    parts, count = label(mask, structure=np.ones((3, 3)))
    small = np.zeros(count + 1, dtype=np.bool_)
    for number, box in enumerate(find_objects(parts), 1):
        short, long = sorted((side.stop - side.start) * FINE_M for side in box)
        line = long > longest_line_m and short < THICK_M
        small[number] = long <= FURNITURE_M and not line
    return np.asarray(small[parts])
