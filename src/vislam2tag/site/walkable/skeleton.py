"""A network of nodes and lines: the skeleton of a walkable space, traced and tidied."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import cv2
import networkx as nx
import numpy as np
from scipy.spatial.distance import cdist

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.core.path_length import arc_lengths, line_length
from vislam2tag.core.transforms import wrapped
from vislam2tag.site.walkable.painted_cells import parts_of
from vislam2tag.site.walkable.space import WalkableSpace
from vislam2tag.site.walkable.walking_distances import WalkingDistances

SPUR_SHARE = 0.5
"""A branch into a corner is not a dead end where it leaves the largest disc at its foot by less than this share of
the disc's radius."""
MERGE_M = 1.0
"""Nodes closer to each other than this (or than the corridor's half width there) become one, metres."""


@dataclass(frozen=True)
class Branch:
    """A line (k, 2), BCS metres, from one node to another (or the same)."""

    first: int
    last: int
    line: FloatArray

    @property
    def length_m(self) -> float:
        """Length of the line."""
        return line_length(self.line)

    def away_from(self, node: int) -> FloatArray:
        """The line (k, 2), starting at this node."""
        return self.line if self.first == node else self.line[::-1]

    def other(self, node: int) -> int:
        """The node at the other end."""
        return self.last if self.first == node else self.first


@dataclass
class Network:
    """Nodes with places (2,), and branches between them, by numbers that are never used again."""

    places: dict[int, FloatArray] = field(default_factory=dict)
    branches: dict[int, Branch] = field(default_factory=dict)
    shortcuts: set[int] = field(default_factory=set)
    """Branches that only shorten ways over open areas."""
    _at: dict[int, list[int]] = field(default_factory=dict)
    _made: int = 0

    def add_node(self, place: FloatArray) -> int:
        """Add a node at a place (2,); returns its number."""
        self._made += 1
        self.places[self._made] = place
        self._at[self._made] = []
        return self._made

    def add(self, first: int, last: int, line: FloatArray) -> int:
        """Add a branch between nodes with a line (k, 2); returns its number."""
        self._made += 1
        self.branches[self._made] = Branch(first, last, line)
        self._at[first].append(self._made)
        self._at[last].append(self._made)
        return self._made

    def at(self, node: int) -> list[int]:
        """Branches at a node; one that returns to it counts twice."""
        return self._at[node]

    def neighbours(self, node: int) -> list[int]:
        """Nodes at the other ends of a node's branches."""
        return [self.branches[number].other(node) for number in self._at[node]]

    def remove(self, number: int) -> None:
        """Remove a branch; its nodes stay."""
        branch = self.branches.pop(number)
        self._at[branch.first].remove(number)
        self._at[branch.last].remove(number)

    def replace_line(self, number: int, line: FloatArray) -> None:
        """Give a branch another line (k, 2) between the same nodes."""
        branch = self.branches[number]
        self.branches[number] = Branch(branch.first, branch.last, line)

    def remove_node(self, node: int) -> None:
        """Remove a node and its branches."""
        for number in set(self._at[node]):
            self.remove(number)
        del self.places[node], self._at[node]

    def split(self, number: int, corners: list[int]) -> list[int]:
        """Split a branch at corners of its line, in order, by new nodes; returns these."""
        branch = self.branches[number]
        made = [self.add_node(branch.line[corner]) for corner in corners]
        self.remove(number)
        nodes, marks = [branch.first, *made, branch.last], [0, *corners, len(branch.line) - 1]
        for piece in range(len(nodes) - 1):
            self.add(nodes[piece], nodes[piece + 1], branch.line[marks[piece] : marks[piece + 1] + 1])
        return made

    def join(self, node: int) -> None:
        """Make one branch of the two that meet at a node."""
        one, other = (self.branches[number] for number in self._at[node])
        line = np.vstack((one.away_from(node)[::-1], other.away_from(node)[1:]))
        first, last = one.other(node), other.other(node)
        self.remove_node(node)
        self.add(first, last, line)

    def join_through(self, keep: set[int] | frozenset[int] = frozenset()) -> None:
        """Join at every node in which just two branches meet, except for those to keep."""
        for node in list(self.places):
            numbers = self._at[node]
            if node not in keep and len(numbers) == 2 and numbers[0] != numbers[1]:
                self.join(node)

    def merge(self, node: int, into: int, place: FloatArray) -> None:
        """Make one node of two, at a place (2,); branches between the two vanish."""
        for number in list(dict.fromkeys(self._at[node])):
            branch = self.branches[number]
            self.remove(number)
            if {branch.first, branch.last} != {node, into}:
                first, last = (into if end == node else end for end in (branch.first, branch.last))
                self.add(first, last, branch.line)
        del self.places[node], self._at[node]
        self.places[into] = place
        for number in list(dict.fromkeys(self._at[into])):
            branch = self.branches[number]
            ahead, behind = ([place[None]] if end == into else [] for end in (branch.first, branch.last))
            self.replace_line(number, np.vstack((*ahead, branch.line, *behind)))

    def leaves(self) -> Iterator[tuple[int, int]]:
        """Branches that end at a node where nothing else is, with that node."""
        for node, numbers in self._at.items():
            if len(numbers) == 1:
                yield numbers[0], node


