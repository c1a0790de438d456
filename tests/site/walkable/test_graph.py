from __future__ import annotations

from collections import Counter

import networkx as nx
import numpy as np
import pytest
from PIL import Image
from scipy.spatial import KDTree

from tests.site.walkable.hand_made import CORRIDOR, DOORS_X, plan, rectangles
from vislam2tag.common.files.folder import Folder
from vislam2tag.simulation.building import draw_plan, make_building
from vislam2tag.simulation.settings import BuildingSettings
from vislam2tag.site.plans.source import FloorPlan
from vislam2tag.site.walkable.graph import (
    HALL_STEP_M,
    CorridorGraph,
    NodeKind,
    corridor_graph,
    open_cells,
    place_doors,
    room_nodes,
)
from vislam2tag.site.walkable.skeleton import skeleton
from vislam2tag.site.walkable.space import WalkableSpace, walkable_space


@pytest.fixture(scope="module")
def space() -> WalkableSpace:
    return walkable_space(plan())


@pytest.fixture(scope="module")
def graph(space: WalkableSpace) -> CorridorGraph:
    return corridor_graph(space)


def test_rooms_lie_behind_doors_and_the_hall_is_open(graph: CorridorGraph) -> None:
    kinds = Counter(graph.kinds)
    assert kinds[NodeKind.DOOR] == 3
    assert kinds[NodeKind.ROOM] == 3
    assert kinds[NodeKind.OPEN] >= 6
    doors = graph.nodes[[kind is NodeKind.DOOR for kind in graph.kinds]]
    assert sorted(doors[:, 0]) == pytest.approx(DOORS_X, abs=0.3)
    assert doors[:, 1] == pytest.approx(CORRIDOR[1], abs=0.15)


def test_room_edges_are_told(graph: CorridorGraph) -> None:
    inside = graph.rooms[graph.edges].any(axis=1)
    assert (graph.in_room >= inside).all()
    corridor = ~graph.in_room & ~graph.shortcut
    assert (graph.nodes[graph.edges[corridor]][..., 1] < CORRIDOR[1] + 0.1).all()


