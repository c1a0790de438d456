from __future__ import annotations

import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from tests.site.walkable.hand_made import (
    CORRIDOR,
    HEIGHT_M,
    WIDTH_M,
    agreement,
    as_plan,
    blank,
    pixel,
    plan,
    rectangles,
    space_of,
    walls,
)
from vislam2tag.common.errors import SurveyError
from vislam2tag.site.plans.source import FloorPlan, PlanPolygon, Use
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.space import free_cells, walkable_space

MIDDLE = np.array([12.0, sum(CORRIDOR) / 2])
ASIDE = np.array((2, 0))


def box(x0: float, y0: float, x1: float, y1: float, use: Use) -> PlanPolygon:
    return PlanPolygon(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)]), (), use)


def vector_plan(*polygons: PlanPolygon, lines: np.ndarray | None = None) -> FloorPlan:
    image = np.full((22, 26, 3), 255, dtype=np.uint8)
    return FloorPlan((-1, 25, -1, 21), image, polygons, np.empty((0, 2, 2)) if lines is None else lines)


@pytest.mark.parametrize("per_m", [10.0, 20.0, 50.0])
def test_floor_is_found_at_any_resolution(per_m: float) -> None:
    space = walkable_space(plan(per_m))
    assert agreement(space) > 0.96
    assert not space.findings


@pytest.mark.parametrize(
    ("ink", "paper"),
    [((150, 150, 150), (235, 235, 235)), ((200, 30, 30), (255, 250, 220)), ((255, 255, 255), (0, 0, 60))],
)
def test_floor_is_found_in_any_colours(ink: tuple[int, int, int], paper: tuple[int, int, int]) -> None:
    assert agreement(walkable_space(plan(20, ink, paper))) > 0.96


def test_compression_does_no_harm() -> None:
    buffer = io.BytesIO()
    Image.fromarray(plan(20).image).save(buffer, "JPEG", quality=30)
    assert agreement(walkable_space(as_plan(Image.open(buffer)))) > 0.96


def test_walls_of_one_pixel_hold() -> None:
    space = walkable_space(plan(20, thickness_m=0.05))
    assert 0.93 < agreement(space) < 0.99  # the true walls are thicker
    assert not space.clear_line(np.array([7.0, 16.0]), np.array([9.0, 16.0]))[0]


def test_free_space_is_on_the_left_of_walls() -> None:
    space = walkable_space(plan())
    leg = np.diff(space.walls, axis=1)[:, 0]
    length = np.linalg.norm(leg, axis=1, keepdims=True)
    left = np.column_stack((-leg[:, 1], leg[:, 0])) / length
    long = length[:, 0] > 1
    assert space.inside(space.walls.mean(axis=1) + 0.2 * left)[long].all()
    assert not space.inside(space.walls.mean(axis=1) - 0.1 * left)[long].any()


def test_lines_of_sight() -> None:
    space = walkable_space(plan())
    above = MIDDLE + np.array((0, 4))
    assert space.clear_line(MIDDLE, above)[0]  # through the door
    assert space.clear_line(MIDDLE, np.array([(2.0, 11.0), (22.0, 11.5)])).all()
    assert not space.clear_line(MIDDLE + ASIDE, above + ASIDE)[0]
    sheet = np.array([6.5, CORRIDOR[1] - 0.1])
    assert space.clear_line(MIDDLE, sheet)[0]  # a sheet hangs on a wall
    assert not space.clear_line(np.array([6.0, 16.0]), sheet)[0]  # ... on its other side


def test_clearance_is_the_distance_to_the_wall() -> None:
    space = rectangles(10, 10, (1, 1, 9, 4))
    assert space.clearance_at(np.array([(5.05, 2.55), (1.25, 2.5), (0.5, 0.5), (99.0, 2.0)])) == pytest.approx(
        [1.45, 0.2, 0.0, 0.0], abs=0.06
    )


def test_image_of_one_colour_is_told() -> None:
    black = FloorPlan((0, 20, 0, 10), np.zeros((100, 200, 3), dtype=np.uint8))
    with pytest.raises(SurveyError, match="shows no walls"):
        walkable_space(black)


def test_room_that_walls_close_off_is_named() -> None:
    closed = plan(lines=np.vstack((walls(), [((11.0, CORRIDOR[1]), (13.0, CORRIDOR[1]))])))
    (finding,) = walkable_space(closed).findings
    assert finding.kind == "closed_off"
    assert finding.count == 1
    x, y = (float(text) for text in finding.message.split("at (")[1].split(")")[0].split(","))
    assert 8 < x < 16
    assert CORRIDOR[1] < y < HEIGHT_M


def test_free_cells_are_also_those_of_closed_rooms() -> None:
    closed = plan(lines=np.vstack((walls(), [((11.0, CORRIDOR[1]), (13.0, CORRIDOR[1]))])))
    space = walkable_space(closed)
    free, grid, findings = free_cells(closed, WalkableSettings())
    assert grid == space.area.grid
    assert findings == ()
    room, corridor, wall = grid.cells_of(np.array([(12.0, 16.0), MIDDLE, (2.0, CORRIDOR[1])]))
    assert free[*room]
    assert free[*corridor]
    assert not free[*wall]
    assert not space.area.mask[*room]
    assert (free & space.area.mask).sum() > 0.95 * space.area.mask.sum()


