from __future__ import annotations

import cv2
import numpy as np
import pytest
from PIL import Image, ImageDraw, ImageFont

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import BoolArray
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.door_swings import without_swings
from vislam2tag.site.walkable.ink import (
    Bytes,
    ink_on_paper,
    lettering,
    only_walls,
    reduced,
    usual_thickness,
    walls_in,
    without_areas,
)


def image_of(lightness: Bytes) -> Bytes:
    return np.repeat(lightness[..., None], 3, axis=2)


def page(paper: int = 255) -> Bytes:
    return np.full((100, 120), paper, dtype=np.uint8)


def test_white_lines_on_black_are_ink_as_well() -> None:
    black_on_white = page()
    black_on_white[40:44] = 0
    white_on_black = 255 - black_on_white
    assert (ink_on_paper(image_of(black_on_white)) == ink_on_paper(image_of(white_on_black))).all()


def test_fills_are_floor_and_dark_lines_walls() -> None:
    light = page()
    light[:, 60:] = 170  # a room's colour
    light[40:44] = 0
    walls = walls_in(ink_on_paper(image_of(light)), None, 8)
    assert walls[40:44].all()
    assert not walls[:40].any()


def test_vivid_areas_are_floor_however_dark_and_vivid_lines_are_not() -> None:
    image = np.full((100, 120, 3), 255, dtype=np.uint8)
    image[30:70, 10:60] = (60, 20, 140)
    image[30:70, 60:110] = (20, 20, 20)
    image[:, 118:] = (200, 30, 30)
    ink = ink_on_paper(image)
    left = without_areas(image, ink, 20)
    assert not left[5:95, 5:60].any()
    assert (left[:, 60:] == ink[:, 60:]).all()


def test_faint_lines_beside_strong_ones_are_walls_as_well() -> None:
    light = page()
    light[20:24] = 0
    light[60:62] = 150
    light[80:82] = 155
    walls = walls_in(ink_on_paper(image_of(light)), None, 8)
    assert walls[[21, 60, 80]].all()
    assert walls.sum() == 8 * 120


def test_a_low_contrast_makes_fills_walls() -> None:
    light = page()
    light[:, 80:] = 230
    light[40:44] = 0
    ink = ink_on_paper(image_of(light))
    assert not walls_in(ink, None, 8)[10, 100]
    assert walls_in(ink, 0.08, 8)[10, 100]


@pytest.mark.parametrize("contrast", [None, 0.3])
def test_paper_without_ink_is_told(contrast: float | None) -> None:
    with pytest.raises(SurveyError, match="no walls"):
        walls_in(ink_on_paper(image_of(page(7))), contrast, 8)


def test_thin_lines_outlast_being_reduced() -> None:
    ink = np.zeros((200, 200), dtype=np.uint8)
    ink[101] = 200
    assert (reduced(ink, (40, 40)).max(axis=0) == 200).all()


TEXT = "ROOMS AND HALLS"


def lettered_page(colour: tuple[int, int, int]) -> Bytes:
    """Walls in blue, three lines of text, one of them over a wall."""
    image = Image.new("RGB", (240, 120), "white")
    canvas = ImageDraw.Draw(image)
    canvas.rectangle((5, 5, 234, 114), outline=(20, 40, 160), width=2)
    canvas.line((120, 5, 120, 114), fill=(20, 40, 160), width=2)
    font = ImageFont.load_default(size=12)
    for x, y in ((12, 20), (130, 20), (60, 80)):
        canvas.text((x, y), TEXT, fill=colour, font=font)
    return np.asarray(image)


def text_of(image: Bytes) -> np.ndarray:
    ink = ink_on_paper(image)
    return lettering(image, ink, walls_in(ink, None, 6), 16)


def test_text_of_its_own_colour_is_told_from_the_wall_it_crosses() -> None:
    image = lettered_page((120, 120, 120))
    text = text_of(image)
    assert text[80:95, 60:118].sum() > 100
    assert not text[:, 119:121].all(axis=1).any()  # the wall goes on below
    assert not text[[5, 114]].any()


def test_text_in_the_walls_colour_is_left_alone() -> None:
    assert not text_of(lettered_page((20, 40, 160))).any()


def test_a_plan_without_text_has_none() -> None:
    image = lettered_page((255, 255, 255))
    assert not text_of(image).any()


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


def test_pieces_of_a_faded_wall_stay() -> None:
    ink = frame(3)
    ink[200:203, 10:410] = True  # a wall across the room
    for start in (100, 180, 250):
        ink[200:203, start : start + 30] = False
    walls = walls_of(ink)
    assert walls[201, [50, 150, 240, 300]].all()
    assert not walls[201, [115, 195, 265]].any()


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


RADII = (10.0, 28.0)


def door(radius: int, *, swing: bool = True, leaf: bool = True, thickness: int = 1) -> BoolArray:
    """A wall along row 80 with a door in it, hinged on its left, that opens to smaller rows."""
    ink = np.zeros((120, 160), dtype=np.uint8)
    cv2.line(ink, (0, 80), (60, 80), 1, thickness)
    cv2.line(ink, (60 + radius, 80), (159, 80), 1, thickness)
    if leaf:
        cv2.line(ink, (60, 80), (60, 80 - radius), 1, 1)
    if swing:
        cv2.ellipse(ink, (60, 80), (radius, radius), 0, -90, 0, 1, 1)
    return ink > 0


@pytest.mark.parametrize("radius", [13, 18, 25])
@pytest.mark.parametrize("thickness", [1, 3])
def test_a_door_is_open(radius: int, thickness: int) -> None:
    walls = without_swings(door(radius, thickness=thickness), RADII)
    assert not walls[: 80 - radius // 2, 62:].any()  # the swing
    assert not walls[80, 66 : 58 + radius].any()  # the gap
    assert walls[80, :55].all()
    assert walls[80, 64 + radius :].all()


def test_a_drawn_sill_is_open_as_well() -> None:
    ink = door(20)
    ink[80] = True
    walls = without_swings(ink, RADII)
    assert not walls[80, 66:76].any()
    assert walls[80, :55].all()


def test_a_leaf_alone_stays() -> None:
    ink = door(20, swing=False)
    assert (without_swings(ink, RADII) == ink).all()


def test_a_rounded_corner_is_no_swing() -> None:
    ink = np.zeros((120, 160), dtype=np.uint8)
    cv2.line(ink, (0, 40), (60, 40), 1, 1)
    cv2.ellipse(ink, (60, 60), (20, 20), 0, -90, 0, 1, 1)
    cv2.line(ink, (80, 60), (80, 119), 1, 1)
    assert (without_swings(ink > 0, RADII) == (ink > 0)).all()