def test_edges_are_free_of_walls_and_as_long_as_they_say(graph: CorridorGraph, space: WalkableSpace) -> None:
    for (first, last), line, length in zip(graph.edges, graph.polylines, graph.length_m, strict=True):
        assert line[0] == pytest.approx(graph.nodes[first])
        assert line[-1] == pytest.approx(graph.nodes[last])
        assert space.clear_line(line[:-1], line[1:]).all()
        assert length == pytest.approx(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def test_all_of_the_floor_is_reached(graph: CorridorGraph) -> None:
    network = graph.to_networkx()
    assert nx.is_connected(network)
    assert network.number_of_edges() == len(graph.edges)
    assert {data["kind"] for _, data in network.nodes(data=True)} == set(graph.kinds)


def test_a_turn_and_a_junction() -> None:
    bend = corridor_graph(rectangles(20, 20, (1, 1, 3, 19), (1, 17, 19, 19)))
    assert Counter(bend.kinds) == {NodeKind.TURN: 1, NodeKind.DEAD_END: 2}
    (turn,) = bend.nodes[[kind is NodeKind.TURN for kind in bend.kinds]]
    assert turn == pytest.approx([2, 18], abs=0.5)
    assert bend.width_m == pytest.approx(2.0, abs=0.8)
    fork = corridor_graph(rectangles(20, 20, (1, 9, 19, 11), (9, 11, 11, 19)))
    assert Counter(fork.kinds) == {NodeKind.JUNCTION: 1, NodeKind.DEAD_END: 3}


@pytest.mark.parametrize("seed", [1, 5])
def test_lengths_on_a_generated_floor_are_true(seed: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    floor = make_building(BuildingSettings(), seed).floors[0]
    folder = Folder.at(tmp_path_factory.mktemp("plan"))
    draw_plan(floor, folder, "plan.png")
    image = np.asarray(Image.open(folder / "plan.png").convert("RGB"))
    space = walkable_space(FloorPlan((0, floor.width_m, 0, floor.height_m), image))
    assert space.inside(floor.nodes).all()
    graph = corridor_graph(space)
    corridor_m = float(graph.length_m[~graph.in_room].sum())
    joined = floor.nodes[floor.edges]
    length = np.linalg.norm(joined[:, 1] - joined[:, 0], axis=1)
    degree = np.bincount(floor.edges.ravel())
    room = (degree[floor.edges] == 1).any(axis=1)
    true_m = float(length[~room].sum())
    dead_ends = sum(kind is NodeKind.DEAD_END for kind in graph.kinds)
    assert corridor_m == pytest.approx(true_m, rel=0.03, abs=3.5 * dead_ends)
    assert graph.kinds.count(NodeKind.ROOM) == graph.kinds.count(NodeKind.DOOR) > 40


CORRIDOR_LINE = (0.5, 0.5, 29.5, 2.5)
ROOM, DOOR = (3.0, 2.8, 7.0, 6.8), (4.5, 2.5, 5.5, 2.8)


def doors_and_rooms(*boxes: tuple[float, float, float, float]) -> tuple[int, int]:
    space = rectangles(30, 14, *boxes)
    network = skeleton(space)
    doors = place_doors(network, space)
    return len(doors), len(room_nodes(network, doors, set()))


def test_a_room_lies_behind_a_door() -> None:
    assert doors_and_rooms(CORRIDOR_LINE, ROOM, DOOR) == (1, 1)


def test_a_wide_opening_is_no_door() -> None:
    assert doors_and_rooms(CORRIDOR_LINE, ROOM, (3.5, 2.5, 6.5, 2.8)) == (0, 0)


def test_a_narrow_corridor_is_no_door() -> None:
    assert doors_and_rooms(CORRIDOR_LINE, (4.5, 2.5, 5.5, 8.0), (3.0, 8.0, 7.0, 12.0)) == (0, 0)


def test_a_corridor_behind_a_fire_door_is_no_room() -> None:
    doors, rooms = doors_and_rooms(CORRIDOR_LINE, DOOR, (0.5, 2.8, 29.5, 4.8))
    assert doors == 1
    assert rooms == 0


def test_a_room_through_which_one_reaches_a_corridor_is_a_way() -> None:
    doors, rooms = doors_and_rooms(CORRIDOR_LINE, ROOM, DOOR, (4.5, 6.8, 5.5, 7.1), (0.5, 7.1, 29.5, 9.1))
    assert doors == 2
    assert rooms == 0


def test_a_door_that_tidying_removed_parts_nothing() -> None:
    network = skeleton(rectangles(30, 14, CORRIDOR_LINE, ROOM, DOOR))
    assert room_nodes(network, {10**6}, set()) == set()


HALL = rectangles(40, 40, (2, 2, 30, 26), (10, 26, 12.5, 38))
"""A hall with a corridor off it."""


def test_open_areas_are_where_a_wide_disc_fits() -> None:
    cells = open_cells(HALL)
    assert cells[100, 100]
    assert not cells[330, 110]
    assert not open_cells(rectangles(20, 20, (1, 1, 8, 19))).any()


def test_a_net_covers_a_hall() -> None:
    graph = corridor_graph(HALL)
    nodes = graph.nodes[[kind is NodeKind.OPEN for kind in graph.kinds]]
    centres = HALL.area.grid.centres_m(np.argwhere(open_cells(HALL)))
    assert np.max(KDTree(nodes).query(centres)[0]) <= HALL_STEP_M + 0.2
    assert HALL.inside(graph.nodes).all()


def test_ways_over_a_hall_are_hardly_longer_than_straight() -> None:
    graph = corridor_graph(HALL)
    joined = nx.Graph()
    joined.add_weighted_edges_from((a, b, length) for (a, b), length in zip(graph.edges, graph.length_m, strict=True))
    hall = [node for node, kind in enumerate(graph.kinds) if kind is NodeKind.OPEN]
    for start in hall[::5]:
        walked = nx.single_source_dijkstra_path_length(joined, start)
        for stop in hall:
            straight = float(np.linalg.norm(graph.nodes[start] - graph.nodes[stop]))
            assert walked[stop] <= 1.06 * straight + 0.01


def test_shortcuts_are_not_needed_to_get_anywhere() -> None:
    graph = corridor_graph(HALL)
    joined = nx.Graph(graph.edges[~graph.shortcut].tolist())
    assert nx.is_connected(joined)
    assert len(joined) == len(graph.nodes)
