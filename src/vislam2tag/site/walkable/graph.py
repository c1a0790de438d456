"""The corridor graph of a walkable space, with its rooms and open areas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

import cv2
import networkx as nx
import numpy as np
from scipy.spatial import KDTree

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, runs_of
from vislam2tag.core.path_length import arc_lengths, line_length
from vislam2tag.site.walkable.painted_cells import clearance_px, regions
from vislam2tag.site.walkable.skeleton import (
    Network,
    bend_at,
    join_components,
    mark_turns,
    merge_near,
    skeleton,
    straighten,
)
from vislam2tag.site.walkable.space import WalkableSpace

TURN_RAD = 0.6
"""A corridor that changes its direction by more than this makes a turn, rad."""
DOOR_M = 1.4
"""A short passage narrower than this is a door, metres."""
DOOR_DEPTH_M = 2.0
"""A narrow passage longer than this is a corridor, metres."""
ROOM_M = 12.0
"""What is behind doors and has more metres of graph than this is a corridor, not a room."""
HALL_M = 8.0
"""Where the walls are further apart than this, a floor is an open area, metres."""
HALL_STEP_M = 6.0
"""Distance of nodes in open areas, metres."""


def place_doors(network: Network, space: WalkableSpace) -> set[int]:
    """Split branches at doors, short passages that are narrower than what they join; returns the new nodes."""
    doors: set[int] = set()
    for number in list(network.branches):
        line = network.branches[number].line
        if len(line) > 2 and (corners := _doors_on(line, space.clearance_at(line))):
            doors.update(network.split(number, corners))
    return doors


def _doors_on(line: FloatArray, clearance_m: FloatArray) -> list[int]:
    """Corners of a line (k, 2) in the middle of its doors."""
    narrow = 2 * clearance_m < DOOR_M
    along = arc_lengths(line)
    doors = []
    for start, stop in runs_of(narrow):
        inside = start > 0 and stop < len(line)
        if inside and along[stop] - along[start - 1] < DOOR_DEPTH_M:
            narrowest = np.flatnonzero(clearance_m[start:stop] < clearance_m[start:stop].min() + 0.01)
            doors.append(start + int(narrowest[len(narrowest) // 2]))
    return doors


def room_nodes(network: Network, doors: set[int], open_nodes: set[int]) -> set[int]:
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
        if part == longest
        or size > ROOM_M
        or parts[part] & open_nodes
        or not any(neighbour in doors for node in parts[part] for neighbour in graph[node])
    }
    corridors |= _between(graph, parts, corridors, doors)
    return set().union(*(parts[part] for part in range(len(parts)) if part not in corridors))


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


_OFF_WALL_M = 0.8
"""Nodes of the net keep this distance from the walls, where there is room."""
_GRAZE_M = 0.5
"""Shorter pieces of corridor between open areas are left out."""
_STUB_M = 2.0
"""Shorter dead ends off an open area belong to it."""
_LEAST_STEP_CELLS = 6.0
"""Nodes of the net are at least this many cells apart, so that their number is bounded as that of the cells is."""
_SHORTCUT_STEPS = 2.3
"""Shortcuts are at most this many steps of the net long: ways over it are then at most 3 % too long."""


def open_cells(space: WalkableSpace) -> BoolArray:
    """Return which cells (rows, columns) lie in open areas: where a disc as wide as a hall fits, and enough of them."""
    radius = HALL_M / 2
    core = space.clearance_m >= radius
    if not core.any():
        return np.zeros_like(space.area.mask)
    opened = space.area.mask & (clearance_px(~core) * space.area.cell_m <= radius)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(opened.astype(np.uint8), connectivity=4)
    large = np.asarray(stats)[:, cv2.CC_STAT_AREA] * space.area.cell_m**2 >= HALL_M**2
    large[0] = False
    return np.asarray(large[np.asarray(labels)])


def lay_nets(network: Network, space: WalkableSpace, doors: set[int]) -> set[int]:
    """Replace a network within open areas by an even net; returns the net's nodes."""
    cells = open_cells(space)
    if not cells.any():
        return set()
    step_m = max(HALL_STEP_M, _LEAST_STEP_CELLS * space.area.cell_m)
    gates = _cut(network, space, cells, doors)
    nodes: set[int] = set()
    labels = regions(cells).astype(np.int64)
    gate_at = {gate: _label_near(labels, space, network.places[gate]) for gate in gates}
    for hall in range(1, int(labels.max()) + 1):
        made = [network.add_node(place) for place in _net_places(labels == hall, space, step_m)]
        own = [gate for gate in gates if gate_at[gate] == hall]
        _knit(network, [*made, *own], space, step_m)
        nodes.update(made, (gate for gate in own if gate not in doors))
    return nodes


