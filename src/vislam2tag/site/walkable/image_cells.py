"""From a plan's image to the cells that are walls."""

from __future__ import annotations

import cv2
import numpy as np
from skimage.morphology import skeletonize

from vislam2tag.core.arrays import BoolArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.site.plans.model import FloorPlan
from vislam2tag.site.walkable.ink import Bytes, ink_on_paper, reduced, walls_in
from vislam2tag.site.walkable.lettering import lettering
from vislam2tag.site.walkable.settings import WalkableSettings
from vislam2tag.site.walkable.strokes import only_walls

_BELOW_PX = 5.0
"""What lies below text is guessed from so many pixels around."""
_DIAGONAL = 0.4
"""Pixels that touch at a corner stay joined where an enlarged image has more than this."""


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
