from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import BoolArray
from vislam2tag.site.walkable.ink import only_walls, usual_thickness
from vislam2tag.site.walkable.space import WalkableSettings

PIXEL_M = 0.02


def frame(thickness: int = 10) -> BoolArray:
    """A building of 8 x 8 m with walls ``thickness`` pixels thick."""
    ink = np.zeros((420, 420), dtype=np.bool_)
    ink[10:410, 10:410] = True
    ink[10 + thickness : 410 - thickness, 10 + thickness : 410 - thickness] = False
    return ink


def walls_of(ink: BoolArray) -> BoolArray:
    return only_walls(ink, PIXEL_M, PIXEL_M, WalkableSettings())


def test_hollow_walls_are_filled() -> None:
    ink = frame(2)
    ink[20:400, 20:400] = True
    ink[22:398, 22:398] = False
    assert not ink[15, 200]
    assert walls_of(ink)[15, 200]


def test_text_and_furniture_are_left_out_and_columns_kept() -> None:
    ink = frame()
    ink[100:160, 100:103] = ink[100:103, 100:160] = True  # an L in thin strokes
    ink[200:225, 200:225] = True  # a column of half a metre
    walls = walls_of(ink)
    assert not walls[90:170, 90:170].any()
    assert walls[212, 212]


def test_thin_strokes_are_left_out_where_walls_are_bold() -> None:
    ink = frame()
    ink[200:203, 10:410] = True  # a dimension line across the room
    walls = walls_of(ink)
    assert not walls[201, 50:370].any()
    assert walls[15, 50:370].all()


def test_walls_at_the_edge_of_the_plan_stay() -> None:
    ink = frame()[10:410, 10:410]
    ink = ink[6:-6, 6:-6]  # the outer walls are cut to 4 of 10 pixels
    ink[:, 190:200] = True
    assert walls_of(ink)[2, 50:150].all()


def test_usual_thickness_is_that_of_most_strokes() -> None:
    assert usual_thickness(frame(10), 30) in (9.0, 10.0, 11.0)
    assert usual_thickness(np.zeros((9, 9), dtype=np.bool_), 30) == 0