def _cut(network: Network, space: WalkableSpace, cells: BoolArray, doors: set[int]) -> list[int]:
    """Take a network out of open ``cells`` (rows, columns); returns the nodes at which its corridors end there."""
    grid = space.area.grid
    gates: list[int] = []
    for number, branch in list(network.branches.items()):
        row, column = grid.cells_of(branch.line).T
        outside = ~cells[row, column]
        ends = (0, branch.first), (len(outside) - 1, branch.last)
        outside[[corner for corner, node in ends if node in doors]] = True
        if outside.all():
            continue
        network.remove(number)
        for start, stop in runs_of(outside):
            first = branch.first if start == 0 else None
            last = branch.last if stop == len(outside) else None
            gates += _keep(network, branch.line[start:stop], first, last)
    tips = [(number, node) for number, node in network.leaves() if node not in {*gates, *doors}]
    for number, node in tips:
        gate = network.branches[number].other(node)
        if gate in gates and network.branches[number].length_m < _STUB_M:
            gates.remove(gate)
            network.remove(number)
    for node in [node for node in network.places if not network.at(node) and node not in gates]:
        network.remove_node(node)
    return list(dict.fromkeys(gates))


def _keep(network: Network, line: FloatArray, first: int | None, last: int | None) -> list[int]:
    """Keep a piece (k, 2) of a branch; returns the nodes at its cut ends, or the node that is all of it."""
    if len(line) == 1:
        return [node for node in (first, last) if node is not None]
    if first is None and last is None and line_length(line) < _GRAZE_M:
        return []
    nodes = [network.add_node(place) if node is None else node for node, place in ((first, line[0]), (last, line[-1]))]
    network.add(nodes[0], nodes[1], line)
    return [node for node, kept in zip(nodes, (first, last), strict=True) if kept is None]


def _label_near(labels: IntArray, space: WalkableSpace, place: FloatArray) -> int:
    """The open area, by ``labels`` (rows, columns), at a place (2,) or next to it."""
    row, column = space.area.grid.cells_of(place[None])[0].tolist()
    reach = int(np.ceil(_GRAZE_M / space.area.cell_m))
    window = labels[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1]
    return int(np.bincount(window.ravel())[1:].argmax()) + 1 if window.any() else 0


def _net_places(hall: BoolArray, space: WalkableSpace, step_m: float) -> FloatArray:
    """Places (n, 2) of a square net over an open area, and further ones where that leaves a gap."""
    cells = np.argwhere(hall)
    centres = space.area.grid.centres_m(cells)
    low, high = centres.min(axis=0), centres.max(axis=0)
    axes = [_spread(float(start), float(stop), step_m) for start, stop in zip(low, high, strict=True)]
    lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    row, column = space.area.grid.cells_of(lattice).T
    roomy = hall[row, column] & (space.clearance_m[row, column] >= _OFF_WALL_M)
    return _without_gaps(lattice[roomy], centres, space.clearance_m[cells[:, 0], cells[:, 1]], step_m)


