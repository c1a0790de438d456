"""The ways on a floor that comes from a plan: straight edges, led past every landmark that hangs off the middle."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.site.walkable.graph import CorridorGraph, NodeKind
from vislam2tag.site.walkable.space import WalkableSpace

PASSED_M = 1.8
"""Who walks by a sheet within this distance passes it without leaving the way."""
STAND_M = 0.9
"""Distance from a sheet at which a way that leads past it does so."""
_BESIDE_M = 0.7
"""The way leads along the sheet for so far on both sides."""
_LEAVE_M = 3.0
"""A way is left for a sheet so far before it, along the way."""
_FARTHEST_M = 12.0
"""No way is left for a sheet farther off than this."""


@dataclass(frozen=True)
class SitePaths:
    """Nodes (n, 2), straight edges (e, 2), the nodes in rooms and doors of rooms, and landmarks that no way passes."""

    nodes: FloatArray
    edges: IntArray
    rooms: frozenset[int]
    missed: tuple[int, ...]


def site_paths(graph: CorridorGraph, space: WalkableSpace, sheets: FloatArray, heading_rad: FloatArray) -> SitePaths:
    """Make the ways of a graph that lead past the sheets (m, 2); ``heading_rad`` (m,) is each one's X axis."""
    lines = {edge: line for edge, line in enumerate(graph.polylines) if not graph.shortcut[edge]}
    missed = []
    for landmark, (sheet, heading) in enumerate(zip(sheets, heading_rad.tolist(), strict=True)):
        if not _lead_past(lines, graph, space, sheet, np.array((np.cos(heading), np.sin(heading)))):
            missed.append(landmark)
    return _straight(lines, graph, tuple(missed))


def _lead_past(
    lines: dict[int, FloatArray], graph: CorridorGraph, space: WalkableSpace, sheet: FloatArray, along: FloatArray
) -> bool:
    """Lead the nearest line (k, 2) from which a sheet (2,) can be seen past it, by the wall's direction (2,); whether
    there is one.
    """
    feet = {edge: _foot(line, sheet) for edge, line in lines.items()}
    # Rooms come last: a walk looks into few of them.
    order = sorted(feet, key=lambda edge: (bool(graph.in_room[edge]), feet[edge][1], edge))
    for edge in order:
        arc, off = feet[edge]
        if off > _FARTHEST_M:
            continue
        foot = _at(lines[edge], arc)
        if not space.clear_line(foot, sheet)[0]:
            continue
        if off <= PASSED_M:
            return True
        detour = _detour(lines[edge], arc, sheet, along)
        if space.clear_line(detour[:-1], detour[1:]).all() and space.inside(detour).all():
            lines[edge] = detour
            return True
    return False


def _detour(line: FloatArray, arc: float, sheet: FloatArray, along: FloatArray) -> FloatArray:
    """A line (j, 2) that leaves another one (k, 2) for a sheet (2,), leads along it and returns."""
    length = float(arc_lengths(line)[-1])
    leave, rejoin = max(arc - _LEAVE_M, 0.0), min(arc + _LEAVE_M, length)
    outward = np.array((along[1], -along[0]))
    stand = sheet + STAND_M * outward
    onward = np.sign(float((_at(line, rejoin) - _at(line, leave)) @ along)) or 1.0
    beside = np.array([stand - onward * _BESIDE_M * along, stand + onward * _BESIDE_M * along])
    arcs = arc_lengths(line)
    before, after = line[arcs < leave - 1e-6], line[arcs > rejoin + 1e-6]
    return np.vstack((before, _at(line, leave), beside, _at(line, rejoin), after))


def _foot(line: FloatArray, point: FloatArray) -> tuple[float, float]:
    """Arc length of the point of a line (k, 2) nearest to a place (2,), and how far off it is, metres."""
    start, legs = line[:-1], np.diff(line, axis=0)
    length = np.linalg.norm(legs, axis=1).clip(1e-9)
    share = (np.einsum("lk,lk->l", point - start, legs) / length**2).clip(0, 1)
    off = np.linalg.norm(start + share[:, None] * legs - point, axis=1)
    nearest = int(off.argmin())
    return float(arc_lengths(line)[nearest] + share[nearest] * length[nearest]), float(off[nearest])


def _at(line: FloatArray, arc: float) -> FloatArray:
    """Point (2,) of a line (k, 2) at an arc length, metres."""
    arcs = arc_lengths(line)
    return np.array([np.interp(arc, arcs, line[:, axis]) for axis in (0, 1)])


def _straight(lines: dict[int, FloatArray], graph: CorridorGraph, missed: tuple[int, ...]) -> SitePaths:
    """Make every corner of the lines, (k, 2) each, a node."""
    nodes = list(graph.nodes)
    edges: list[tuple[int, int]] = []
    rooms = {node for node, kind in enumerate(graph.kinds) if kind is NodeKind.ROOM}
    for edge, line in lines.items():
        first, last = graph.edges[edge].tolist()
        corners = [first, *range(len(nodes), len(nodes) + len(line) - 2), last]
        nodes += list(line[1:-1])
        # An edge of no length has no direction.
        edges += [pair for pair in pairwise(corners) if np.linalg.norm(nodes[pair[0]] - nodes[pair[1]]) > 1e-6]
        if graph.in_room[edge]:
            rooms.update(corners[1:-1], (end for end in (first, last) if graph.kinds[end] is NodeKind.DOOR))
    return SitePaths(np.array(nodes), np.array(edges, dtype=np.int64), frozenset(rooms), missed)