_PILLAR_M = 1.0
"""What fits into a square of this side is walked round without thinking, metres."""
_SMOOTH_CELLS = 1.0
"""Spread of the blur that takes roughness off the walls, cells."""
_CORNER_M = 0.3
"""A line that ends closer than this to the walls ends in a corner."""
_NICHE = 1.2
"""A niche is not a dead end where it is less deep than this many times its half width."""


def skeleton(space: WalkableSpace) -> Network:
    """Make the network of lines in the middle between walls; every node is an end or joins three branches at least."""
    from skimage.morphology import skeletonize  # takes a second to load, and summaries of sites do without

    cells = np.argwhere(skeletonize(_smooth(space.area.mask, space.area.cell_m)))
    network = traced(cells, space.area.grid)
    clear_spurs(network, space)
    return network


def _smooth(mask: BoolArray, cell_m: float) -> BoolArray:
    """The mask (rows, columns) without pillars and with even walls: roughness makes spurs."""
    labels, _, sides = parts_of(~np.pad(mask, 1))
    whole = mask | (sides * cell_m < _PILLAR_M)[labels][1:-1, 1:-1]
    # Thin walls would not outlast the blur.
    even: BoolArray = whole & np.asarray(cv2.GaussianBlur(whole.astype(np.float32), (0, 0), _SMOOTH_CELLS) > 0.5)
    return even


def clear_spurs(network: Network, space: WalkableSpace) -> None:
    """Remove branches that only lead into a corner or a niche, until there are none."""
    while spurs := [
        (number, node)
        for number, node in network.leaves()
        if network.at(network.branches[number].other(node))[1:] and _is_spur(network, number, node, space)
    ]:
        for number, node in spurs:
            foot = network.branches[number].other(node)
            if len(network.at(foot)) > 1:
                network.remove(number)
                network.remove_node(node)
        network.join_through()


def _is_spur(network: Network, number: int, tip: int, space: WalkableSpace) -> bool:
    """Whether a dead end reaches hardly further than the largest disc at its foot."""
    branch = network.branches[number]
    foot_m, tip_m = space.clearance_at(np.array((network.places[branch.other(tip)], network.places[tip]))).tolist()
    reach: float = branch.length_m + tip_m - foot_m
    return bool(reach < SPUR_SHARE * foot_m if tip_m < _CORNER_M else reach < _NICHE * tip_m)


_AROUND = ((0, 1), (1, 0), (1, 1), (1, -1))


