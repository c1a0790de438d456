from __future__ import annotations

import networkx as nx
import numpy as np
from scipy.spatial import KDTree

from tests.site.walkable.hand_made import rectangles
from vislam2tag.site.walkable.graph import NodeKind, corridor_graph, open_cells
from vislam2tag.site.walkable.space import GraphSettings

SETTINGS = GraphSettings()
HALL = rectangles(40, 40, (2, 2, 30, 26), (10, 26, 12.5, 38))
"""A hall with a corridor off it."""


def test_open_areas_are_where_a_wide_disc_fits() -> None:
    cells = open_cells(HALL, SETTINGS)
    assert cells[100, 100]
    assert not cells[330, 110]
    assert not open_cells(rectangles(20, 20, (1, 1, 8, 19)), SETTINGS).any()


def test_a_net_covers_a_hall() -> None:
    graph = corridor_graph(HALL, SETTINGS)
    nodes = graph.nodes[[kind is NodeKind.OPEN for kind in graph.kinds]]
    centres = HALL.area.grid.centres_m(np.argwhere(open_cells(HALL, SETTINGS)))
    assert np.max(KDTree(nodes).query(centres)[0]) <= SETTINGS.hall_step_m + 0.2
    assert HALL.inside(graph.nodes).all()


def test_ways_over_a_hall_are_hardly_longer_than_straight() -> None:
    graph = corridor_graph(HALL, SETTINGS)
    joined = nx.Graph()
    joined.add_weighted_edges_from((a, b, length) for (a, b), length in zip(graph.edges, graph.length_m, strict=True))
    hall = [node for node, kind in enumerate(graph.kinds) if kind is NodeKind.OPEN]
    for start in hall[::5]:
        walked = nx.single_source_dijkstra_path_length(joined, start)
        for stop in hall:
            straight = float(np.linalg.norm(graph.nodes[start] - graph.nodes[stop]))
            assert walked[stop] <= 1.06 * straight + 0.01


def test_shortcuts_are_not_needed_to_get_anywhere() -> None:
    graph = corridor_graph(HALL, SETTINGS)
    joined = nx.Graph(graph.edges[~graph.shortcut].tolist())
    assert nx.is_connected(joined)
    assert len(joined) == len(graph.nodes)
