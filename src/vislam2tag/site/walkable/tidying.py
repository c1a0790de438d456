"""Tidying a network of corridors: nodes merged, lines straightened, turns marked, pieces joined."""

from __future__ import annotations

import networkx as nx
import numpy as np
from scipy.spatial.distance import cdist
from skimage.measure import approximate_polygon

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.orientation import wrapped
from vislam2tag.core.path_length import arc_lengths, line_length
from vislam2tag.site.walkable.network import Branch, Network
from vislam2tag.site.walkable.space import WalkableSpace
from vislam2tag.site.walkable.walked.walking_distances import WalkingDistances

_RING_M = 6.0
"""A ring shorter than this goes round next to nothing."""
_STRAIGHT_SHARE = 0.3
"""Lines are straightened within this share of the distance to the walls, metres and at most ``_STRAIGHT_M``."""
_STRAIGHT_M = (0.1, 0.5)
_TURN_M = 2.0
"""Bends nearer to each other than this are one turn, metres."""
_AHEAD_M = 1.5
"""So far from a node the direction of its branches is taken."""


def merge_near(network: Network, space: WalkableSpace, fixed: set[int], merge_m: float) -> None:
    """Make one junction of two that are nearer than ``merge_m`` or the walls, the nearest first."""
    while True:
        near = [
            (branch.length_m, number)
            for number, branch in network.branches.items()
            if branch.first != branch.last
            and not {branch.first, branch.last} & fixed
            and min(len(network.at(branch.first)), len(network.at(branch.last))) > 2
            and branch.length_m < max(merge_m, _room_for_one(space, branch.line))
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


def _room_for_one(space: WalkableSpace, line: FloatArray) -> float:
    """Distance from a line (k, 2) to the walls at its narrowest, metres."""
    return float(space.clearance_at(line).min())


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
        line = _straight(branch.line, space)
        network.replace_line(number, line)


def _straight(line: FloatArray, space: WalkableSpace) -> FloatArray:
    """A line (k, 2) with as few corners as the distance to the walls allows."""
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
