"""Rooms by their names."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from tests.cli.three_plans import HEIGHT_M, WIDTH_M, room_names, walls
from vislam2tag.site.model import ControlPoints, Floor
from vislam2tag.site.plans.source import FloorPlan, PlanText
from vislam2tag.site.rooms import FloorRooms, floor_rooms
from vislam2tag.site.walkable.graph import CorridorGraph, corridor_graph
from vislam2tag.site.walkable.space import walkable_space

FLOOR = Floor(1, "One", None, None, None, None, ControlPoints((), np.empty((0, 2))))


@cache
def office() -> tuple[FloorRooms, CorridorGraph]:
    """Ten rooms at a corridor; 0.03 has no door."""
    texts = [PlanText(name, place) for name, place in room_names().items()]
    lines = [*walls(), (19.0, 7.0, 20.0, 7.0)]
    extent = (0.0, WIDTH_M, 0.0, HEIGHT_M)
    walled = np.array(lines).reshape(-1, 2, 2)
    plan = FloorPlan(extent, np.zeros((1, 1, 3), np.uint8), walls=walled, texts=(*texts, PlanText("Flur", (20.0, 8.0))))
    space = walkable_space(plan)
    graph = corridor_graph(space)
    return floor_rooms(FLOOR, plan, space, graph), graph


def test_the_nearest_room_has_a_name_whether_or_not_it_has_a_door() -> None:
    rooms, _ = office()
    assert [one.text for one in rooms.closed] == ["0.03"]
    places = np.array([(3.0, 7.0), (36.0, 9.0), (18.0, 4.0), (2.0, 3.0)])
    assert rooms.near(places) == ["room 0.01", "room 0.10", "room 0.03", "room 0.01"]


def test_a_far_room_has_its_distance_and_a_floor_without_names_no_nearest_room() -> None:
    rooms, _ = office()
    nameless = replace(rooms, areas=replace(rooms.areas, names=("",) * len(rooms.areas.names)))
    assert nameless.near(np.array([(30.0, 3.0)])) == ["12 m from room 0.03"]
    assert replace(nameless, closed=()).near(np.array([(3.0, 7.0)])) == [""]
