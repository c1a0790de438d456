"""Open areas: where a skeleton misleads, an even net of nodes covers the floor."""

from __future__ import annotations

import cv2
import numpy as np
from scipy.spatial import KDTree

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, runs_of
from vislam2tag.core.path_length import line_length
from vislam2tag.site.walkable.network import Network
from vislam2tag.site.walkable.settings import GraphSettings
from vislam2tag.site.walkable.space import WalkableSpace

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


def open_cells(space: WalkableSpace, settings: GraphSettings) -> BoolArray:
    """Tell which cells (rows, columns) lie in open areas: where a disc as wide as a hall fits, and enough of them."""
    radius = settings.hall_m / 2
    core = space.clearance_m >= radius
    if not core.any():
        return np.zeros_like(space.area.mask)
    reach = cv2.distanceTransform((~core).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    opened = space.area.mask & (np.asarray(reach) * space.area.cell_m <= radius)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(opened.astype(np.uint8), connectivity=4)
    large = np.asarray(stats)[:, cv2.CC_STAT_AREA] * space.area.cell_m**2 >= settings.hall_m**2
    large[0] = False
    return np.asarray(large[np.asarray(labels)])


def lay_nets(network: Network, space: WalkableSpace, doors: set[int], settings: GraphSettings) -> set[int]:
    """Replace a network within open areas by an even net; returns the net's nodes."""
    cells = open_cells(space, settings)
    if not cells.any():
        return set()
    step_m = max(settings.hall_step_m, _LEAST_STEP_CELLS * space.area.cell_m)
    gates = _cut(network, space, cells, doors)
    nodes: set[int] = set()
    _, numbers = cv2.connectedComponents(cells.astype(np.uint8), connectivity=4, ltype=cv2.CV_32S)
    labels = np.asarray(numbers, dtype=np.int64)
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
            gates += _keep(
                network, branch.line[start:stop], _end(start, 0, branch.first), _end(stop, len(outside), branch.last)
            )
    tips = [(number, node) for number, node in network.leaves() if node not in {*gates, *doors}]
    for number, node in tips:
        gate = network.branches[number].other(node)
        if gate in gates and network.branches[number].length_m < _STUB_M:
            gates.remove(gate)
            network.remove(number)
    for node in [node for node in network.places if not network.at(node) and node not in gates]:
        network.remove_node(node)
    return list(dict.fromkeys(gates))


def _end(corner: int, end: int, node: int) -> int | None:
    """The node at a piece's end, None where it was cut off."""
    return node if corner == end else None


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
    """Join nodes that see each other: neighbours by branches, farther ones by shortcuts."""
    places = np.array([network.places[node] for node in nodes])
    tree = KDTree(places)
    pairs = tree.query_pairs(_SHORTCUT_STEPS * step_m, output_type="ndarray")
    pairs = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
    pairs = pairs[space.clear_line(places[pairs[:, 0]], places[pairs[:, 1]])]
    middles, halves = places[pairs].mean(axis=1), np.linalg.norm(np.diff(places[pairs], axis=1)[:, 0], axis=1) / 2
    # Neighbours (Gabriel): the circle over the line between them holds no third node.
    third = np.asarray(tree.query(middles, k=[3])[0]).reshape(-1)
    neighbours = third > halves * (1 + 1e-6)
    for (one, other), near in zip(pairs.tolist(), neighbours.tolist(), strict=True):
        number = network.add(nodes[one], nodes[other], places[[one, other]])
        if not near:
            network.shortcuts.add(number)
