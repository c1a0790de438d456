from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vislam2tag.site.walkable.ink import Bytes, ink_on_paper, lettering, walls_in

TEXT = "ROOMS AND HALLS"


def page(colour: tuple[int, int, int]) -> Bytes:
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
    image = page((120, 120, 120))
    text = text_of(image)
    assert text[80:95, 60:118].sum() > 100
    assert not text[:, 119:121].all(axis=1).any()  # the wall goes on below
    assert not text[[5, 114]].any()


def test_text_in_the_walls_colour_is_left_alone() -> None:
    assert not text_of(page((20, 40, 160))).any()


def test_a_plan_without_text_has_none() -> None:
    image = page((255, 255, 255))
    assert not text_of(image).any()
