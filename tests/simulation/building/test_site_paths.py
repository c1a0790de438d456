from __future__ import annotations

import numpy as np

from tests.site.walkable.hand_made import plan, rectangles
from vislam2tag.simulation.building.site_paths import PASSED_M, site_paths
from vislam2tag.site.walkable.graph import NodeKind, corridor_graph
from vislam2tag.site.walkable.space import walkable_space

WIDE = rectangles(40, 12, (1, 2, 39, 9))
"""One corridor, 7 m wide."""
SHEETS = np.array([(12.0, 2.0), (30.0, 9.0)])
HEADING_RAD = np.array([np.pi, 0.0])
"""The sheet on the lower wall faces upwards: to the right of who looks at it is the left of the plan."""


def distance_to_ways(nodes: np.ndarray, edges: np.ndarray, point: np.ndarray) -> float:
    start, leg = nodes[edges[:, 0]], nodes[edges[:, 1]] - nodes[edges[:, 0]]
    share = (((point - start) * leg).sum(axis=1) / (leg**2).sum(axis=1)).clip(0, 1)
    return float(np.linalg.norm(start + share[:, None] * leg - point, axis=1).min())


def test_ways_lead_past_sheets_off_the_middle() -> None:
    ways = site_paths(corridor_graph(WIDE), WIDE, SHEETS, HEADING_RAD)
    assert not ways.missed
    for sheet in SHEETS:
        assert distance_to_ways(ways.nodes, ways.edges, sheet) < 1.0
    joined = ways.nodes[ways.edges]
    assert WIDE.clear_line(joined[:, 0], joined[:, 1]).all()


def test_ways_that_pass_anyway_stay() -> None:
    narrow = rectangles(40, 6, (1, 2, 39, 4))
    graph = corridor_graph(narrow)
    ways = site_paths(graph, narrow, np.array([(12.0, 2.0)]), np.array([np.pi]))
    assert len(ways.nodes) == len(graph.nodes) + sum(len(line) - 2 for line in graph.polylines)
    assert distance_to_ways(ways.nodes, ways.edges, np.array([12.0, 2.0])) < PASSED_M


def test_a_sheet_behind_a_wall_is_missed() -> None:
    ways = site_paths(corridor_graph(WIDE), WIDE, np.array([(12.0, 0.5)]), np.array([0.0]))
    assert ways.missed == (0,)


def test_rooms_and_their_doors_are_told() -> None:
    space = walkable_space(plan())
    graph = corridor_graph(space)
    ways = site_paths(graph, space, np.empty((0, 2)), np.empty(0))
    for node, kind in enumerate(graph.kinds):
        assert (node in ways.rooms) == (kind in (NodeKind.ROOM, NodeKind.DOOR))
