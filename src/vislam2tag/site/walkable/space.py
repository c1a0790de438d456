"""Where a floor can be walked, from its plan; settings of the whole package."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.cell_grid import CellGrid, WalkableArea
from vislam2tag.site.plans.source import FloorPlan
from vislam2tag.site.settings import WalkableSettings

_TOLERANCE_CELLS = 0.8
"""Segments leave the cells' own outline by at most this: a slanting wall is one, not a staircase."""


def wall_segments(area: WalkableArea) -> FloatArray:
    """Segments (w, 2, 2) of an area's boundary, BCS metres, with the area on the left of start to stop."""
    from skimage.measure import approximate_polygon, find_contours

    contours = find_contours(np.pad(area.mask, 1).astype(np.float32), 0.5, positive_orientation="low")
    rings = (approximate_polygon(contour, _TOLERANCE_CELLS)[:, ::-1] for contour in contours)
    segments = [np.stack((corners[:-1], corners[1:]), axis=1) for corners in rings if len(corners) > 3]
    if not segments:
        return np.empty((0, 2, 2))
    # Row and column 0 of the padded mask lie half a cell outside the first cell's edge.
    placed: FloatArray = (np.vstack(segments) - 0.5) * area.cell_m + np.array(area.origin_m)
    return placed


_Value = TypeVar("_Value", np.bool_, np.float64)
_OFF_WALL_CELLS = 1.5
"""Ends of a line of sight that lie in a wall's surface, as sheets do, are seen from so many cells off it."""
_DIRECTIONS = np.arange(16) * 2 * np.pi / 16
_AROUND = np.column_stack((np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)))


@dataclass(frozen=True)
class WalkableSpace:
    """Where a floor can be walked: one connected region, BCS metres."""

    area: WalkableArea
    walls: FloatArray
    """(w, 2, 2) segments of the region's boundary; who goes from start to stop has the free space on the left."""
    findings: tuple[Finding, ...] = ()
    """What is odd about the plan: regions that are closed off, a plan without an outer wall."""
    free: BoolArray | None = None
    """(rows, columns) all that is no wall inside of the building, closed-off and narrow parts included; None if the
    area does not come from a plan.
    """

    @cached_property
    def clearance_m(self) -> FloatArray:
        """Distance (rows, columns) from each cell's centre to the nearest wall, 0 where no one can walk, metres."""
        from scipy.ndimage import distance_transform_edt  # slow to load, and who only needs settings does without

        padded = np.pad(self.area.mask, 1)
        cells: FloatArray = np.asarray(distance_transform_edt(padded))[1:-1, 1:-1]
        return np.maximum(cells - 0.5, 0.0) * self.area.cell_m

    def inside(self, points_m: FloatArray) -> BoolArray:
        """Return (n,) which points (n, 2) can be walked to."""
        return self._at(points_m, self.area.mask)

    def clearance_at(self, points_m: FloatArray) -> FloatArray:
        """Distance (n,) of points (n, 2) to the nearest wall; 0 where no one can walk; metres."""
        return self._at(points_m, self.clearance_m)

    def clear_line(self, start_m: FloatArray, stop_m: FloatArray) -> BoolArray:
        """Return (n,) which straight lines from ``start_m`` (n, 2) to ``stop_m`` (n, 2) cross no wall; both broadcast.

        An end may lie in a wall's surface, as that of a line to a sheet does.
        """
        ends = np.broadcast_arrays(np.atleast_2d(start_m), np.atleast_2d(stop_m))
        start, stop = self._off_wall(*ends), self._off_wall(*ends[::-1])
        length = np.linalg.norm(stop - start, axis=1)
        unit = (stop - start) / np.maximum(length, 1e-12)[:, None]
        gone = np.zeros(len(length))
        clear = np.ones(len(length), dtype=np.bool_)
        active = np.arange(len(length))
        while len(active):
            # A step as long as the wall is far off crosses none.
            clearance = self.clearance_at(start[active] + gone[active, None] * unit[active])
            clear[active] = clearance > 0
            gone[active] += np.maximum(clearance, 0.5 * self.area.cell_m)
            active = active[clear[active] & (gone[active] < length[active])]
        return clear

    def _off_wall(self, ends: FloatArray, others: FloatArray) -> FloatArray:
        """The ends (n, 2) of lines, those in a wall's surface moved off it, to the side of the other ends."""
        moved = np.array(ends, dtype=np.float64)
        near = np.flatnonzero(self.clearance_at(moved) < self.area.cell_m)
        if not len(near):
            return moved
        towards = others[near] - moved[near]
        aside = moved[near, None] + _OFF_WALL_CELLS * self.area.cell_m * _AROUND  # (near, directions, 2)
        clearance = np.where(towards @ _AROUND.T > 0, self.clearance_at(aside).reshape(len(near), -1), 0.0)
        best = np.argmax(clearance, axis=1)
        found = clearance[np.arange(len(near)), best] > 0
        moved[near[found]] = aside[found, best[found]]
        return moved

    def _at(self, points_m: FloatArray, field: npt.NDArray[_Value]) -> npt.NDArray[_Value]:
        """Values (n,) of a field (rows, columns) at points (n, 2); 0 or False outside."""
        row, column = self.area.grid.cells_of(np.asarray(points_m, dtype=np.float64).reshape(-1, 2)).T
        rows, columns = field.shape
        on = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        values = np.zeros(len(row), dtype=field.dtype)
        values[on] = field[row[on], column[on]]
        return values


