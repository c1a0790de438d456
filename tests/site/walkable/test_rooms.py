from __future__ import annotations

from tests.site.walkable.hand_made import rectangles
from vislam2tag.site.walkable.graph import place_doors, room_nodes
from vislam2tag.site.walkable.skeleton import skeleton
from vislam2tag.site.walkable.space import GraphSettings

SETTINGS = GraphSettings()
CORRIDOR = (0.5, 0.5, 29.5, 2.5)
ROOM, DOOR = (3.0, 2.8, 7.0, 6.8), (4.5, 2.5, 5.5, 2.8)


def doors_and_rooms(*boxes: tuple[float, float, float, float]) -> tuple[int, int]:
    space = rectangles(30, 14, *boxes)
    network = skeleton(space, SETTINGS)
    doors = place_doors(network, space, SETTINGS)
    return len(doors), len(room_nodes(network, doors, set(), SETTINGS.room_m))


def test_a_room_lies_behind_a_door() -> None:
    assert doors_and_rooms(CORRIDOR, ROOM, DOOR) == (1, 1)


def test_a_wide_opening_is_no_door() -> None:
    assert doors_and_rooms(CORRIDOR, ROOM, (3.5, 2.5, 6.5, 2.8)) == (0, 0)


def test_a_narrow_corridor_is_no_door() -> None:
    assert doors_and_rooms(CORRIDOR, (4.5, 2.5, 5.5, 8.0), (3.0, 8.0, 7.0, 12.0)) == (0, 0)


def test_a_corridor_behind_a_fire_door_is_no_room() -> None:
    doors, rooms = doors_and_rooms(CORRIDOR, DOOR, (0.5, 2.8, 29.5, 4.8))
    assert doors == 1
    assert rooms == 0


def test_a_room_through_which_one_reaches_a_corridor_is_a_way() -> None:
    doors, rooms = doors_and_rooms(CORRIDOR, ROOM, DOOR, (4.5, 6.8, 5.5, 7.1), (0.5, 7.1, 29.5, 9.1))
    assert doors == 2
    assert rooms == 0


def test_a_door_that_tidying_removed_parts_nothing() -> None:
    network = skeleton(rectangles(30, 14, CORRIDOR, ROOM, DOOR), SETTINGS)
    assert room_nodes(network, {10**6}, set(), SETTINGS.room_m) == set()
