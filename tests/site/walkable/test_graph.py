from __future__ import annotations

from collections import Counter

import networkx as nx
import numpy as np
import pytest
from PIL import Image

from tests.site.walkable.hand_made import CORRIDOR, DOORS_X, plan, rectangles
from vislam2tag.common.files.folder import Folder
from vislam2tag.simulation.building.building import draw_plan, make_building
from vislam2tag.simulation.settings import BuildingSettings
from vislam2tag.site.plans.source import FloorPlan
from vislam2tag.site.walkable.graph import CorridorGraph, NodeKind, corridor_graph
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
