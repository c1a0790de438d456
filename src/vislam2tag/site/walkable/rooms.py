"""Doors on a network of corridors, and the rooms behind them."""

from __future__ import annotations

import networkx as nx
import numpy as np

from vislam2tag.core.arrays import FloatArray, runs_of
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.site.walkable.network import Network
from vislam2tag.site.walkable.settings import GraphSettings
from vislam2tag.site.walkable.space import WalkableSpace


def place_doors(network: Network, space: WalkableSpace, settings: GraphSettings) -> set[int]:
    """Split branches at doors, short passages that are narrower than what they join; returns the new nodes."""
    doors: set[int] = set()
    for number in list(network.branches):
        line = network.branches[number].line
        if len(line) > 2 and (corners := _doors_on(line, space.clearance_at(line), settings)):
            doors.update(network.split(number, corners))
    return doors


def _doors_on(line: FloatArray, clearance_m: FloatArray, settings: GraphSettings) -> list[int]:
    """Corners of a line (k, 2) in the middle of its doors."""
    narrow = 2 * clearance_m < settings.door_m
    along = arc_lengths(line)
    doors = []
    for start, stop in runs_of(narrow):
        inside = start > 0 and stop < len(line)
        if inside and along[stop] - along[start - 1] < settings.door_depth_m:
            narrowest = np.flatnonzero(clearance_m[start:stop] < clearance_m[start:stop].min() + 0.01)
            doors.append(start + int(narrowest[len(narrowest) // 2]))
    return doors


def room_nodes(network: Network, doors: set[int], open_nodes: set[int], room_m: float) -> set[int]:
    """Nodes in rooms: what doors part from the rest, has few metres of lines, and leads from no corridor to another.

    Doors whose nodes tidying has removed part nothing.
    """
    doors = doors & set(network.places)
    graph = nx.MultiGraph()
    graph.add_nodes_from(network.places)
    graph.add_edges_from((s.first, s.last, {"length": s.length_m}) for s in network.branches.values())
    within = graph.subgraph(set(network.places) - doors)
    parts = [set(part) for part in nx.connected_components(within)]
    if not parts:
        return set()
    sizes = [within.subgraph(part).size(weight="length") for part in parts]
    longest = max(range(len(parts)), key=lambda part: (sizes[part], -min(parts[part])))
    corridors = {
        part
        for part, size in enumerate(sizes)
        if part == longest or size > room_m or parts[part] & open_nodes or not _has_door(graph, parts[part], doors)
    }
    corridors |= _between(graph, parts, corridors, doors)
    return set().union(*(parts[part] for part in range(len(parts)) if part not in corridors))


def _has_door(graph: nx.MultiGraph, part: set[int], doors: set[int]) -> bool:
    return any(neighbour in doors for node in part for neighbour in graph[node])


def _between(graph: nx.MultiGraph, parts: list[set[int]], corridors: set[int], doors: set[int]) -> set[int]:
    """Parts that one walks through from one corridor to another that cannot be reached otherwise."""
    owner = {node: part for part, nodes in enumerate(parts) for node in nodes}
    joined = nx.Graph()
    joined.add_nodes_from(range(len(parts)))
    for door in doors:
        sides = sorted({owner[node] for node in graph[door] if node in owner})
        joined.add_edges_from((one, other) for one in sides for other in sides if one < other)
    needed: set[int] = set()
    first, *others = sorted(corridors)
    for other in others:
        weight = lambda _, part, __: 0.001 if part in corridors or part in needed else 1.0  # noqa: B023
        if nx.has_path(joined, first, other):
            needed |= set(nx.dijkstra_path(joined, first, other, weight=weight)) - corridors
    return needed
