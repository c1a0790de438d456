"""The corridors of a floor as a graph: turns, junctions, dead ends, doors, rooms and open areas."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum

import networkx as nx
import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.site.walkable.network import Network
from vislam2tag.site.walkable.open_areas import lay_nets
from vislam2tag.site.walkable.rooms import place_doors, room_nodes
from vislam2tag.site.walkable.settings import GraphSettings
from vislam2tag.site.walkable.skeleton import skeleton
from vislam2tag.site.walkable.space import WalkableSpace
from vislam2tag.site.walkable.tidying import bend_at, join_components, mark_turns, merge_near, straighten


class NodeKind(StrEnum):
    """What a place of the graph is."""

    TURN = "turn"
    """A corridor changes its direction."""
    STRAIGHT = "straight"
    """A corridor goes on, and the door of a room lies beside it."""
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


def corridor_graph(space: WalkableSpace, settings: GraphSettings | None = None) -> CorridorGraph:
    """Make the graph of a walkable space: its skeleton, without spurs, and an even net over open areas."""
    settings = settings or GraphSettings()
    network = skeleton(space, settings)
    doors = place_doors(network, space, settings)
    open_nodes = lay_nets(network, space, doors, settings)
    merge_near(network, space, doors | open_nodes, settings.merge_m)
    join_components(network, space)
    straighten(network, space)
    places = _NodeSets(doors, open_nodes, room_nodes(network, doors, open_nodes, settings.room_m))
    corridors = [number for number in network.branches if not places.in_room(network, number)]
    places = replace(places, turns=mark_turns(network, corridors, settings.turn_rad))
    return _as_arrays(network, space, places, settings)


@dataclass(frozen=True)
class _NodeSets:
    """Numbers of the nodes in doors, in open areas and in rooms, and of those that mark turns."""

    doors: set[int]
    open: set[int]
    rooms: set[int]
    turns: set[int] = field(default_factory=set)

    def in_room(self, network: Network, number: int) -> bool:
        """Whether a branch lies in a room or leads through a door into one."""
        ends = {network.branches[number].first, network.branches[number].last}
        behind = {after for door in ends & self.doors for after in network.neighbours(door)}
        return bool((ends | behind) & self.rooms)


def _as_arrays(network: Network, space: WalkableSpace, places: _NodeSets, settings: GraphSettings) -> CorridorGraph:
    index = {node: rank for rank, node in enumerate(network.places)}
    nodes = np.array(list(network.places.values())).reshape(-1, 2)
    branches = list(network.branches.values())
    in_room = {number: places.in_room(network, number) for number in network.branches}
    kinds = tuple(
        _kind(node, network, places, [n for n in network.at(node) if not in_room[n]], settings)
        for node in network.places
    )
    return CorridorGraph(
        nodes=nodes,
        kinds=kinds,
        width_m=2 * space.clearance_at(nodes),
        edges=np.array([(index[branch.first], index[branch.last]) for branch in branches], dtype=np.int64).reshape(
            -1, 2
        ),
        polylines=tuple(branch.line for branch in branches),
        length_m=np.array([branch.length_m for branch in branches]),
        in_room=np.array(list(in_room.values()), dtype=np.bool_),
        shortcut=np.array([number in network.shortcuts for number in network.branches], dtype=np.bool_),
    )


def _kind(node: int, network: Network, places: _NodeSets, corridors: list[int], settings: GraphSettings) -> NodeKind:
    """Kind of a node, by the branches of corridors (those of rooms left out) that meet there."""
    known = {
        NodeKind.DOOR: places.doors,
        NodeKind.ROOM: places.rooms,
        NodeKind.OPEN: places.open,
        NodeKind.TURN: places.turns,
    }
    for kind, nodes in known.items():
        if node in nodes:
            return kind
    if len(corridors) > 2:
        return NodeKind.JUNCTION
    if len(corridors) < 2:
        return NodeKind.DEAD_END
    return NodeKind.TURN if bend_at(network, node, *corridors) >= settings.turn_rad else NodeKind.STRAIGHT
