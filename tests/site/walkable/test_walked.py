"""A floor parted at its doors, called as its plan calls it, and the walk that fills what nobody walked."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.cli.three_plans import HEIGHT_M, WIDTH_M, room_names, walls
from tests.site.walkable.hand_made import rectangles
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.path_length import arc_lengths, points_along
from vislam2tag.site.floors import names_on_plan
from vislam2tag.site.plans.source import FloorPlan, PlanText
from vislam2tag.site.walkable.graph import corridor_graph
from vislam2tag.site.walkable.space import walkable_space
from vislam2tag.site.walkable.walked import (
    Areas,
    WalkedSpace,
    WalkToFill,
    areas_of,
    filling_walk,
    walked_floor,
    walked_space,
)
from vislam2tag.site.walkable.walking_distances import WalkingDistances

CORRIDOR = np.column_stack((np.arange(1.0, 39.5, 1.0), np.full(39, 8.0)))
"""A walk along the corridor from end to end, a point a metre."""
ROOM_1 = np.array([(3.5, 8.0), (3.5, 6.0), (4.0, 4.0), (4.0, 2.0)])
NOWHERE = np.empty((0, 2))


@cache
def office() -> Areas:
    """Ten rooms of 56 m\u00b2 with doors of 1 m to a corridor of 2 m; the texts in them are their names."""
    texts = [PlanText(name, place) for name, place in room_names().items()]
    lines = np.array(walls()).reshape(-1, 2, 2)
    texts += [PlanText("56,0 m\u00b2", (4.0, 5.0)), PlanText("Flur", (20.0, 8.0))]
    plan = FloorPlan((0.0, WIDTH_M, 0.0, HEIGHT_M), np.zeros((1, 1, 3), np.uint8), walls=lines, texts=tuple(texts))
    space = walkable_space(plan)
    return areas_of(space, corridor_graph(space)).with_names(names_on_plan(plan))


def along(walk: WalkToFill) -> FloatArray:
    """Points of a walk, a metre apart."""
    line = np.array(walk.points_m)
    return points_along(line, np.arange(0.0, arc_lengths(line)[-1], 1.0))


def test_doors_part_rooms_from_the_corridor() -> None:
    areas = office()
    assert (areas.is_room.sum(), (~areas.is_room).sum()) == (10, 1)
    assert areas.area_m2[areas.is_room] == pytest.approx(np.full(10, 54.0), abs=3.0)
    assert areas.area_m2[~areas.is_room] == pytest.approx([39.8 * 1.9], abs=39.8 * 0.1)  # of 2 m, walls take 0.1 to 0.2


def test_rooms_are_called_by_the_text_that_stands_in_them() -> None:
    areas = office()
    called = {areas.called(int(area)) for area in np.flatnonzero(areas.is_room)}
    assert called == {f"room {name}" for name in room_names()}
    assert areas.of_place((20.0, 8.2)) == "Flur"
    assert areas.of_place((4.0, 2.0)) == "room 0.01"
    assert areas.of_place((-5.0, 2.0)) == ""


def test_a_name_on_a_wall_is_that_of_the_room_beside_it_and_the_first_one_counts() -> None:
    bare = office().with_names([])
    areas = Areas(bare.space, bare.number, bare.is_room, bare.middle_m, bare.area_m2, ("",) * len(bare.area_m2))
    beside, later, far = PlanText("Lab", (4.0, -0.5)), PlanText("later", (4.0, 2.0)), PlanText("far", (90.0, 0.0))
    named = areas.with_names([beside, later, far])
    assert named.of_place((4.0, 2.0)) == "room Lab"
    assert sum(map(bool, named.names)) == 1
    (unnamed,) = areas.at(np.array([(20.0, 3.0)]))
    assert areas.called(int(unnamed)).startswith("room at (")


def test_who_walks_past_a_room_has_not_been_in_it() -> None:
    space = walked_space(office(), CORRIDOR, NOWHERE)
    shares = space.area_shares(space.walked)
    assert shares[~office().is_room] > 0.95
    assert shares[office().is_room].max() < 0.1
    assert len(space.never_entered) == 10
    assert not space.scanned.any()


def test_a_room_that_was_entered_counts() -> None:
    space = walked_space(office(), np.vstack((CORRIDOR, ROOM_1)), ROOM_1[-1:])
    record = walked_floor(0, space, None)
    (room,) = [area for area in record.rooms if area.entered]
    assert room.name == "room 0.01"
    assert room.walked > 0.4
    assert room.scanned > 0.1
    assert len(record.never_entered) == 9


@pytest.fixture(scope="module")
def walked() -> WalkedSpace:
    return walked_space(office(), np.vstack((CORRIDOR, ROOM_1)), NOWHERE)


def test_the_filling_walk_goes_through_doors_and_crosses_no_wall(walked: WalkedSpace) -> None:
    walk = filling_walk(walked)
    assert walk is not None
    line = np.array(walk.points_m)
    assert office().space.clear_line(line[:-1], line[1:]).all()
    after = walked_space(office(), np.vstack((CORRIDOR, ROOM_1, along(walk))), NOWHERE)
    assert after.never_entered == []
    assert after.walked.mean() > 0.8 > walked.walked.mean()


def test_the_filling_walk_is_about_as_short_as_rooms_allow(walked: WalkedSpace) -> None:
    """In and out of nine rooms of 8 m x 7 m, in each at least 6 m, and the corridor between them once or twice."""
    walk = filling_walk(walked)
    assert walk is not None
    assert 9 * 12 < walk.length_m < 9 * 30 + 2 * WIDTH_M


def test_of_too_many_stops_those_count_that_fill_most(walked: WalkedSpace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vislam2tag.site.walkable.walked.MOST_STOPS", 3)
    walk = filling_walk(walked)
    assert walk is not None
    assert len(walk.stops_m) == 3


def test_where_all_was_walked_there_is_no_walk_left() -> None:
    area = office().space.area
    everywhere = area.grid.centres_m(np.argwhere(area.mask)[::5])
    assert filling_walk(walked_space(office(), everywhere, NOWHERE)) is None


def test_positions_off_the_plan_are_nowhere_near() -> None:
    space = walked_space(office(), np.array([(-30.0, 3.0), (np.nan, np.nan)]), NOWHERE)
    assert not space.walked.any()


EMPTY = WalkingDistances(rectangles(16, 16, (1, 1, 15, 15)))
BEND = WalkingDistances(rectangles(20, 20, (1, 1, 3, 19), (1, 17, 19, 19)))
INSIDE = st.tuples(st.floats(1.5, 14.5), st.floats(1.5, 14.5))


@settings(max_examples=30)
@given(INSIDE, INSIDE)
def test_ways_over_open_floor_are_straight(start: tuple[float, float], stop: tuple[float, float]) -> None:
    straight = float(np.hypot(start[0] - stop[0], start[1] - stop[1]))
    (walked,) = EMPTY.between(np.array([start]), np.array([stop]))[0]
    assert straight <= walked <= 1.03 * straight + 0.35


def test_ways_lead_around_corners() -> None:
    start, stop = np.array([2.0, 2.0]), np.array([18.0, 18.0])
    exact = float(np.hypot(1, 15) + np.hypot(15, 1))
    assert BEND.between(start[None], stop[None])[0, 0] == pytest.approx(exact, rel=0.02)
    way = BEND.path(start, stop)
    assert len(way) == 3
    assert float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum()) == pytest.approx(exact, rel=0.01)
    assert way[[0, -1]].tolist() == [start.tolist(), stop.tolist()]


def test_corners_are_moved_off_walls_and_the_way_stays_clear() -> None:
    way = BEND.path(np.array([2.0, 2.0]), np.array([18.0, 18.0]))
    moved = BEND.off_walls(way)
    assert BEND.space.clearance_at(way[1:2])[0] < 0.2
    assert BEND.space.clearance_at(moved)[1] >= 0.4
    assert np.abs(moved - way).max() <= 0.4 + 1e-9
    assert BEND.space.clear_line(moved[:-1], moved[1:]).all()
    assert moved[[0, -1]].tolist() == way[[0, -1]].tolist(), "there is room around them"


def test_the_nearest_of_several_targets_counts() -> None:
    targets = np.array([(2.0, 17.5), (18.0, 18.0)])
    points = np.array([(2.0, 8.0), (15.0, 18.0)])
    assert BEND.to_nearest(points, targets) == pytest.approx([9.5, 3.0], abs=0.4)


def test_distances_are_symmetric() -> None:
    points = np.array([(2.0, 2.0), (2.0, 15.0), (9.0, 18.0), (18.0, 18.0)])
    lengths = BEND.between(points, points)
    assert lengths == pytest.approx(lengths.T)
    assert np.diag(lengths) == pytest.approx(0.0, abs=0.3)