def walkable_space(
    plan: FloorPlan, settings: WalkableSettings | None = None, mask: npt.NDArray[np.uint8] | None = None
) -> WalkableSpace:
    """Find the walkable space of a floor: from the plan's polygons, else its walls, else its image.

    ``mask`` (rows, columns, 3 or 4) uint8 is a drawn correction that covers the plan's extent, at any size, row 0 at
    the top: green can be walked, red cannot, any other colour says nothing. Raises SurveyError where nothing can be
    walked, or the mask belongs to another plan.
    """
    settings = settings or WalkableSettings()
    from vislam2tag.site.plans.room_labels import room_labels
    from vislam2tag.site.walkable.painted_cells import largest_region

    free, grid, findings = free_cells(plan, settings, mask)
    region, closed_off = largest_region(free, grid, settings, room_labels(plan.texts))
    if not region.any():
        raise SurveyError(
            "the plan has no walkable space; expected walls around free space that is wider than "
            f"{settings.passage_m} m. Check the plan's scale, or paint the floor green in a mask and pass it as "
            "--mask"
        )
    area = WalkableArea(region, grid.origin_m, grid.cell_m)
    return WalkableSpace(area, wall_segments(area), findings + closed_off, free)


def free_cells(
    plan: FloorPlan, settings: WalkableSettings, mask: npt.NDArray[np.uint8] | None = None
) -> tuple[BoolArray, CellGrid, tuple[Finding, ...]]:
    """Which cells (rows, columns) of a floor are no wall, closed-off parts included, their grid, and findings.

    ``mask`` is as :func:`walkable_space` says.
    """
    # of an extra: generated buildings, which have no plan, do without
    from vislam2tag.site.walkable.drawn_cells import plan_grid, polygon_area
    from vislam2tag.site.walkable.painted_cells import corrected_cells, inside_of, refuse_other_plan

    grid = plan_grid(plan, settings)
    findings: tuple[Finding, ...] = ()
    if mask is not None:
        refuse_other_plan(mask, plan)
    green, red = corrected_cells(mask, grid)
    drawn = polygon_area(plan, settings)
    if drawn is not None:
        free = drawn.mask
    else:
        free, findings = inside_of((_walls(plan, grid, settings) & ~green) | red, grid.cell_m, settings)
    return (free | green) & ~red, grid, findings


def _walls(plan: FloorPlan, grid: CellGrid, settings: WalkableSettings) -> BoolArray:
    """Cells (rows, columns) in a plan's walls and obstacles: from its lines and polygons where it has any, else from
    its image.
    """
    if not len(plan.walls) and not plan.polygons:
        from vislam2tag.site.walkable.ink import image_walls  # takes seconds to load
        from vislam2tag.site.walkable.sheet import building_walls

        return building_walls(image_walls(plan, grid, settings), grid.cell_m, settings)
    from vislam2tag.site.walkable.drawn_cells import drawn_walls

    return drawn_walls(plan, grid)
