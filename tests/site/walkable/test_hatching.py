"""Hatching in the picture of a plan."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from tests.site.walkable.hand_made import agreement, as_plan, blank, pixel, walls
from vislam2tag.core.arrays import BoolArray
from vislam2tag.site.walkable.hatching import hatching
from vislam2tag.site.walkable.space import walkable_space

PIXEL_M = 0.05
ROOM = (slice(20, 140), slice(20, 160))


def strokes(angle_deg: float, step_px: float, thickness: int = 1) -> np.ndarray:
    """Parallel strokes in a room of 6 x 7 m, as ink (rows, columns) of a page."""
    page = np.zeros((160, 180), dtype=np.uint8)
    along = np.array((np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))))
    across = np.array((-along[1], along[0]))
    for number in np.arange(-120, 120, step_px):
        middle = (90, 80) + number * across
        start, stop = (np.round(middle + side * 200 * along).astype(int).tolist() for side in (-1, 1))
        cv2.line(page, start, stop, 1, thickness)
    inside = np.zeros_like(page)
    inside[ROOM] = page[ROOM]
    return inside > 0


def room() -> BoolArray:
    ink = np.zeros((160, 180), dtype=np.uint8)
    cv2.rectangle(ink, (18, 18), (161, 141), 1, 4)
    return ink > 0


@pytest.mark.parametrize(("angle_deg", "step_px", "thickness"), [(45, 8, 1), (-30, 14, 2), (0, 10, 2), (90, 12, 1)])
def test_regular_parallel_strokes_are_hatching_and_walls_are_not(
    angle_deg: float, step_px: float, thickness: int
) -> None:
    hatched = strokes(angle_deg, step_px, thickness)
    found = hatching(hatched | room(), PIXEL_M)
    middle = slice(35, 125), slice(35, 145)
    assert found[middle][hatched[middle]].mean() > 0.9
    assert found[:16].sum() == found[:, :16].sum() == 0


def test_both_directions_of_a_grid_are_hatching() -> None:
    hatched = strokes(45, 10) | strokes(-45, 10)
    assert hatching(hatched | room(), PIXEL_M)[hatched].mean() > 0.9


def test_treads_of_stairs_and_few_or_uneven_strokes_are_not_hatching() -> None:
    ink = room()
    ink[40:120:6, 30:54] = True  # 1.2 m wide
    ink[60:62, 70:150] = ink[70:72, 70:150] = ink[85:87, 70:150] = ink[90:92, 70:150] = True
    assert not hatching(ink, PIXEL_M).any()


def test_strokes_within_a_wall_drawn_as_two_lines_are_not_hatching() -> None:
    ink = np.zeros((160, 180), dtype=np.uint8)
    cv2.rectangle(ink, (18, 18), (161, 141), 1, 1)
    cv2.rectangle(ink, (24, 24), (155, 135), 1, 1)
    inside = np.zeros_like(ink)
    inside[18:142, 18:162] = 1
    inside[24:136, 24:156] = 0
    page = np.zeros_like(ink)
    for start in range(0, 340, 5):
        cv2.line(page, (start, 0), (start - 160, 160), 1, 1)
    assert not hatching((ink | (page & inside)) > 0, PIXEL_M).any()


@pytest.mark.parametrize("crossed", [False, True])
def test_hatched_rooms_can_be_walked(crossed: bool) -> None:
    per_m = 20.0
    image, canvas = blank(per_m)
    for x in np.arange(-14.0, 24.0, 0.6).tolist():
        # the strokes cross the walls between the rooms
        lines = [((max(x, 0.0), 12.2 + max(-x, 0.0)), (min(x + 7.8, 24.0), 12.2 + min(7.8, 24.0 - x)))]
        lines += [((24.0 - a, b), (24.0 - c, d)) for (a, b), (c, d) in lines] if crossed else []
        for start, stop in lines:
            if 12.2 <= start[1] <= 20 and 12.2 <= stop[1] <= 20:
                canvas.line((*pixel(np.array(start), per_m), *pixel(np.array(stop), per_m)), fill=(40, 40, 40), width=1)
    for start, stop in walls():
        canvas.line((*pixel(start, per_m), *pixel(stop, per_m)), fill=(40, 40, 40), width=4)
    assert agreement(walkable_space(as_plan(image))) > 0.94
