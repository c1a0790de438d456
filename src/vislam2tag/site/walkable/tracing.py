"""Following lines one cell wide from crossing to crossing."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vislam2tag.core.arrays import IntArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.site.walkable.network import Network

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
