"""Which ink is a wall: hollow walls are filled, symbols, text and thin strokes are left out."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from skimage.morphology import skeletonize

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.site.walkable.door_swings import without_swings
from vislam2tag.site.walkable.settings import WalkableSettings

_THICKEST_M = 0.6
"""What is thicker is no wall but a solid area, metres."""
_BOLD = 0.7
"""Strokes of at least this share of the walls' thickness are as bold as walls."""
_FULL = 0.75
"""A column or a piece of wall fills at least this share of the rectangle around it; letters and outlines do not."""
_LEAST_CIRCLE_PX = 6.0
_LEAST_BOLD_PX = 4.0
"""Where walls are thinner, in pixels, their thickness tells nothing."""


def only_walls(ink: BoolArray, pixel_m: float, drawn_m: float, settings: WalkableSettings) -> BoolArray:
    """Leave of the ink (rows, columns) on a plan, pixels of ``pixel_m``, what nobody walks through.

    ``drawn_m`` is the pixel in which the plan was drawn, larger where ``ink`` is an enlargement.
    """
    thickest_px = _THICKEST_M / pixel_m
    walls = _without_symbols(ink, usual_thickness(ink, thickest_px), settings.symbol_m / pixel_m)
    walls = _filled(walls, settings.passage_m / pixel_m)
    thickness = usual_thickness(walls, thickest_px)
    if thickness >= _LEAST_BOLD_PX:
        walls = _without_thin(walls, thickness * settings.stroke_share)
    # Circles of a few pixels cannot be told from corners.
    least_m, most_m = max(settings.swing_m[0], _LEAST_CIRCLE_PX * drawn_m), settings.swing_m[1]
    return without_swings(walls, (least_m / pixel_m, most_m / pixel_m)) if least_m < most_m else walls


def clearance_px(free: BoolArray) -> FloatArray:
    """Distance (rows, columns) of each free pixel's centre to the nearest other one's, in pixels."""
    return np.asarray(cv2.distanceTransform(free.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE))


def usual_thickness(walls: BoolArray, thickest_px: float) -> float:
    """Median thickness of all strokes (rows, columns) but solid areas, weighted by their length, in pixels; 0 where
    there are none.
    """
    thickness = 2 * clearance_px(walls)[skeletonize(walls)] - 1
    thickness = thickness[thickness <= thickest_px]
    return float(np.median(thickness)) if len(thickness) else 0.0


def _filled(ink: BoolArray, passage_px: float) -> BoolArray:
    """Fill what is closed off and too narrow for anybody (rows, columns): the inside of walls drawn as two lines,
    treads of stairs.
    """
    free = np.pad(~ink, 1, constant_values=True)
    _, labels = cv2.connectedComponents(free.astype(np.uint8), connectivity=4, ltype=cv2.CV_32S)
    widest = np.zeros(int(labels.max()) + 1, dtype=np.float32)
    np.maximum.at(widest, np.asarray(labels, dtype=np.intp).ravel(), clearance_px(free).ravel())
    narrow: BoolArray = 2 * widest - 1 < passage_px
    narrow[0] = True
    filled: BoolArray = narrow[labels][1:-1, 1:-1]
    return filled


def _without_symbols(walls: BoolArray, thickness_px: float, symbol_px: float) -> BoolArray:
    """Leave out of walls (rows, columns) small ink that touches nothing else, but for columns and pieces of wall."""
    count, numbers, stats, _ = cv2.connectedComponentsWithStats(walls.astype(np.uint8), connectivity=8)
    labels, boxes = np.asarray(numbers, dtype=np.int32), np.asarray(stats, dtype=np.int64)
    sides = boxes[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(axis=1)
    small = np.flatnonzero(sides < symbol_px)
    left_out = np.zeros(count, dtype=np.bool_)
    left_out[[part for part in small.tolist() if part and not _solid(labels, boxes[part], part, thickness_px)]] = True
    kept: BoolArray = walls & ~left_out[labels]
    return kept


def _solid(labels: npt.NDArray[np.int32], box: IntArray, part: int, thickness_px: float) -> bool:
    """Whether a part of the ink, by ``labels`` (rows, columns), is a full rectangle or disc, as bold as the walls;
    ``box`` (5,) of it in pixels.
    """
    left, top, width, height, area = box.tolist()
    own = labels[top : top + height, left : left + width] == part
    bold = 2 * clearance_px(np.pad(own, 1)).max() - 1
    if bold < max(_BOLD * thickness_px, _LEAST_BOLD_PX):
        return False
    corners = np.argwhere(own)[:, ::-1].astype(np.float32)
    (_, (long, short), _) = cv2.minAreaRect(corners)
    return bool(area >= _FULL * (long + 1) * (short + 1))


def _without_thin(walls: BoolArray, thickness_px: float) -> BoolArray:
    """Leave out strokes (rows, columns) thinner than this; what is thicker keeps its ends and corners."""
    core = clearance_px(walls) >= (thickness_px + 1) / 2
    reach = clearance_px(~core)
    return walls & (reach <= thickness_px)
