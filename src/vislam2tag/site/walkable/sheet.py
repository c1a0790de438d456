"""What surrounds the building on a sheet: frames, title blocks and legends are not its walls."""

from __future__ import annotations

import cv2
import numpy as np

from vislam2tag.core.arrays import BoolArray, IntArray
from vislam2tag.site.plans.images import has_title_block, is_frame
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.painted_cells import inside_of, parts_of, regions

_JOINED_M = 1.0
"""Parts of a building are at most this far from each other, metres."""
_WING = 0.2
"""What is apart from the building and smaller than this share of it is a legend, a title block or a key plan."""
_BUILDING = 0.5
"""The largest region in a frame fills at least this share of the building; in an outer wall less."""


def building_walls(walls: BoolArray, cell_m: float, settings: WalkableSettings) -> BoolArray:
    """Leave of walls (rows, columns), cells of ``cell_m``, those of the building."""
    labels, boxes, _ = parts_of(walls)
    for part, (left, top, width, height, _) in enumerate(boxes.tolist()):
        box = slice(top, top + height), slice(left, left + width)
        if part and is_frame(labels[box] == part, box, walls.shape):
            within = _without_legends(walls & (labels != part), cell_m)
            if _is_building(within, cell_m, settings) and has_title_block(labels == part, box, _box(within)):
                walls = within
    return _without_legends(walls, cell_m)


def _box(walls: BoolArray) -> tuple[int, int, int, int]:
    """Left, right, upper and lower edge of walls (rows, columns)."""
    row, column = np.nonzero(walls)
    return int(column.min()), int(column.max()) + 1, int(row.min()), int(row.max()) + 1


def _is_building(walls: BoolArray, cell_m: float, settings: WalkableSettings) -> bool:
    """Whether walls (rows, columns) without the frame around them enclose a building."""
    if not walls.any():
        return False
    inside, no_outer_wall = inside_of(walls, cell_m, settings)
    if no_outer_wall:
        return False
    row, column = np.nonzero(inside | walls)
    largest = np.bincount(regions(inside).ravel())[1:].max()
    return bool(largest >= _BUILDING * np.ptp(row) * np.ptp(column))


def _without_legends(walls: BoolArray, cell_m: float) -> BoolArray:
    """Leave out of walls (rows, columns) small groups beside the largest one."""
    gap = max(1, round(_JOINED_M / cell_m))
    joined = np.asarray(cv2.dilate(walls.astype(np.uint8), np.ones((gap, gap), dtype=np.uint8))) > 0
    labels, boxes, _ = parts_of(joined)
    area = boxes[:, cv2.CC_STAT_WIDTH] * boxes[:, cv2.CC_STAT_HEIGHT]
    area[0] = 0
    main = int(area.argmax())
    beside = np.array([not _overlap(box, boxes[main]) for box in boxes]) & (area < _WING * area[main])
    beside[0] = False
    kept: BoolArray = walls & ~beside[labels]
    return kept


def _overlap(box: IntArray, other: IntArray) -> bool:
    """Whether two boxes (5,), left, top, width, height and area, overlap."""
    low, high = np.maximum(box[:2], other[:2]), np.minimum(box[:2] + box[2:4], other[:2] + other[2:4])
    return bool((low < high).all())