def _spread(start: float, stop: float, step_m: float) -> FloatArray:
    """Even marks (n,) about a step apart, half a step off the ends."""
    count = max(1, round((stop - start) / step_m))
    return np.asarray(start + (np.arange(count) + 0.5) * (stop - start) / count)


def _without_gaps(places: FloatArray, centres: FloatArray, clearance_m: FloatArray, step_m: float) -> FloatArray:
    """Add places (n, 2), that with most room first, until none of the centres (c, 2) is more than a step off."""
    kept = list(places)
    distance = np.asarray(KDTree(places).query(centres)[0]) if len(places) else np.full(len(centres), np.inf)
    while float(distance.max()) > step_m:
        gap = int(np.argmax(np.where(distance > step_m, clearance_m, -1.0)))
        kept.append(centres[gap])
        distance = np.minimum(distance, np.linalg.norm(centres - centres[gap], axis=1))
    return np.array(kept)


def _knit(network: Network, nodes: list[int], space: WalkableSpace, step_m: float) -> None:
    """Join nodes that see each other: neighbours by branches, further ones by shortcuts."""
    places = np.array([network.places[node] for node in nodes])
    tree = KDTree(places)
    pairs = tree.query_pairs(_SHORTCUT_STEPS * step_m, output_type="ndarray")
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    pairs = pairs[space.clear_line(places[pairs[:, 0]], places[pairs[:, 1]])]
    middles, halves = places[pairs].mean(axis=1), np.linalg.norm(np.diff(places[pairs], axis=1)[:, 0], axis=1) / 2
    # Neighbours (Gabriel): the circle over the line between them contains no third node.
    third = np.asarray(tree.query(middles, k=[3])[0]).reshape(-1)
    neighbours = third > halves * (1 + 1e-6)
    for (one, other), near in zip(pairs.tolist(), neighbours.tolist(), strict=True):
        number = network.add(nodes[one], nodes[other], places[[one, other]])
        if not near:
            network.shortcuts.add(number)


class NodeKind(StrEnum):
    """What a place of the graph is."""

    TURN = "turn"
    """A corridor changes its direction."""
    STRAIGHT = "straight"
    """A corridor goes on, and the door of a room is beside it."""
    JUNCTION = "junction"
    """Corridors meet."""
    DEAD_END = "dead end"
    """A corridor ends."""
    DOOR = "door"
    """A short narrow passage; its edges lead to either side."""
    ROOM = "room"
    """In a room behind a door: need not be walked through to get anywhere else."""
    OPEN = "open area"
    """In a hall, where people walk as they like; such nodes cover it evenly."""


@dataclass(frozen=True)
class CorridorGraph:
    """Nodes and edges of a floor, BCS metres."""

    nodes: FloatArray
    """(n, 2)."""
    kinds: tuple[NodeKind, ...]
    """(n)."""
    width_m: FloatArray
    """(n,) distance of the walls on both sides at each node: twice the way to the nearest one."""
    edges: IntArray
    """(e, 2) indices of nodes; each edge once."""
    polylines: tuple[FloatArray, ...]
    """(e) corners (k, 2) of the way from the edge's first node to its second, both ends included, free of walls."""
    length_m: FloatArray
    """(e,) length of each polyline."""
    in_room: BoolArray
    """(e,) edges that lie in a room or lead through a door into one: planning may treat them as optional."""
    shortcut: BoolArray
    """(e,) edges that only shorten ways over open areas: who walks all others has covered the floor."""

    @property
    def rooms(self) -> BoolArray:
        """(n,) nodes inside rooms."""
        return np.array([kind is NodeKind.ROOM for kind in self.kinds], dtype=np.bool_)

    def to_networkx(self) -> nx.MultiGraph:
        """Nodes with ``position``, ``kind``, ``width_m``; edges with ``index`` and the rest."""
        graph = nx.MultiGraph()
        for node, (place, kind, width) in enumerate(zip(self.nodes, self.kinds, self.width_m.tolist(), strict=True)):
            graph.add_node(node, position=place, kind=kind, width_m=width)
        for edge, (first, second) in enumerate(self.edges.tolist()):
            graph.add_edge(
                first,
                second,
                index=edge,
                length_m=float(self.length_m[edge]),
                polyline=self.polylines[edge],
                in_room=bool(self.in_room[edge]),
                shortcut=bool(self.shortcut[edge]),
            )
        return graph


