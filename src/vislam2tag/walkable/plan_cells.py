"""From what a plan holds - an image, polygons or lines - to the cells that are walls or floor."""

from __future__ import annotations

import cv2
import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry
from skimage.morphology import skeletonize

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.survey.plans.model import FloorPlan, PlanPolygon, Use
from vislam2tag.walkable.ink import Bytes, ink_on_paper, reduced, walls_in
from vislam2tag.walkable.lettering import lettering
from vislam2tag.walkable.settings import WalkableSettings
from vislam2tag.walkable.strokes import only_walls

_HOLDS_CELLS = 1.05
_BELOW_PX = 5.0
"""What lies below text is guessed from so many pixels around."""
_DIAGONAL = 0.4
"""Pixels that touch at a corner stay joined where an enlarged image has more than this."""
_LAP_M = 0.02
"""Openings reach this far over the walls that they open, metres."""


def plan_grid(plan: FloorPlan, settings: WalkableSettings) -> CellGrid:
    """Lay cells over a plan's extent."""
    left, right, low, high = plan.extent_m
    width, height = right - left, high - low
    cell_m = max(settings.cell_m, float(np.sqrt(width * height / settings.max_cells)))
    return CellGrid((left, low), cell_m, max(1, round(height / cell_m)), max(1, round(width / cell_m)))


def image_walls(plan: FloorPlan, grid: CellGrid, settings: WalkableSettings) -> BoolArray:
    """Tell which cells (rows, columns) the plan's image shows as walls; raises SurveyError where it shows none."""
    left, right, low, high = plan.extent_m
    width, height = right - left, high - low
    finest = float(np.sqrt(width * height / settings.max_pixels))
    pixel_m = min(max(finest, *plan.pixel_m), grid.cell_m)
    shape = max(1, round(height / pixel_m)), max(1, round(width / pixel_m))
    walls = only_walls(_drawn(plan, shape, settings), pixel_m, max(plan.pixel_m), settings)
    share = cv2.resize(walls.astype(np.float32), grid.shape[::-1], interpolation=cv2.INTER_AREA)
    cells = np.asarray(share >= 0.5)
    # Walls thinner than a cell are kept, and none has a gap that is not drawn.
    row, column = np.nonzero(skeletonize(walls))
    cells[row * grid.rows // shape[0], column * grid.columns // shape[1]] = True
    return cells


def _drawn(plan: FloorPlan, shape: tuple[int, int], settings: WalkableSettings) -> BoolArray:
    """What stands out on the plan's image, without text of its own colour, as ``shape`` (rows, columns) pixels."""
    image: Bytes = plan.image[::-1]
    ink = ink_on_paper(image)
    if ink.size > shape[0] * shape[1]:
        ink = reduced(ink, shape)
        return walls_in(ink, settings.wall_contrast, settings.passage_m / max(plan.pixel_m))
    line_px = settings.passage_m / max(plan.pixel_m)
    text = lettering(image, ink, walls_in(ink, None, line_px), settings.symbol_m / max(plan.pixel_m))
    below = np.asarray(cv2.inpaint(ink, text.astype(np.uint8), _BELOW_PX, cv2.INPAINT_NS), dtype=np.uint8)
    drawn = walls_in(below, settings.wall_contrast, line_px)
    return np.asarray(cv2.resize(drawn.astype(np.float32), shape[::-1], interpolation=cv2.INTER_LINEAR) > _DIAGONAL)


def line_walls(walls: FloatArray, grid: CellGrid, thickness_m: float) -> BoolArray:
    """Tell which cells lie in walls given as segments (w, 2, 2); none is thinner than a cell, so that all hold."""
    half_m = max(thickness_m, _HOLDS_CELLS * grid.cell_m) / 2
    return cells_in(shapely.union_all(shapely.buffer(shapely.linestrings(walls), half_m, cap_style="square")), grid)


def polygon_floor(polygons: tuple[PlanPolygon, ...], grid: CellGrid, settings: WalkableSettings) -> BoolArray:
    """Tell which cells (rows, columns) polygons make walkable.

    Walkable polygons less obstacles, or the outline less obstacles where none is walkable. Where the plan has openings,
    walkable polygons are walled off from each other but for their openings; one without any opening joins its
    neighbours.
    """
    by_use = {use: [_shape(polygon) for polygon in polygons if polygon.use is use] for use in Use}
    lap_m = settings.wall_m / 2 + _LAP_M
    openings = shapely.union_all([shapely.buffer(shape, lap_m, join_style="mitre") for shape in by_use[Use.OPENING]])
    floors = by_use[Use.WALKABLE] or by_use[Use.OUTLINE]
    if by_use[Use.OPENING]:
        floors = [_walled(shape, openings, settings.wall_m / 2) for shape in floors]
    floor = shapely.union_all([*floors, *([openings] if by_use[Use.WALKABLE] else [])])
    return cells_in(shapely.difference(floor, shapely.union_all(by_use[Use.OBSTACLE])), grid)


def use_cells(polygons: tuple[PlanPolygon, ...], use: Use, grid: CellGrid) -> BoolArray:
    """Tell which cells (rows, columns) lie in a plan's polygons of this use."""
    return cells_in(shapely.union_all([_shape(polygon) for polygon in polygons if polygon.use is use]), grid)


def _shape(polygon: PlanPolygon) -> BaseGeometry:
    return shapely.make_valid(shapely.Polygon(polygon.outline, polygon.holes))


def _walled(shape: BaseGeometry, openings: BaseGeometry, wall_m: float) -> BaseGeometry:
    return shapely.buffer(shape, -wall_m, join_style="mitre") if shapely.intersects(shape, openings) else shape


def cells_in(shape: BaseGeometry, grid: CellGrid) -> BoolArray:
    """Tell which cells (rows, columns) have their centre in polygons: an odd number of edges lies to the left of it."""
    rings = [
        shapely.get_coordinates(ring)
        for part in shapely.get_parts(shape)
        if part.geom_type == "Polygon"
        for ring in (part.exterior, *part.interiors)
    ]
    if not rings:
        return np.zeros(grid.shape, dtype=np.bool_)
    placed = [(ring - grid.origin_m) / grid.cell_m - 0.5 for ring in rings]
    start = np.concatenate([ring[:-1] for ring in placed])
    stop = np.concatenate([ring[1:] for ring in placed])
    low, high = (np.ceil(pick(start[:, 1], stop[:, 1])).clip(0, grid.rows) for pick in (np.minimum, np.maximum))
    spans = (high - low).astype(np.int64)
    edge = np.repeat(np.arange(len(start)), spans)
    row = low[edge].astype(np.int64) + np.arange(len(edge)) - np.repeat(np.cumsum(spans) - spans, spans)
    slope = (stop - start)[edge]
    crossing = start[edge, 0] + (row - start[edge, 1]) / slope[:, 1] * slope[:, 0]
    column = np.ceil(crossing).clip(0, grid.columns).astype(np.int64)
    crossed = np.bincount(row * (grid.columns + 1) + column, minlength=grid.rows * (grid.columns + 1))
    odd = np.cumsum(crossed.reshape(grid.rows, -1), axis=1) % 2 == 1
    return np.asarray(odd[:, :-1])