def test_free_cells_follow_the_mask_in_drawings_and_images() -> None:
    mask = np.full((220, 260, 3), 255, dtype=np.uint8)
    mask[220 - 180 : 220 - 140, 86:94] = (0, 200, 0)  # x 7.6 to 8.4, y 13 to 17
    mask[220 - 60 : 220 - 20, 100:140] = (255, 0, 0)  # x 9 to 13, y 1 to 5
    drawn = vector_plan(box(0, 0, WIDTH_M, HEIGHT_M, Use.OUTLINE), box(7, 0, 9, HEIGHT_M, Use.OBSTACLE))
    for shown in (plan(), drawn):
        plain, grid, _ = free_cells(shown, WalkableSettings())
        corrected = free_cells(shown, WalkableSettings(), mask)[0]
        green, red, elsewhere = grid.cells_of(np.array([(8.0, 15.0), (11.0, 3.0), (20.0, 3.0)]))
        assert (plain[*green], plain[*red], plain[*elsewhere]) == (False, True, True)
        assert (corrected[*green], corrected[*red], corrected[*elsewhere]) == (True, False, True)


def test_a_plan_without_outer_wall_is_told() -> None:
    image, canvas = blank(20)
    for start, stop in (((2, 5), (20, 5)), ((2, 12), (20, 12))):
        canvas.line((*pixel(np.array(start), 20), *pixel(np.array(stop), 20)), fill=(0, 0, 0), width=4)
    space = walkable_space(as_plan(image))
    assert "no_outer_wall" in {finding.kind for finding in space.findings}
    assert space.inside(np.array([[10.0, 8.0], [10.0, 15.0]])).all()


def test_a_drawn_mask_corrects_the_plan() -> None:
    mask = np.full((220, 260, 3), 255, dtype=np.uint8)
    mask[220 - 180 : 220 - 140, 166:174] = (0, 200, 0)  # a door between two rooms, x 15.6 to 16.4, y 13 to 17
    mask[220 - 112 : 220 - 12, 5:258] = (255, 0, 0)  # the hall, y 0.2 to 10.2
    space = walkable_space(plan(), mask=mask)
    assert space.clear_line(np.array([15.0, 15.0]), np.array([18.0, 15.0]))[0]
    assert not space.inside(np.array([[12.0, 5.0]]))[0]
    assert space.inside(MIDDLE[None])[0]


def test_memory_is_bounded_whatever_the_image() -> None:
    space = walkable_space(plan(40), WalkableSettings(max_cells=20_000, max_pixels=200_000))
    assert space.area.mask.size <= 20_500
    assert agreement(space) > 0.9


def test_an_image_of_two_pixels_is_read() -> None:
    tiny = FloorPlan((0, 20, 0, 10), np.array([[[0, 0, 0], [255, 255, 255]]], dtype=np.uint8))
    space = walkable_space(tiny)
    assert [finding.kind for finding in space.findings] == ["no_outer_wall"]
    assert space.inside(np.array([(4.0, 5.0), (16.0, 5.0)])).tolist() == [True, False]


def test_walls_as_lines_give_the_same_floor() -> None:
    assert agreement(walkable_space(vector_plan(lines=walls()))) > 0.96


def test_openings_join_polygons() -> None:
    room, corridor = box(0, 5, 10, 10, Use.WALKABLE), box(0, 2, 20, 5, Use.WALKABLE)
    other = box(10, 5, 20, 10, Use.WALKABLE)
    door = box(4, 4.6, 5, 5.4, Use.OPENING)
    space = walkable_space(vector_plan(room, corridor, door, box(14, 4.6, 15, 5.4, Use.OPENING), other))
    assert space.inside(np.array([(5.0, 8.0), (15.0, 8.0), (4.5, 5.0)])).all()
    assert space.clear_line(np.array([4.5, 3.0]), np.array([4.5, 8.0]))[0]
    assert not space.clear_line(np.array([7.5, 3.0]), np.array([7.5, 8.0]))[0]
    assert not space.clear_line(np.array([9.0, 8.0]), np.array([11.0, 8.0]))[0]


def test_obstacles_lie_in_an_outline() -> None:
    shops = [box(x, 4, x + 5, 12, Use.OBSTACLE) for x in (2.0, 9.0, 16.0)]
    space = walkable_space(vector_plan(box(0, 0, WIDTH_M, HEIGHT_M, Use.OUTLINE), *shops))
    area = float(space.area.mask.sum()) * space.area.cell_m**2
    assert area == pytest.approx(WIDTH_M * HEIGHT_M - 3 * 40, rel=0.01)
    assert not space.inside(np.array([[4.0, 8.0]]))[0]


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_walls_enclose_the_area_on_their_left(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mask = np.kron(rng.random((5, 6)) < 0.6, np.ones((8, 8))).astype(np.bool_)
    walls = space_of(mask).walls
    x0, y0, x1, y1 = walls[:, 0, 0], walls[:, 0, 1], walls[:, 1, 0], walls[:, 1, 1]
    enclosed = float((x0 * y1 - x1 * y0).sum()) / 2
    area = float(mask.sum()) * 0.01
    perimeter = float(np.linalg.norm(walls[:, 1] - walls[:, 0], axis=1).sum())
    assert abs(enclosed - area) <= 0.08 * perimeter + 1e-9


def test_straight_walls_are_one_segment() -> None:
    mask = np.zeros((60, 100), dtype=np.bool_)
    mask[10:50, 10:90] = True
    lengths = np.linalg.norm(np.diff(space_of(mask).walls, axis=1)[:, 0], axis=1)
    assert (lengths > 3.8).sum() == 4
