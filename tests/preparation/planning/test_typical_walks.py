"""Walks for the prediction."""

from __future__ import annotations

import numpy as np

from tests.preparation.planning.floors import graph_of, ring
from vislam2tag.preparation.planning.corridors import STEP_M, WALK_M, smooth_line, typical_walks


def test_walks_cover_all_ways_and_are_the_same_each_time() -> None:
    graph = ring()[1]
    walks = typical_walks(graph)
    assert all(np.array_equal(a, b) for a, b in zip(walks, typical_walks(graph), strict=True))
    everywhere = np.vstack(walks)
    for line in graph.polylines:
        for point in np.linspace(line[0], line[1], 20)[1:-1]:
            assert np.linalg.norm(everywhere - point, axis=1).min() < 0.5
    for walk in walks:
        assert WALK_M - 5 < np.linalg.norm(np.diff(walk, axis=0), axis=1).sum() < WALK_M + 40


def test_rooms_are_looked_into_now_and_then() -> None:
    nodes = [(float(x), 0.0) for x in range(0, 50, 5)] + [(float(x), 5.0) for x in range(5, 45, 5)]
    edges = [(i, i + 1) for i in range(9)] + [(i + 1, 10 + i) for i in range(8)]
    graph = graph_of(nodes, edges, in_room=[False] * 9 + [True] * 8)
    inside = np.concatenate([walk[:, 1] > 2.0 for walk in typical_walks(graph)])
    assert 0.02 < inside.mean() < 0.3


def test_lines_are_sampled_densely_with_round_corners() -> None:
    corner = smooth_line(np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]))
    assert np.linalg.norm(np.diff(corner, axis=0), axis=1).max() < 1.01 * STEP_M
    assert np.linalg.norm(corner - (10.0, 0.0), axis=1).min() > 0.1
    assert typical_walks(graph_of([(0.0, 0.0)], [])) == []
