"""The skeleton of walkable space: lines in the middle between walls, without spurs into corners."""

from __future__ import annotations

from itertools import pairwise

import cv2
import numpy as np
from skimage.morphology import skeletonize

from vislam2tag.core.arrays import BoolArray, IntArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.walkable.network import Network
from vislam2tag.walkable.settings import GraphSettings
from vislam2tag.walkable.space import WalkableSpace

_PILLAR_M = 1.0
"""What fits into a square of this side is walked round without thinking, metres."""
_SMOOTH_CELLS = 1.0
"""Spread of the blur that takes roughness off the walls, cells."""
_CORNER_M = 0.3
"""A line that ends nearer than this to the walls ends in a corner."""
_NICHE = 1.2
"""A niche is no dead end where it is less deep than this many times its half width."""
_AROUND = ((0, 1), (1, 0), (1, 1), (1, -1))


def skeleton(space: WalkableSpace, settings: GraphSettings) -> Network:
    """Make the network of lines in the middle between walls; every node is an end or joins three strands at least."""
    cells = np.argwhere(skeletonize(_smooth(space.area.mask, space.area.cell_m)))
    network = _traced(cells, space.area.grid)
    clear_spurs(network, space, settings.spur_share)
    return network


def _smooth(mask: BoolArray, cell_m: float) -> BoolArray:
    """The mask without pillars and with even walls: roughness makes spurs."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats((~np.pad(mask, 1)).astype(np.uint8), connectivity=8)
    sides = np.asarray(stats)[:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(axis=1)
    whole = mask | (sides * cell_m < _PILLAR_M)[np.asarray(labels)][1:-1, 1:-1]
    # Thin walls would not outlast the blur.
    even: BoolArray = whole & np.asarray(cv2.GaussianBlur(whole.astype(np.float32), (0, 0), _SMOOTH_CELLS) > 0.5)
    return even


def _traced(cells: IntArray, grid: CellGrid) -> Network:
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
    """Neighbours of each cell by their index; those on the diagonal only where no side leads there."""
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


def clear_spurs(network: Network, space: WalkableSpace, share: float) -> None:
    """Remove strands that only lead into a corner or a niche, until there are none."""
    while spurs := [
        (number, node)
        for number, node in network.leaves()
        if network.at(network.strands[number].other(node))[1:] and _is_spur(network, number, node, space, share)
    ]:
        for number, node in spurs:
            foot = network.strands[number].other(node)
            if len(network.at(foot)) > 1:
                network.remove(number)
                network.remove_node(node)
        network.join_through()


def _is_spur(network: Network, number: int, tip: int, space: WalkableSpace, share: float) -> bool:
    """Whether a dead end reaches hardly farther than the largest disc at its foot."""
    strand = network.strands[number]
    foot_m, tip_m = space.clearance_at(np.array((network.places[strand.other(tip)], network.places[tip]))).tolist()
    reach: float = strand.length_m + tip_m - foot_m
    return bool(reach < share * foot_m if tip_m < _CORNER_M else reach < _NICHE * tip_m)
