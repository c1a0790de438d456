"""Hatching in the picture of a plan: regular parallel strokes across an area are fill, not walls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import cv2
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray

STROKE_M = 0.5
"""Shorter strokes, as those inside of a wall drawn as two lines, are not looked at, metres."""
AREA_M = 2.0
"""The longest stroke of hatching is at least this long, metres: treads of stairs are shorter."""
APART_M = 1.0
"""Strokes of hatching are at most this far apart, metres."""
THICK_M = 0.15
"""Strokes of hatching are at most this thick, metres."""
_LEAST_THICK_PX = 3.0
_LEAST_APART_PX = 2.5
_UNEVEN, _UNEVEN_PX = 0.15, 1.6
"""Distances of neighbouring strokes differ by at most this share, or so many pixels."""
_AMONG = 0.5
"""A stroke is among others of its kind over at least this share of its length."""
_CORNERS = 3
"""So many further strokes in corners, where there are few beside each other, follow those that are regular."""
_LEAST_SHARE, _MOST_DIRECTIONS = 0.02, 8
"""A direction of strokes has at least this share of all edges."""
_SMOOTH_PX, _AROUND_PX, _STEEP = 1.0, 2.0, 0.06
_SEEN = 80
"""Level from which on a turned pixel (0 to 255) is ink: thin lines are grey between pixels."""
_MISSING_PX = 3
_WIDENED_PX = 2
"""Lines become so much thicker by being turned."""


def hatching(ink: BoolArray, pixel_m: float) -> BoolArray:
    """Return which ink (rows, columns), pixels of ``pixel_m``, is strokes of hatching, with the seams beside them."""
    found = np.zeros(ink.shape, dtype=np.uint8)
    for angle_deg in _directions(ink):
        turn, size = _turn(ink.shape, angle_deg)
        turned = cv2.warpAffine(ink.astype(np.uint8) * 255, turn, size, flags=cv2.INTER_LINEAR)
        strokes = _regular(np.asarray(turned) > _SEEN, pixel_m)
        if strokes.any():
            back = cv2.warpAffine(
                strokes.astype(np.uint8) * 255, turn, ink.shape[::-1], flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
            )
            found |= (np.asarray(back) > _SEEN).astype(np.uint8)
    return ink & (np.asarray(cv2.dilate(found, np.ones((3, 3), dtype=np.uint8))) > 0)


def _directions(ink: BoolArray) -> list[float]:
    """Directions of most edges in ink (rows, columns), degrees from the rows, clockwise as the picture is stored."""
    grey = cv2.GaussianBlur(ink.astype(np.float32), (0, 0), _SMOOTH_PX)
    across, down = (cv2.Sobel(grey, cv2.CV_32F, *order) for order in ((1, 0), (0, 1)))
    # Structure tensor: the staircases of slanting lines have many directions.
    difference, product = (
        cv2.GaussianBlur(part, (0, 0), _AROUND_PX) for part in (across**2 - down**2, 2 * across * down)
    )
    edge = across**2 + down**2 > _STEEP * float((across**2 + down**2).max())
    angle = (np.degrees(np.arctan2(product[edge], difference[edge])) / 2 + 90) % 180
    share = np.bincount(np.round(angle).astype(int) % 180, minlength=180) / max(len(angle), 1)
    smooth = np.sum([np.roll(share, shift) for shift in range(-2, 3)], axis=0)
    peaks = [
        bin_ for bin_ in np.argsort(-smooth, kind="stable").tolist()
        if smooth[bin_] >= _LEAST_SHARE and smooth[bin_] == max(np.roll(smooth, 4 - bin_)[:9])
    ]  # fmt: skip
    around = np.arange(-2, 3)
    return [float(peak + np.average(around, weights=share[(peak + around) % 180])) for peak in peaks[:_MOST_DIRECTIONS]]


def _turn(shape: tuple[int, ...], angle_deg: float) -> tuple[FloatArray, tuple[int, int]]:
    """The map (2, 3) that turns a picture so that a direction follows the rows, and the size that it then has."""
    rows, columns = shape
    turn: FloatArray = np.array(cv2.getRotationMatrix2D((columns / 2, rows / 2), angle_deg, 1.0), dtype=np.float64)
    width, height = (np.abs(turn[:, :2]) @ (columns, rows)).tolist()
    turn[:, 2] += (width - columns) / 2, (height - rows) / 2
    return turn, (int(np.ceil(width)), int(np.ceil(height)))


def _regular(ink: BoolArray, pixel_m: float) -> BoolArray:
    """The ink (rows, columns) in strokes along the rows that are one of several, evenly apart."""
    # Strokes lean by a pixel here and there.
    thick = cv2.dilate(ink.astype(np.uint8), np.ones((2, 1), dtype=np.uint8))
    whole = cv2.morphologyEx(thick, cv2.MORPH_CLOSE, np.ones((1, _MISSING_PX), dtype=np.uint8))
    along = np.ones((1, max(_MISSING_PX + 1, round(STROKE_M / pixel_m))), dtype=np.uint8)
    strokes = np.asarray(cv2.morphologyEx(whole, cv2.MORPH_OPEN, along)) > 0
    column, start, stop = _runs_down(strokes)
    thin = stop - start <= max(THICK_M / pixel_m, _LEAST_THICK_PX) + _WIDENED_PX
    column, start, stop = column[thin], start[thin], stop[thin]
    lines = np.zeros(strokes.shape, dtype=np.uint8)
    if len(column) < 4:
        return np.zeros_like(strokes)
    middle = (start + stop) // 2
    lines[middle, column] = 1
    lines = np.asarray(cv2.dilate(lines, np.ones((3, 3), dtype=np.uint8)))
    _, labels = cv2.connectedComponents(lines, connectivity=8, ltype=cv2.CV_32S)
    stroke = np.asarray(labels)[middle, column]
    steps = _Steps.of(column, (start + stop) / 2, APART_M / pixel_m)
    hatched = _hatched(stroke, middle, steps, AREA_M / pixel_m)
    return strokes & _filled_down(hatched[stroke], column, start, stop, strokes.shape)


def _runs_down(mask: BoolArray) -> tuple[IntArray, IntArray, IntArray]:
    """Column, first row and row behind the last (n,) of each run down the columns of a mask, by column."""
    steps = np.diff(np.pad(mask.T, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    column, start = np.nonzero(steps == 1)
    return column, start, np.nonzero(steps == -1)[1]


@dataclass(frozen=True)
class _Steps:
    """Steps (n - 1,) from each run to the next one."""

    gap: FloatArray
    """Distance of their middles, pixels; infinite to another column or a stroke further off."""
    even: BoolArray
    """Whether it is among three that are as long as each other."""

    @classmethod
    def of(cls, column: IntArray, middle: FloatArray, most_px: float) -> Self:
        gap = np.diff(middle)
        usable = (np.diff(column) == 0) & (gap >= _LEAST_APART_PX) & (gap <= most_px)
        gap = np.where(usable, gap, np.inf)
        alike = np.zeros(len(gap) + 1, dtype=np.bool_)  # a step and the one before it
        both = usable[:-1] & usable[1:]
        alike[1:-1][both] = _alike(gap[:-1][both], gap[1:][both])
        middles = alike[:-1] & alike[1:]
        even = middles.copy()
        even[:-1] |= middles[1:]
        even[1:] |= middles[:-1]
        return cls(gap, even)


def _alike(gap: FloatArray, other: FloatArray) -> BoolArray:
    """Whether gaps (n,) are as wide as others (n,)."""
    return np.asarray(np.abs(gap - other) <= np.maximum(_UNEVEN * other, _UNEVEN_PX))


def _hatched(stroke: IntArray, middle: IntArray, steps: _Steps, longest_px: float) -> BoolArray:
    """Which strokes (s,) are hatching, by ``stroke`` and ``middle`` row (n,) of each run."""
    one, next_one, length = stroke[:-1], stroke[1:], np.bincount(stroke)
    count = len(length)
    mostly = _mostly(stroke, steps.even, steps.even, length)
    joined = steps.even & mostly[one] & mostly[next_one]
    links = coo_array((joined[joined].astype(np.int64), (one[joined], next_one[joined])), shape=(count, count))
    areas, area = connected_components(links, directed=False)
    longest, high, low = np.zeros(areas), np.zeros(areas), np.full(areas, np.inf)
    np.maximum.at(longest, area[mostly], length[mostly])
    np.maximum.at(high, area[stroke], middle)
    np.minimum.at(low, area[stroke], middle)
    hatched: BoolArray = mostly & ((longest >= longest_px) & (high - low >= longest_px / 2))[area]
    usual = np.bincount(area[one[joined]], steps.gap[joined], areas) / np.bincount(
        area[one[joined]], minlength=areas
    ).clip(1)
    for _ in range(_CORNERS):
        after = hatched[one] & _alike(steps.gap, usual[area[one]])
        before = hatched[next_one] & _alike(steps.gap, usual[area[next_one]])
        more = _mostly(stroke, before, after, length) & ~hatched
        new_after, new_before = after & more[next_one], before & more[one]
        area[next_one[new_after]] = area[one[new_after]]
        area[one[new_before]] = area[next_one[new_before]]
        hatched |= more
    return hatched


def _mostly(stroke: IntArray, before: BoolArray, after: BoolArray, length: IntArray) -> BoolArray:
    """Which strokes, of some length (s,), mostly have runs (n,) that some steps (n - 1,) begin at or lead to."""
    among = np.append(before, False) | np.insert(after, 0, False)
    return np.asarray(np.bincount(stroke[among], minlength=len(length)) >= _AMONG * np.maximum(length, 1))


def _filled_down(
    chosen: BoolArray, column: IntArray, start: IntArray, stop: IntArray, shape: tuple[int, ...]
) -> BoolArray:
    """Mask (rows, columns) of the chosen (n,) runs."""
    steps = np.zeros((shape[0] + 1, shape[1]), dtype=np.int8)
    steps[start[chosen], column[chosen]] += 1
    steps[stop[chosen], column[chosen]] -= 1
    return np.asarray(np.cumsum(steps, axis=0, dtype=np.int8)[:-1] > 0)
