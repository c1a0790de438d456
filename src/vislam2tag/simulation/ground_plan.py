"""The ground plan of a generated floor: corridors, rooms, doors and walls, all along the axes."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.simulation.settings import BuildingSettings

Rect = tuple[float, float, float, float]
"""x0, y0, x1, y1 in metres."""
Interval = tuple[float, float]

DOOR_M = 1.0
JOINT_M = 2e-3
"""Edges closer than this are one: coordinates are compared to the millimetre."""
DEAD_END_M = 0.9
"""Distance from the outer wall at which people turn at a dead end."""


@dataclass(frozen=True)
class Room:
    """A room and the door to its corridor."""

    rect: Rect
    door: tuple[float, float]
    """Middle of the door, on the corridor's wall."""
    inward: tuple[float, float]
    """Unit vector through the door into the room."""


@dataclass(frozen=True)
class GroundPlan:
    """Corridor centre lines (c, 2, 2), the rooms along them and wall segments (w, 2, 2), metres."""

    corridors: FloatArray
    rooms: tuple[Room, ...]
    walls: FloatArray


def make_ground_plan(settings: BuildingSettings, rng: np.random.Generator) -> GroundPlan:
    """Draw a ring of corridors with cross corridors and dead ends, rooms outside and inside of it."""
    width, height, half = settings.width_m, settings.height_m, settings.corridor_width_m / 2
    inset = settings.room_depth_m + half
    open_corners = set(rng.permutation(4)[: settings.dead_ends].tolist())
    left, right = inset, width - inset
    low, high = inset, height - inset
    ends = [0.0 if 0 in open_corners else left, width if 1 in open_corners else right]
    ends += [0.0 if 2 in open_corners else left, width if 3 in open_corners else right]
    count = settings.cross_corridors
    steps = np.linspace(left, right, count + 2)[1:-1]
    crosses = (steps + rng.uniform(-0.12, 0.12, count) * (right - left) / (count + 1)).round(2).tolist()
    lines = [((ends[0], low), (ends[1], low)), ((ends[2], high), (ends[3], high))]
    lines += [((x, low), (x, high)) for x in (left, *crosses, right)]
    corridors = np.array(lines, dtype=np.float64)
    rooms = _outer_rooms(settings, inset, open_corners, rng) + _inner_rooms(settings, inset, crosses, rng)
    return GroundPlan(corridors, tuple(rooms), _walls(settings, corridors, rooms))


def corridor_rects(corridors: FloatArray, half_m: float, width_m: float) -> list[Rect]:
    """Floor area of each corridor (c, 2, 2); ends reach half a width further, but not through the outer wall."""
    low, high = corridors.min(axis=1) - half_m, corridors.max(axis=1) + half_m
    low[:, 0], high[:, 0] = low[:, 0].clip(min=0.0), high[:, 0].clip(max=width_m)
    return [(x0, y0, x1, y1) for (x0, y0), (x1, y1) in zip(low.tolist(), high.tolist(), strict=True)]


def _cuts(low: float, high: float, ends: tuple[float, float], width: float, rng: np.random.Generator) -> list[float]:
    """Cut a strip into rooms of about ``width``; the first and last are longer by ``ends``."""
    inner = high - low - ends[0] - ends[1]
    count = max(1, round(inner / width))
    shares = np.cumsum(rng.uniform(0.75, 1.25, count))
    cuts = low + ends[0] + inner * shares / shares[-1]
    return [low, *cuts[:-1].round(3).tolist(), high]


def _strip(
    span: Interval,
    across: Interval,
    door_at: float,
    ends: tuple[float, float],
    vertical: bool,
    width: float,
    rng: np.random.Generator,
) -> list[Room]:
    """Rooms side by side along a corridor wall; ``door_at`` is that wall's coordinate across the strip."""
    cuts = _cuts(*span, ends, width, rng)
    rooms = []
    for start, stop in pairwise(cuts):
        low = max(start, span[0] + ends[0]) + 0.8
        high = min(stop, span[1] - ends[1]) - 0.8
        along = round(float(rng.uniform(low, high)), 3)
        inward = 1.0 if across[1] > door_at + 1e-9 else -1.0
        if vertical:
            rooms.append(Room((across[0], start, across[1], stop), (door_at, along), (inward, 0.0)))
        else:
            rooms.append(Room((start, across[0], stop, across[1]), (along, door_at), (0.0, inward)))
    return rooms


def _outer_rooms(
    settings: BuildingSettings, inset: float, open_corners: set[int], rng: np.random.Generator
) -> list[Room]:
    width, height, half = settings.width_m, settings.height_m, settings.corridor_width_m / 2
    depth, room = inset - half, settings.room_width_m
    rooms: list[Room] = []
    for corner, across, wall in ((0, (0.0, depth), depth), (2, (height - depth, height), height - depth)):
        corners = tuple(DEAD_END_M if corner + side in open_corners else inset for side in (0, 1))
        rooms += _strip((0.0, width), across, wall, (corners[0], corners[1]), False, room, rng)
    for side, across, wall in ((0, (0.0, depth), depth), (1, (width - depth, width), width - depth)):
        span = [inset + half if side + corner in open_corners else depth for corner in (0, 2)]
        longer = [0.0 if side + corner in open_corners else half for corner in (0, 2)]
        rooms += _strip((span[0], height - span[1]), across, wall, (longer[0], longer[1]), True, room, rng)
    return rooms


