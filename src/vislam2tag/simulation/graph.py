"""The walkable graph of a floor: corridor centre lines, doors and room centres."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.simulation.layout import DEAD_END_M, Layout

ROOM_STEP_M = 2.6
"""How far into a room its node lies."""


def walkable_graph(layout: Layout) -> tuple[FloatArray, IntArray]:
    """Make nodes (n, 2) and edges (e, 2): corridor ends, crossings and door feet, then one node a room."""
    feet, inside = _door_nodes(layout)
    index: dict[tuple[float, float], int] = {}
    edges: list[tuple[int, int]] = []
    for line in layout.corridors:
        points = sorted({tuple(p) for p in np.round(_points_on(line, layout.corridors, feet), 3).tolist()})
        nodes = [index.setdefault((x, y), len(index)) for x, y in points]
        edges += pairwise(nodes)
    corridor_nodes = len(index)
    for i, (x, y) in enumerate(np.round(feet, 3).tolist()):
        edges.append((index[x, y], corridor_nodes + i))
    nodes_xy = np.vstack((np.array(list(index), dtype=np.float64), inside))
    return nodes_xy, np.array(edges, dtype=np.int64)


def dead_end_inset(corridors: FloatArray, width_m: float) -> FloatArray:
    """Keep corridor ends off the outer wall: nobody walks into it."""
    kept = corridors.copy()
    kept[..., 0] = kept[..., 0].clip(DEAD_END_M, width_m - DEAD_END_M)
    return kept


def _door_nodes(layout: Layout) -> tuple[FloatArray, FloatArray]:
    """Foot of each door on the nearest corridor centre line, and the node inside the room."""
    doors = np.array([room.door for room in layout.rooms])
    inward = np.array([room.inward for room in layout.rooms])
    vertical = layout.corridors[:, 0, 0] == layout.corridors[:, 1, 0]
    feet = doors.copy()
    for i, (door, (dx, _)) in enumerate(zip(doors, inward, strict=True)):
        axis = 0 if dx else 1
        lines = layout.corridors[vertical if axis == 0 else ~vertical, 0, axis]
        feet[i, axis] = lines[np.argmin(np.abs(lines - door[axis]))]
    depth = np.array([min(abs(r.rect[2] - r.rect[0]), abs(r.rect[3] - r.rect[1])) for r in layout.rooms])
    return feet, doors + inward * np.minimum(ROOM_STEP_M, depth[:, None] * 0.6)


def _points_on(line: FloatArray, corridors: FloatArray, feet: FloatArray) -> FloatArray:
    """Ends of a corridor, its crossings with the others and the door feet on it."""
    axis = 1 if line[0, 0] == line[1, 0] else 0
    at, low, high = line[0, 1 - axis], line[0, axis], line[1, axis]
    across = corridors[corridors[:, 0, axis] == corridors[:, 1, axis]]
    meets = (across[:, 0, 1 - axis] <= at + 1e-6) & (across[:, 1, 1 - axis] >= at - 1e-6)
    along = np.concatenate(([low, high], across[meets, 0, axis], feet[np.abs(feet[:, 1 - axis] - at) < 1e-3, axis]))
    along = np.unique(np.round(along[(along >= low - 1e-6) & (along <= high + 1e-6)], 3))
    points = np.full((len(along), 2), at)
    points[:, axis] = along
    return points