def traced(cells: IntArray, grid: CellGrid) -> Network:
    """Follow the cells (n, 2) of a skeleton from node to node."""
    around = _neighbours(cells, grid)
    places = grid.centres_m(cells)
    network = Network()
    nodes = {cell: network.add_node(places[cell]) for cell, near in enumerate(around) if len(near) != 2}
    used: set[tuple[int, int]] = set()
    for start in [*nodes, *range(len(around))]:
        if start not in nodes:
            if (start, around[start][0]) in used:
                continue
            # A ring without any node gets one.
            nodes[start] = network.add_node(places[start])
        for step in around[start]:
            if (start, step) in used:
                continue
            path = _follow(start, step, around, nodes)
            for one, other in pairwise(path):
                used |= {(one, other), (other, one)}
            network.add(nodes[start], nodes[path[-1]], places[path])
    network.join_through()
    return network


def _follow(start: int, step: int, around: list[list[int]], nodes: dict[int, int]) -> list[int]:
    """Cells from a node over its neighbour to the next node."""
    path = [start, step]
    while path[-1] not in nodes:
        one, other = around[path[-1]]
        path.append(other if one == path[-2] else one)
    return path


def _neighbours(cells: IntArray, grid: CellGrid) -> list[list[int]]:
    """Neighbours of each cell (n, 2) by their index; those on the diagonal only where no side leads there."""
    index = np.full((grid.rows + 2, grid.columns + 2), -1, dtype=np.int64)
    row, column = cells.T + 1
    index[row, column] = np.arange(len(cells))
    pairs = []
    for down, right in _AROUND:
        other = index[row + down, column + right]
        joined = other >= 0
        if down and right:
            joined &= (index[row + down, column] < 0) & (index[row, column + right] < 0)
        pairs.append(np.column_stack((np.flatnonzero(joined), other[joined])))
    near: list[list[int]] = [[] for _ in cells]
    for one, other in np.vstack(pairs).tolist():
        near[one].append(other)
        near[other].append(one)
    return near


_RING_M = 6.0
"""A ring shorter than this goes round next to nothing."""
_STRAIGHT_SHARE = 0.3
"""Lines are straightened within this share of the distance to the walls, metres and at most ``_STRAIGHT_M``."""
_STRAIGHT_M = (0.1, 0.5)
_TURN_M = 2.0
"""Bends closer to each other than this are one turn, metres."""
_AHEAD_M = 1.5
"""So far from a node the direction of its branches is taken."""