def _inner_rooms(
    settings: BuildingSettings, inset: float, crosses: list[float], rng: np.random.Generator
) -> list[Room]:
    half = settings.corridor_width_m / 2
    low, high = inset + half, settings.height_m - inset - half
    middle = round((low + high) / 2, 3)
    verticals = [inset, *crosses, settings.width_m - inset]
    rooms: list[Room] = []
    for x0, x1 in pairwise(verticals):
        span = (round(x0 + half, 3), round(x1 - half, 3))
        rooms += _strip(span, (low, middle), low, (0.0, 0.0), False, settings.room_width_m, rng)
        rooms += _strip(span, (middle, high), high, (0.0, 0.0), False, settings.room_width_m, rng)
    return rooms


def _walls(settings: BuildingSettings, corridors: FloatArray, rooms: list[Room]) -> FloatArray:
    """All edges (w, 2, 2) of rooms and corridors (c, 2, 2), joined where they overlap, without corridor openings and
    doors.
    """
    floors = corridor_rects(corridors, settings.corridor_width_m / 2, settings.width_m)
    lines: dict[tuple[int, float], list[Interval]] = defaultdict(list)
    for x0, y0, x1, y1 in [*(room.rect for room in rooms), *floors, (0.0, 0.0, settings.width_m, settings.height_m)]:
        for axis, at, span in ((0, x0, (y0, y1)), (0, x1, (y0, y1)), (1, y0, (x0, x1)), (1, y1, (x0, x1))):
            lines[axis, round(at, 3)].append(span)
    segments = []
    for (axis, at), spans in lines.items():
        gaps = [(r[1 - axis], r[3 - axis]) for r in floors if r[axis] + JOINT_M < at < r[2 + axis] - JOINT_M]
        gaps += [
            (room.door[1 - axis] - DOOR_M / 2, room.door[1 - axis] + DOOR_M / 2)
            for room in rooms
            if abs(room.door[axis] - at) < JOINT_M and room.inward[axis] != 0
        ]
        for start, stop in _subtract(_union(spans), gaps):
            ends = ((at, start), (at, stop)) if axis == 0 else ((start, at), (stop, at))
            segments.append(ends)
    return np.array(segments, dtype=np.float64)


def _union(spans: list[Interval]) -> list[Interval]:
    joined: list[Interval] = []
    for start, stop in sorted(spans):
        if joined and start <= joined[-1][1] + JOINT_M:
            joined[-1] = (joined[-1][0], max(stop, joined[-1][1]))
        else:
            joined.append((start, stop))
    return joined


def _subtract(spans: list[Interval], gaps: list[Interval]) -> list[Interval]:
    left = spans
    for low, high in gaps:
        cut = [piece for start, stop in left for piece in ((start, min(stop, low)), (max(start, high), stop))]
        left = [(start, stop) for start, stop in cut if stop - start > JOINT_M]
    return left


ROOM_STEP_M = 2.6
"""Distance of a room's node from its door."""


def walkable_graph(layout: GroundPlan) -> tuple[FloatArray, IntArray]:
    """Make nodes (n, 2) and edges (e, 2): corridor ends, crossings and door feet, then one node for each room."""
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
    """Move the ends of corridors (c, 2, 2) away from the outer wall, so that walkers turn before it."""
    kept = corridors.copy()
    kept[..., 0] = kept[..., 0].clip(DEAD_END_M, width_m - DEAD_END_M)
    return kept


def _door_nodes(layout: GroundPlan) -> tuple[FloatArray, FloatArray]:
    """Foot (r, 2) of each door on the nearest corridor centre line, and the node (r, 2) inside the room."""
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
    """Points (n, 2): ends of a corridor (2, 2), crossings with others (c, 2, 2) and the door feet (r, 2) on it."""
    axis = 1 if line[0, 0] == line[1, 0] else 0
    at, low, high = line[0, 1 - axis], line[0, axis], line[1, axis]
    across = corridors[corridors[:, 0, axis] == corridors[:, 1, axis]]
    meets = (across[:, 0, 1 - axis] <= at + 1e-6) & (across[:, 1, 1 - axis] >= at - 1e-6)
    along = np.concatenate(([low, high], across[meets, 0, axis], feet[np.abs(feet[:, 1 - axis] - at) < 1e-3, axis]))
    along = np.unique(np.round(along[(along >= low - 1e-6) & (along <= high + 1e-6)], 3))
    points = np.full((len(along), 2), at)
    points[:, axis] = along
    return points
