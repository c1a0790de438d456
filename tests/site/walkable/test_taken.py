"""Checks of what was taken of a plan, and its picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.site.walkable.hand_made import HEIGHT_M, MARGIN_M, WIDTH_M, walls
from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.plans.source import FloorPlan, PlanText
from vislam2tag.site.walkable.space import walkable_space
from vislam2tag.site.walkable.taken import DOOR, LEFT_OUT, WALKABLE, WALL, PlanChecks, plan_checks, taken_picture

ROOMS = tuple(PlanText(f"1.0{number}", (4.0 + 8 * number, 16.0)) for number in range(3))
EXTENT = (-MARGIN_M, WIDTH_M + MARGIN_M, -MARGIN_M, HEIGHT_M + MARGIN_M)


def drawn(lines: FloatArray, texts: tuple[PlanText, ...] = ROOMS) -> FloorPlan:
    return FloorPlan(EXTENT, np.zeros((2, 2, 3), dtype=np.uint8), walls=lines, texts=texts)


def checks(plan: FloorPlan) -> PlanChecks:
    return plan_checks(plan, walkable_space(plan), ("layers", "doors", "ignore"))


def test_a_good_plan_has_nothing_to_check() -> None:
    beside = PlanText("9.99", (WIDTH_M + 0.9, 1.0))
    found = checks(drawn(walls(), (*ROOMS, beside)))
    assert found.walkable_share > 0.9
    assert (found.rooms, found.labels, found.sentences) == (4, 3, ())


def test_closed_doors_are_named_with_their_rooms() -> None:
    found = checks(drawn(walls(doors=False)))
    (sentence,) = found.sentences
    assert "closed off, such as 1.00, 1.01, 1.02: doors" in sentence
    assert "--doors" in sentence


def test_little_is_walkable_where_other_lines_are_walls() -> None:
    lines = [((0.2, y), (23.8, y)) for y in (*np.arange(0.4, 9.8, 0.4), *np.arange(12.6, 19.8, 0.4))]
    (sentence,) = checks(drawn(np.vstack((walls(), np.array(lines))), ())).sentences
    assert "other lines count as walls" in sentence
    assert "--ignore" in sentence


def test_fewer_rooms_than_labels_are_a_sign_of_missing_walls() -> None:
    texts = tuple(PlanText(f"1.{number:02d}", (2.0 + 2 * number, 5.0)) for number in range(9))
    found = checks(drawn(walls()[:4], texts))
    assert found.sentences == (
        "the plan has 9 room labels, but only 1 room: walls may be missing; check layers with --walls",
    )


@pytest.mark.parametrize("closed", [False, True])
def test_the_picture_shows_floor_walls_doors_and_what_is_left_out(closed: bool) -> None:
    plan = drawn(walls(doors=not closed))
    plan = replace(plan, doors=np.array([((4.0, 12.2), (4.0, 13.2))]))
    image = np.asarray(taken_picture(plan, walkable_space(plan)))

    def at(x: float, y: float) -> tuple[int, ...]:
        return tuple(image[round((HEIGHT_M + MARGIN_M - y) * 20), round((x + MARGIN_M) * 20)].tolist())

    assert at(12.0, 11.0) == WALKABLE
    assert at(4.0, 16.0) == (LEFT_OUT if closed else WALKABLE)
    assert at(8.0, 16.0) == at(-0.1, 5.0) == WALL
    assert at(4.0, 12.8) == DOOR
    assert at(-0.9, 5.0) == LEFT_OUT
