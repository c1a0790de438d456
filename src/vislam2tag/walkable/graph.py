"""The corridors of a floor as a graph: turns, junctions, dead ends, doors, rooms and open areas."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import networkx as nx
import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.walkable.settings import GraphSettings
from vislam2tag.walkable.space import WalkableSpace


class NodeKind(StrEnum):
    """What a place of the graph is."""

    TURN = "turn"
    """A corridor changes its direction."""
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
            )
        return graph


def corridor_graph(space: WalkableSpace, settings: GraphSettings | None = None) -> CorridorGraph:
    """Make the graph of a walkable space: its skeleton, without spurs, and an even net over open areas."""
    raise NotImplementedError
