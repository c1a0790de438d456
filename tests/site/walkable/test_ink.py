from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.common.errors import SurveyError
from vislam2tag.site.walkable.ink import Bytes, ink_on_paper, reduced, walls_in


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
