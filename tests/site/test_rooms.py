"""Rooms by their names."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.cli.three_plans import HEIGHT_M, WIDTH_M, room_names, walls
from vislam2tag.common.errors import SurveyError
from vislam2tag.preparation.planning.corridors import typical_walks
from vislam2tag.site.model import ControlPoints, Floor
from vislam2tag.site.plans.source import FloorPlan, PlanText
from vislam2tag.site.rooms import FloorRooms, areas_without, boxes_of, floor_rooms, graph_without
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
    places = np.array([(3.0, 7.0), (36.0, 9.0), (18.0, 4.0), (2.0, 3.0)])
    assert rooms.near(places) == ["room 0.01", "room 0.10", "room 0.03", "room 0.01"]


def test_a_far_room_has_its_distance_and_a_floor_without_names_no_nearest_room() -> None:
    rooms, _ = office()
    areas = replace(rooms.areas, names=("",) * len(rooms.areas.names))
    nameless = FloorRooms(areas, tuple(one for one in rooms.names if one.text == "0.03"))
    assert nameless.near(np.array([(30.0, 3.0)])) == ["12 m from room 0.03"]
    assert replace(nameless, names=()).near(np.array([(3.0, 7.0)])) == [""]


def test_excluded_rooms_are_in_no_walk_and_no_area() -> None:
    rooms, graph = office()
    left_out = rooms.called(("0.01", " 0.03", "0.10"))  # 0.03 has no door: no one walks there anyway
    assert [rooms.areas.names[row] for row in np.flatnonzero(left_out)] == ["0.01", "0.10"]
    fewer = graph_without(graph, rooms.areas, left_out)
    entered = rooms.areas.at(np.vstack(typical_walks(fewer)))
    assert not left_out[entered[entered >= 0]].any()
    assert left_out[rooms.areas.at(np.vstack(typical_walks(graph)))].any()
    areas = areas_without(rooms.areas, left_out)
    assert (len(areas.names), set(areas.names)) == (8, set(rooms.areas.names) - {"0.01", "0.10"})
    assert areas.called(int(areas.at(np.array([(10.0, 3.0)]))[0])) == "room 0.02"
    assert areas.at(np.array([(2.0, 3.0)])).tolist() == [-1]
    boxes = boxes_of(rooms.areas, left_out)
    assert sum(x0 < 4 < x1 and y0 < 3 < y1 for x0, y0, x1, y1 in boxes.tolist()) == 1
    assert np.prod(boxes[:, 2:] - boxes[:, :2], axis=1).sum() == pytest.approx(rooms.areas.area_m2[left_out].sum())


def test_a_room_behind_an_excluded_one_is_left_out_too() -> None:
    rooms, graph = office()
    left_out = np.array([name == "Flur" for name in rooms.areas.names])  # as if all rooms were behind it
    fewer = graph_without(graph, rooms.areas, left_out)
    assert 0 < len(fewer.edges) <= 2


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("0.11", r"there is no room 0\.11; the most similar name is 0\.1"),
        ("Flur", "Flur is no room behind a door"),
        ("lift", "there is no room lift; its plan and its rooms.csv have no such name"),
    ],
)
def test_what_is_no_room_cannot_be_excluded(name: str, message: str) -> None:
    with pytest.raises(SurveyError, match=message):
        office()[0].called((name,))


def test_boxes_cover_the_rooms_with_a_name() -> None:
    rooms, _ = office()
    boxes = rooms.boxes
    assert set(boxes) == {name for name in rooms.areas.names if name}
    for name, (x, y) in room_names().items():
        inside = [
            own for own, edges in boxes.items() if ((edges[:, :2] <= (x, y)) & (edges[:, 2:] > (x, y))).all(1).any()
        ]
        assert inside == ([] if name == "0.03" else [name])
    areas = rooms.areas
    (area,) = np.flatnonzero(np.array(areas.names) == "0.01")
    edges = boxes["0.01"]
    covered_m2 = ((edges[:, 2] - edges[:, 0]) * (edges[:, 3] - edges[:, 1])).sum()
    assert covered_m2 == pytest.approx(areas.area_m2[area], rel=0.01)