def merge_near(network: Network, space: WalkableSpace, fixed: set[int]) -> None:
    """Make one junction of two that are closer than :data:`MERGE_M` or the walls, the nearest first."""
    while True:
        near = [
            (branch.length_m, number)
            for number, branch in network.branches.items()
            if branch.first != branch.last
            and not {branch.first, branch.last} & fixed
            and min(len(network.at(branch.first)), len(network.at(branch.last))) > 2
            and branch.length_m < max(MERGE_M, float(space.clearance_at(branch.line).min()))
        ]
        if not near:
            break
        branch = network.branches[min(near)[1]]
        middle = branch.line[len(branch.line) // 2] if len(branch.line) > 2 else branch.line.mean(axis=0)
        network.merge(branch.last, branch.first, middle)
        for number in dict.fromkeys(network.at(branch.first)):
            network.replace_line(
                number, _straightened_end(network.branches[number], branch.first, 2 * branch.length_m, space)
            )
        _clear_rings(network)
    _clear_rings(network)
    network.join_through(fixed)


def _straightened_end(branch: Branch, node: int, reach_m: float, space: WalkableSpace) -> FloatArray:
    """A branch's line (k, 2), straight for as long as it stays near one of its nodes and no wall is in between."""
    line = branch.away_from(node)
    beyond = np.flatnonzero(np.linalg.norm(line - line[0], axis=1) > reach_m)
    corner = int(beyond[0]) if len(beyond) else len(line) - 1
    if branch.first == branch.last or not space.clear_line(line[0], line[corner]).all():
        return branch.line
    pulled = np.vstack((line[:1], line[corner:]))
    return pulled if branch.first == node else pulled[::-1]


def _clear_rings(network: Network) -> None:
    for number, branch in list(network.branches.items()):
        if branch.first == branch.last and branch.length_m < _RING_M and len(network.at(branch.first)) > 2:
            network.remove(number)


def join_components(network: Network, space: WalkableSpace) -> None:
    """Join the pieces of a network, each with the nearest, by shortest ways."""
    graph = nx.Graph()
    graph.add_nodes_from(network.places)
    graph.add_edges_from((branch.first, branch.last) for branch in network.branches.values())
    first, *others = sorted(
        (sorted(part) for part in nx.connected_components(graph)), key=lambda part: (-len(part), part)
    )
    walking = WalkingDistances(space)
    while others:
        whole = np.array([network.places[node] for node in first])
        gaps = [cdist(whole, np.array([network.places[node] for node in part])) for part in others]
        nearest = min(range(len(others)), key=lambda part: float(gaps[part].min()))
        one, other = np.unravel_index(int(gaps[nearest].argmin()), gaps[nearest].shape)
        part = others.pop(nearest)
        way = walking.path(network.places[first[one]], network.places[part[other]])
        network.add(first[one], part[other], way)
        first += part


def straighten(network: Network, space: WalkableSpace) -> None:
    """Take roughness off all lines; none comes to cross a wall."""
    for number, branch in list(network.branches.items()):
        network.replace_line(number, _straight(branch.line, space))


def _straight(line: FloatArray, space: WalkableSpace) -> FloatArray:
    """A line (k, 2) with as few corners as the distance to the walls allows."""
    from skimage.measure import approximate_polygon

    if len(line) < 3:
        return line
    tolerance = float(np.clip(_STRAIGHT_SHARE * np.median(space.clearance_at(line)), *_STRAIGHT_M))
    while tolerance > space.area.cell_m / 4:
        straight = np.asarray(approximate_polygon(line, tolerance))
        if len(straight) > 1 and space.clear_line(straight[:-1], straight[1:]).all():
            return straight
        tolerance /= 2
    return line


def mark_turns(network: Network, numbers: list[int], least_rad: float) -> set[int]:
    """Split these branches where they turn by more than a limit within two metres; returns the new nodes."""
    turns: set[int] = set()
    for number in numbers:
        if corners := _turns(network.branches[number].line, least_rad):
            turns.update(network.split(number, corners))
    return turns


def _turns(line: FloatArray, least_rad: float) -> list[int]:
    """Corners of a line (k, 2) at which it turns."""
    legs = np.diff(line, axis=0)
    heading = np.arctan2(legs[:, 1], legs[:, 0])
    bend = wrapped(np.diff(heading))
    along = np.cumsum(np.linalg.norm(legs, axis=1))[:-1]
    turns: list[int] = []
    start = 0
    while start < len(bend):
        stop = int(np.searchsorted(along, along[start] + _TURN_M))
        if abs(float(bend[start:stop].sum())) >= least_rad:
            turns.append(start + int(np.abs(bend[start:stop]).argmax()) + 1)
            start = stop
        else:
            start += 1
    return turns


def bend_at(network: Network, node: int, first: int, second: int) -> float:
    """Angle by which who goes from one branch into another one turns at a node, rad."""
    into, out = (_direction(network.branches[number].away_from(node)) for number in (first, second))
    return float(np.abs(np.angle(-into.conjugate() * out)))


def _direction(line: FloatArray) -> complex:
    """Direction of the first metre and a half of a line (k, 2) as x + iy."""
    along = arc_lengths(line)
    ahead = min(_AHEAD_M, line_length(line))
    x, y = (float(np.interp(ahead, along, line[:, axis])) - float(line[0, axis]) for axis in (0, 1))
    return complex(x, y)
