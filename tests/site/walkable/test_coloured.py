"""Coloured lines beside walls are not walls, in a plan drawn in a colour the walls are, and doubts are reported."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from io import BytesIO

import numpy as np
import pytest
from PIL import Image, ImageDraw

from tests.site.walkable.hand_made import MARGIN_M, agreement, pixel, plan, walls
from vislam2tag.site.plans.source import FloorPlan
from vislam2tag.site.plans.taken_parts import Became
from vislam2tag.site.walkable.space import walkable_space
from vislam2tag.site.walkable.taken import picture_parts

Colour = tuple[int, int, int]
BLACK, BLUE, RED = (40, 40, 40), (20, 60, 170), (220, 20, 20)
ROUTES = [((0.5, 11.1), (23.5, 11.1)), *(((x, 11.1), (x, 18.0)) for x in (4.0, 12.0, 20.0)), ((12, 11.1), (12, 1))]
PER_M = 20.0


def with_lines(
    on: FloorPlan,
    lines: Sequence[tuple[tuple[float, float], tuple[float, float]]],
    colour: Colour,
    width: int = 3,
    *,
    jpeg: bool = False,
) -> FloorPlan:
    image = Image.fromarray(on.image)
    for start, stop in lines:
        ends = (*pixel(np.array(start), PER_M), *pixel(np.array(stop), PER_M))
        ImageDraw.Draw(image).line(ends, fill=colour, width=width)
    if jpeg:
        image.save(file := BytesIO(), "JPEG", quality=70)
        image = Image.open(file).convert("RGB")
    return replace(on, image=np.asarray(image))


@pytest.mark.parametrize(
    ("ink", "paper", "route", "jpeg"),
    [
        (BLACK, (255, 255, 255), RED, True),
        ((120, 120, 120), (255, 255, 255), (0, 110, 40), False),
        (BLUE, (255, 255, 255), RED, False),
    ],
)
def test_an_escape_route_is_not_a_wall(ink: Colour, paper: Colour, route: Colour, jpeg: bool) -> None:
    found = with_lines(plan(PER_M, ink, paper), ROUTES, route, jpeg=jpeg)
    space = walkable_space(found)
    assert agreement(space) > 0.95
    taken, notes = picture_parts(found, space)
    assert {part.became for part in taken} == {Became.LEFT_OUT}
    assert "% of the picture" in taken[0].why
    assert notes == ()


def test_walls_that_a_line_crosses_go_on_below() -> None:
    found = with_lines(plan(PER_M), [((1.0, 16.0), (23.0, 16.0))], (250, 200, 0), 5)
    space = walkable_space(found)
    assert not space.inside(np.array([(8.0, 16.0), (16.0, 16.0)])).any()
    assert agreement(space) > 0.95


def test_a_blueprint_keeps_its_walls_and_leaves_nothing_out() -> None:
    found = plan(PER_M, BLUE)
    space = walkable_space(found)
    assert agreement(space) > 0.95
    assert picture_parts(found, space) == ((), ())


def test_as_many_coloured_lines_as_black_ones_are_walls_with_a_note() -> None:
    coloured = [line for line in walls().tolist() if max(line[0][1], line[1][1]) > 12.3]
    found = with_lines(plan(PER_M), coloured, RED, 4)
    space = walkable_space(found)
    _, (note,) = picture_parts(found, space)
    assert "red lines" in note
    assert "count as walls" in note
    assert agreement(space) > 0.95


def test_coloured_pieces_between_walls_may_be_walls() -> None:
    found = with_lines(plan(PER_M), [((8.0, 12.2), (8.0, 20.0))], RED, 4)
    (part,), (note,) = picture_parts(found, walkable_space(found))
    assert part.name == "red lines"
    assert "close off no room" in note


def test_thin_walls_in_large_pixels_are_reported() -> None:
    fine = Image.fromarray(plan(PER_M, thickness_m=0.05).image)
    coarse = replace(plan(PER_M), image=np.asarray(fine.resize((fine.width // 2, fine.height // 2))))
    (_, (note,)) = picture_parts(coarse, walkable_space(coarse))
    assert "about 1 pixel wide at 0.10 m a pixel" in note
    assert f"at least {round((24 + 2 * MARGIN_M) / 0.04)} pixels" in note
    bold = plan(10.0)
    assert picture_parts(bold, walkable_space(bold)) == ((), ())
