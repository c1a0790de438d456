"""Walks as surveyors take them, for the prediction: least used corridors first, now and then a look into a room."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.path_length import arc_lengths, points_along
from vislam2tag.site.walkable.graph import CorridorGraph

STEP_M = 0.1
"""Sampling of a walk."""
CORNER_M = 0.4
"""How much corners are rounded."""
WALK_M = 150.0
"""Length of a session's walk: three minutes."""
TIMES = 12.0
"""All corridors together are walked about so often."""
FEWEST = 12
"""Walks at least."""
ROOM_SHARE = 0.12
"""Probability of looking into a room when passing its door."""


@dataclass(frozen=True)
class DirectedEdge:
    """Half an edge of the graph in walking direction."""

    edge: int
    stop: int
    line: FloatArray


def typical_walks(graph: CorridorGraph, seed: int = 0, fewest: int = FEWEST) -> list[FloatArray]:
    """Walks (each (k, 2), BCS metres, a sample every 10 cm or so) that cover a graph; the same for the same graph."""
    if not (~graph.shortcut).any():
        return []
    rng = np.random.default_rng(seed)
    used = np.zeros(len(graph.edges))
    leaving = _leaving(graph)
    count = max(fewest, round(TIMES * float(graph.length_m[~graph.in_room & ~graph.shortcut].sum()) / WALK_M))
    starts = [node for node, out in enumerate(leaving) if any(not graph.in_room[taken.edge] for taken in out)]
    return [_walk(graph, leaving, used, starts or list(range(len(leaving))), rng) for _ in range(count)]


def _leaving(graph: CorridorGraph) -> list[list[DirectedEdge]]:
    leaving: list[list[DirectedEdge]] = [[] for _ in graph.nodes]
    for edge in np.flatnonzero(~graph.shortcut).tolist():
        first, second = graph.edges[edge].tolist()
        leaving[first].append(DirectedEdge(edge, second, graph.polylines[edge]))
        leaving[second].append(DirectedEdge(edge, first, graph.polylines[edge][::-1]))
    return leaving


def _walk(
    graph: CorridorGraph,
    leaving: list[list[DirectedEdge]],
    used: FloatArray,
    starts: list[int],
    rng: np.random.Generator,
) -> FloatArray:
    """One walk (k, 2); ``used`` (e,) counts how often edges were taken and is changed."""
    fresh = np.array([min(used[taken.edge] for taken in leaving[node]) for node in starts])
    node = int(rng.choice(np.array(starts)[fresh == fresh.min()]))
    before, length, parts = -1, 0.0, [graph.nodes[node][None]]
    while length < WALK_M:
        taken = _next(graph, leaving[node], before, used, rng)
        used[taken.edge] += 1
        length += float(graph.length_m[taken.edge])
        parts.append(taken.line[1:])
        node, before = taken.stop, taken.edge
    return smooth_line(np.vstack(parts))


def _next(
    graph: CorridorGraph, leaving: list[DirectedEdge], before: int, used: FloatArray, rng: np.random.Generator
) -> DirectedEdge:
    """Choose an edge to go on by, by how often each was ``used`` (e,): not back unless there is no other."""
    options = [taken for taken in leaving if taken.edge != before] or leaving
    if before < 0 or not graph.in_room[before]:
        rooms = [taken for taken in options if graph.in_room[taken.edge]]
        others = [taken for taken in options if not graph.in_room[taken.edge]]
        options = rooms if rooms and (rng.random() < ROOM_SHARE or not others) else others or options
    weight = np.array([4.0 ** -min(used[taken.edge], 60.0) for taken in options])
    return options[int(rng.choice(len(options), p=weight / weight.sum()))]


def smooth_line(corners: FloatArray) -> FloatArray:
    """Sample a line (k, 2) densely and round its corners."""
    dense = points_along(corners, np.arange(0.0, arc_lengths(corners)[-1] + STEP_M / 2, STEP_M))
    return np.asarray(gaussian_filter1d(dense, CORNER_M / STEP_M, axis=0, mode="nearest"))
