"""Frames, title blocks and legends around a building."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from vislam2tag.core.arrays import BoolArray
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.sheet import building_walls

SETTINGS = WalkableSettings()
Box = tuple[int, int, int, int]


def sheet(*boxes: Box) -> BoolArray:
    """Rectangles (left, top, right, lower) in cells of 10 cm on a sheet of 40 x 30 m."""
    image = Image.new("L", (400, 300))
    for box in boxes:
        ImageDraw.Draw(image).rectangle(box, outline=1, width=2)
    return np.asarray(image) > 0


def walls_of(walls: BoolArray) -> BoolArray:
    return building_walls(walls, 0.1, SETTINGS)


BUILDING = (60, 40, 260, 160)
FRAME, TITLE = (5, 5, 394, 294), (250, 250, 394, 294)


def test_a_frame_with_its_title_block_is_left_out() -> None:
    assert (walls_of(sheet(BUILDING, FRAME, TITLE)) == sheet(BUILDING)).all()


def test_legends_beside_the_building_are_left_out_and_wings_stay() -> None:
    legend, wing = (300, 40, 380, 80), (300, 120, 380, 280)
    assert (walls_of(sheet(BUILDING, legend, wing)) == sheet(BUILDING, wing)).all()


def test_an_outer_wall_around_small_rooms_is_not_a_frame() -> None:
    rooms = [(left, 60, left + 70, 240) for left in (60, 130, 200, 270)]
    walls = sheet((5, 5, 394, 294), *rooms)
    assert (walls_of(walls) == walls).all()


def test_an_outer_wall_around_a_ring_of_corridors_is_not_a_frame() -> None:
    walls = sheet((5, 5, 394, 294), (30, 30, 369, 269))
    assert (walls_of(walls) == walls).all()


def test_columns_within_the_building_stay() -> None:
    walls = sheet(BUILDING, (150, 90, 156, 96))
    assert (walls_of(walls) == walls).all()
    assert not walls_of(np.zeros_like(walls)).any()