def corridor_graph(space: WalkableSpace) -> CorridorGraph:
    """Make the graph of a walkable space: its skeleton, without spurs, and an even net over open areas."""
    network = skeleton(space)
    doors = place_doors(network, space)
    open_nodes = lay_nets(network, space, doors)
    merge_near(network, space, doors | open_nodes)
    join_components(network, space)
    straighten(network, space)
    rooms = room_nodes(network, doors, open_nodes)
    places = {NodeKind.DOOR: doors, NodeKind.ROOM: rooms, NodeKind.OPEN: open_nodes}
    corridors = [number for number in network.branches if not _in_room(network, number, places)]
    places[NodeKind.TURN] = mark_turns(network, corridors, TURN_RAD)
    return _as_arrays(network, space, places)


def _in_room(network: Network, number: int, places: Mapping[NodeKind, set[int]]) -> bool:
    """Whether a branch is in a room or leads through a door into one."""
    ends = {network.branches[number].first, network.branches[number].last}
    behind = {after for door in ends & places[NodeKind.DOOR] for after in network.neighbours(door)}
    return bool((ends | behind) & places[NodeKind.ROOM])


def _as_arrays(network: Network, space: WalkableSpace, places: Mapping[NodeKind, set[int]]) -> CorridorGraph:
    index = {node: rank for rank, node in enumerate(network.places)}
    nodes = np.array(list(network.places.values())).reshape(-1, 2)
    branches = list(network.branches.values())
    in_room = {number: _in_room(network, number, places) for number in network.branches}
    edges = [(index[branch.first], index[branch.last]) for branch in branches]
    return CorridorGraph(
        nodes=nodes,
        kinds=tuple(_kind(node, network, places, in_room) for node in network.places),
        width_m=2 * space.clearance_at(nodes),
        edges=np.array(edges, dtype=np.int64).reshape(-1, 2),
        polylines=tuple(branch.line for branch in branches),
        length_m=np.array([branch.length_m for branch in branches]),
        in_room=np.array(list(in_room.values()), dtype=np.bool_),
        shortcut=np.array([number in network.shortcuts for number in network.branches], dtype=np.bool_),
    )


def _kind(node: int, network: Network, places: Mapping[NodeKind, set[int]], in_room: Mapping[int, bool]) -> NodeKind:
    """Kind of a node: the first that it is known by, else by the branches of corridors that meet there."""
    for kind, nodes in places.items():
        if node in nodes:
            return kind
    corridors = [number for number in network.at(node) if not in_room[number]]
    if len(corridors) != 2:
        return NodeKind.JUNCTION if len(corridors) > 2 else NodeKind.DEAD_END
    return NodeKind.TURN if bend_at(network, node, *corridors) >= TURN_RAD else NodeKind.STRAIGHT


def connected_edges(graph: CorridorGraph, kept: BoolArray) -> list[int]:
    """The edges that ``kept`` (e,) marks, and the shortest others without which no walk could get to all of them."""
    joined = nx.MultiGraph()
    for edge, (first, second) in enumerate(graph.edges.tolist()):
        joined.add_edge(first, second, key=edge, length_m=0.0 if kept[edge] else float(graph.length_m[edge]))
    tree = nx.minimum_spanning_tree(joined, weight="length_m")
    needed = set(graph.edges[kept].ravel().tolist())
    while leaves := [node for node, degree in tree.degree if degree == 1 and node not in needed]:
        tree.remove_nodes_from(leaves)
    return sorted({*np.flatnonzero(kept).tolist(), *(edge for _, _, edge in tree.edges(keys=True))})
