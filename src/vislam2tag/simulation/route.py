"""Paths of walks: a route over a floor's graph, the smooth path of a person along it, and tours of several floors.

On a tour the walker changes floors by stairs or lift, and the path contains the height.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.path_length import arc_lengths, points_along
from vislam2tag.simulation.model import FloorTour, SimulatedFloor, seen_from_first
from vislam2tag.simulation.settings import Climb, WalkSettings
from vislam2tag.site.walkable.space import WalkableSpace

STEP_M = 0.02
"""Sampling of a path."""
CORNER_M = 0.4
"""Rounding of corners."""
PASS_M = (0.5, 0.75)
"""Range of the horizontal distance between camera and sheet when a landmark is passed."""
ELBOW_M = 0.3
"""Smallest distance between a walker and the walls of a plan."""
SHARES_ACROSS = (0.2, 0.4, 0.6, 0.8, 1.0)
KEEP_RIGHT_M = (0.05, 0.45)
"""Range of the distance that people keep to the right of the corridor's middle; each has a habit."""


@dataclass(frozen=True)
class WalkPath:
    """A smooth path: ``points`` (p, 2) about every 2 cm, and what it passes, by sample."""

    points: FloatArray
    landmark: IntArray
    """Index of each landmark passed, in order."""
    landmark_sample: IntArray
    point: IntArray
    """Index of each control point passed over, in order."""
    point_sample: IntArray
    rise_m: FloatArray = field(default_factory=lambda: np.empty(0))
    """(p,) height climbed by stairs up to each sample; empty if there are none."""
    lift_sample: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    """Samples at which a lift is taken, in order."""
    lift_rise_m: FloatArray = field(default_factory=lambda: np.empty(0))
    """Rise of each lift."""


@dataclass(frozen=True)
class Course:
    """Straight legs and the things next to them, all by arc length from the start, metres."""

    corners: FloatArray
    """(r, 2) ends of the legs."""
    landmark: IntArray
    landmark_s: FloatArray
    point: IntArray
    point_s: FloatArray
    room_s: FloatArray
    """Arc lengths at which rooms are entered."""

    @property
    def along(self) -> FloatArray:
        """Arc length (r,) of each corner."""
        return arc_lengths(self.corners)


def make_path(floor: SimulatedFloor, length_m: float, settings: WalkSettings, rng: np.random.Generator) -> WalkPath:
    """Lay a path of at least ``length_m`` over the floor's graph, past landmarks and control points."""
    route = _shuttle(floor, length_m) if settings.straight_corridor else wander(floor, length_m, settings, rng)
    return lay_path(course_on(floor, route), floor.landmark_position[:, :2], settings, rng, floor.space)


def course_on(floor: SimulatedFloor, route: IntArray) -> Course:
    """Make the course along a route (r,) of a floor's nodes."""
    corners = floor.nodes[route]
    along = arc_lengths(corners)
    landmarks, landmark_s = _met(floor, floor.landmark_position[:, :2], route, along, 2.0)
    points, point_s = _met(floor, floor.control_points, route, along, 0.4)
    entered = along[np.isin(route, list(room_nodes(floor)))]
    return Course(corners, landmarks, landmark_s, points, point_s, entered)


def lay_path(
    course: Course,
    sheets: FloatArray,
    settings: WalkSettings,
    rng: np.random.Generator,
    space: WalkableSpace | None = None,
) -> WalkPath:
    """Lay the smooth path that a person takes along a course; ``sheets`` (m, 2) are the landmarks it may pass.

    Inside a ``space`` the path keeps an elbow's length from the walls.
    """
    centre_s = np.arange(0.0, course.along[-1], STEP_M)
    centre = gaussian_filter1d(points_along(course.corners, centre_s), CORNER_M / STEP_M, axis=0, mode="nearest")
    landmark_sample = sample_at(course.landmark_s, len(centre))
    normal = _normals(centre)
    offset = _sway(centre_s, settings, rng) * _door_squeeze(course.room_s, centre_s)
    offset = _approach(offset, sheets[course.landmark], centre, normal, landmark_sample, rng)
    if space is not None:
        offset = _kept_inside(offset, centre, normal, space)
    path = gaussian_filter1d(centre + offset[:, None] * normal, 0.2 / STEP_M, axis=0, mode="nearest")
    return WalkPath(path, course.landmark, landmark_sample, course.point, sample_at(course.point_s, len(centre)))


def _kept_inside(offset: FloatArray, centre: FloatArray, normal: FloatArray, space: WalkableSpace) -> FloatArray:
    """Shrink the lateral offset (p,) until each point keeps its distance from walls, or is on the course's own line."""
    kept = np.zeros_like(offset)
    for share in SHARES_ACROSS:
        aside = centre + (share * offset)[:, None] * normal
        kept[space.clearance_at(aside) >= ELBOW_M] = share
    return np.asarray(gaussian_filter1d(offset * kept, 0.2 / STEP_M, mode="nearest"))


def sample_at(arc_m: FloatArray, samples: int) -> IntArray:
    """Sample (k,) of a path with this number of samples at each arc length (k,), metres."""
    return np.asarray((arc_m / STEP_M).astype(np.int64).clip(0, samples - 1))


def wander(
    floor: SimulatedFloor,
    length_m: float,
    settings: WalkSettings,
    rng: np.random.Generator,
    start: int | None = None,
) -> IntArray:
    """Walk the least used corridors first, and sometimes into a room; (r,) node indices.

    Starts at the node ``start``, or at a random one.
    """
    neighbours, rooms = _neighbours(floor), room_nodes(floor)
    used: dict[tuple[int, int], int] = {}
    anywhere = [i for i in range(len(neighbours)) if i not in rooms]
    route = [int(rng.choice(anywhere)) if start is None else start]
    left, before = length_m, -1
    while left > 0:
        here = route[-1]
        options = [n for n in neighbours[here] if n != before] or neighbours[here]
        into_room = [n for n in options if n in rooms]
        onward = [n for n in options if n not in rooms] or options
        if into_room and rng.random() < settings.rooms:
            onward = into_room
        weight = np.array([4.0 ** -used.get((min(here, n), max(here, n)), 0) for n in onward])
        after = int(rng.choice(onward, p=weight / weight.sum()))
        edge = (min(here, after), max(here, after))
        used[edge] = used.get(edge, 0) + 1
        left -= float(np.linalg.norm(floor.nodes[after] - floor.nodes[here]))
        before = here
        route.append(after)
    return np.array(route, dtype=np.int64)


def _shuttle(floor: SimulatedFloor, length_m: float) -> IntArray:
    """Go up and down the whole longest corridor; (r,) node indices."""
    corridor = station_corridor(floor)
    extent = float(np.linalg.norm(floor.nodes[corridor[-1]] - floor.nodes[corridor[0]]))
    laps = int(length_m / extent) + 2
    legs = [corridor if lap % 2 == 0 else corridor[::-1] for lap in range(laps)]
    return np.concatenate([legs[0], *(leg[1:] for leg in legs[1:])])


def station_corridor(floor: SimulatedFloor) -> IntArray:
    """Nodes (r,) along the floor's longest straight corridor, from left to right (the first such from below)."""
    joined = floor.nodes[floor.edges]
    level = joined[np.abs(joined[:, 0, 1] - joined[:, 1, 1]) < 1e-6]
    rows, edges_in_row = np.unique(level[:, 0, 1], return_inverse=True)
    lengths = np.bincount(edges_in_row, np.abs(level[:, 0, 0] - level[:, 1, 0]))
    row = rows[int(np.argmax(lengths.round(2)))]
    inside = np.flatnonzero(np.abs(floor.nodes[:, 1] - row) < 1e-6)
    return inside[np.argsort(floor.nodes[inside, 0])].astype(np.int64)


def _neighbours(floor: SimulatedFloor) -> list[list[int]]:
    neighbours: list[list[int]] = [[] for _ in floor.nodes]
    for a, b in floor.edges.tolist():
        neighbours[a].append(b)
        neighbours[b].append(a)
    return neighbours


def room_nodes(floor: SimulatedFloor) -> set[int]:
    """Nodes inside rooms: those that the floor names, else dead ends at right angles to a corridor."""
    if floor.rooms is not None:
        return set(floor.rooms)
    neighbours = _neighbours(floor)
    rooms = set()
    for node, joined in enumerate(neighbours):
        foot = joined[0]
        spur = floor.nodes[node] - floor.nodes[foot]
        onward = floor.nodes[[n for n in neighbours[foot] if n != node and len(neighbours[n]) > 1]] - floor.nodes[foot]
        if len(joined) == 1 and np.all(np.abs(onward @ spur) < 1e-3 * np.linalg.norm(spur)):
            rooms.add(node)
    return rooms


def _met(
    floor: SimulatedFloor, things: FloatArray, route: IntArray, along: FloatArray, reach_m: float
) -> tuple[IntArray, FloatArray]:
    """Find which things (t, 2) are within ``reach_m`` of the corridor legs of a route (r,): index (k,) and arc length
    (k,), in order.
    """
    start, stop = floor.nodes[route[:-1]], floor.nodes[route[1:]]
    length = np.diff(along)
    spur = np.isin(route, list(room_nodes(floor)))
    unit = (stop - start) / length[:, None]
    offset = things[None] - start[:, None]
    forward = np.einsum("ltk,lk->lt", offset, unit)
    across = np.abs(offset[..., 0] * unit[:, None, 1] - offset[..., 1] * unit[:, None, 0])
    leg, thing = np.nonzero(
        (across < reach_m) & (forward >= 0) & (forward < length[:, None]) & ~(spur[:-1] | spur[1:])[:, None]
    )
    if floor.space is not None:
        feet = start[leg] + forward[leg, thing, None] * unit[leg]
        seen = floor.space.clear_line(feet, things[thing])
        leg, thing = leg[seen], thing[seen]
    arc = along[leg] + forward[leg, thing]
    order = np.argsort(arc, kind="stable")
    return thing[order].astype(np.int64), arc[order]


def _normals(centre: FloatArray) -> FloatArray:
    """Unit vectors (p, 2) to the left of the path."""
    tangent = np.gradient(centre, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True).clip(1e-9)
    return np.asarray(np.column_stack((-tangent[:, 1], tangent[:, 0])))


def _sway(arc: FloatArray, settings: WalkSettings, rng: np.random.Generator) -> FloatArray:
    """Slow wandering (p,) across the corridor, to the right of its middle (positive is left), metres, at arc lengths
    (p,).
    """
    knots = np.arange(0.0, arc[-1] + 8.0, 4.0)
    straight = settings.control_points or settings.straight_corridor
    keep, spread = float(rng.uniform(*KEEP_RIGHT_M)), 0.08 if straight else 0.15
    return np.asarray(np.interp(arc, knots, rng.normal(-keep, spread, len(knots))))


def _door_squeeze(entered: FloatArray, arc: FloatArray) -> FloatArray:
    """Factor (p,) that leads through the middle of doors: 0 when entering or leaving rooms."""
    marks = np.concatenate(([-np.inf], entered, [np.inf]))
    right = np.searchsorted(marks, arc)
    nearest = np.minimum(arc - marks[right - 1], marks[right] - arc)
    return np.asarray(((nearest - 4.2) / 1.5).clip(0, 1))


def _approach(
    offset: FloatArray,
    sheets: FloatArray,
    centre: FloatArray,
    normal: FloatArray,
    samples: IntArray,
    rng: np.random.Generator,
) -> FloatArray:
    """Bend the path towards each passed sheet (k, 2), to an arm's length from it."""
    bent = offset.copy()
    reach = round(3.0 / STEP_M)
    for sheet, sample in zip(sheets, samples.tolist(), strict=True):
        lateral = float((sheet - centre[sample]) @ normal[sample])
        aim = np.sign(lateral) * max(abs(lateral) - rng.uniform(*PASS_M), 0.0)
        span = slice(max(sample - reach, 0), min(sample + reach + 1, len(bent)))
        weight = np.exp(-0.5 * ((np.arange(span.start, span.stop) - sample) * STEP_M / 0.8) ** 2)
        bent[span] += weight * (aim - bent[span])
    return bent


STAY_M = (45.0, 75.0)
"""Range of the distance walked on a floor before the next; shorter walks change earlier."""
SHARE_ON_FLOOR = 0.25
"""At most this share of the whole distance is walked before the first change of floors."""
FLIGHTS = np.array([(0.0, 0.0), (1.0, 0.0), (4.5, 0.0), (4.5, 1.3), (1.0, 1.3), (0.0, 0.0)])
"""Stairs from a corridor's corner to the same corner a storey higher: outwards and sideways, metres."""
FLIGHT_SHARES = np.array([0.0, 0.0, 0.5, 0.5, 1.0, 1.0])
"""Share of the storey climbed at each of these corners."""
CABIN_M = 1.6
"""Distance of a lift from the corridor's corner."""


@dataclass(frozen=True)
class _TourStage:
    """One part of a tour: a course on a floor, or the path to another one."""

    course: Course
    rise_m: FloatArray
    """(r,) height climbed by stairs at each of its corners, from its start."""
    lift_s: float | None = None
    """Arc length at which a lift is taken."""
    lift_rise_m: float = 0.0


def lay_floor_tour(tour: FloorTour, length_m: float, settings: WalkSettings, rng: np.random.Generator) -> WalkPath:
    """Lay a path of at least ``length_m`` over the floors of a tour, which need a node in common."""
    parts: list[_TourStage] = []
    here, start, left = 0, None, length_m
    while left > 0:
        floor = tour.floors[here]
        stay = min(float(rng.uniform(*STAY_M)), SHARE_ON_FLOOR * length_m / 2)
        route = wander(floor, stay, settings, rng, start)
        there = _next_floor(tour, here, rng)
        leave, start = _stairwell(floor, tour.floors[there], int(route[-1]))
        course = course_on(floor, np.concatenate((route, _shortest(floor, int(route[-1]), leave)[1:])))
        first = sum(len(other.landmark_ids) for other in tour.floors[:here])
        parts.append(_TourStage(replace(course, landmark=course.landmark + first), np.zeros(len(course.corners))))
        parts.append(_stairs_or_lift(floor, leave, float(tour.rise_m[there] - tour.rise_m[here]), tour.climb, rng))
        left -= float(parts[-1].course.along[-1] + course.along[-1])
        here = there
    return _joined(parts, seen_from_first(tour).landmark_position[:, :2], settings, rng)


def _next_floor(tour: FloorTour, here: int, rng: np.random.Generator) -> int:
    """Index of a neighbouring floor by height."""
    order = np.argsort(tour.rise_m, kind="stable")
    rank = int(np.flatnonzero(order == here)[0])
    return int(rng.choice([order[r] for r in (rank - 1, rank + 1) if 0 <= r < len(order)]))


def _stairwell(floor: SimulatedFloor, other: SimulatedFloor, here: int) -> tuple[int, int]:
    """The nearest corridor node that both floors have: its index on each."""
    apart = np.linalg.norm(floor.nodes[:, None] - other.nodes, axis=2)
    mine, theirs = np.nonzero(apart < STEP_M)
    junction = np.bincount(floor.edges.ravel(), minlength=len(floor.nodes))[mine] > 1
    corridor = junction & ~np.isin(mine, list(room_nodes(floor))) & ~np.isin(theirs, list(room_nodes(other)))
    mine, theirs = mine[corridor], theirs[corridor]
    nearest = int(np.argmin(np.linalg.norm(floor.nodes[mine] - floor.nodes[here], axis=1)))
    return int(mine[nearest]), int(theirs[nearest])


def _shortest(floor: SimulatedFloor, start: int, stop: int) -> IntArray:
    """Nodes (r,) of the shortest path between two nodes, including both."""
    a, b = floor.edges.T
    length = np.linalg.norm(floor.nodes[a] - floor.nodes[b], axis=1)
    graph = csr_array((length, (a, b)), shape=(len(floor.nodes), len(floor.nodes)))
    _, before = dijkstra(graph, directed=False, indices=[start], return_predecessors=True)
    way = [stop]
    while way[-1] != start:
        way.append(int(before[0, way[-1]]))
    return np.array(way[::-1], dtype=np.int64)


def _stairs_or_lift(
    floor: SimulatedFloor, node: int, rise_m: float, climb: Climb, rng: np.random.Generator
) -> _TourStage:
    """From a corridor's corner to the same corner of another floor, away from the building's middle."""
    corner = floor.nodes[node]
    outwards = 1.0 if corner[0] > floor.width_m / 2 else -1.0
    by_lift = climb is Climb.LIFT or (climb is Climb.MIXED and bool(rng.random() < 0.5))
    if not by_lift:
        return _TourStage(_bare_course(corner + FLIGHTS * (outwards, 1.0)), FLIGHT_SHARES * rise_m)
    cabin = corner + np.array((outwards * CABIN_M, 0.0))
    return _TourStage(_bare_course(np.array([corner, cabin, corner])), np.zeros(3), CABIN_M, rise_m)


def _bare_course(corners: FloatArray) -> Course:
    """A course along corners (r, 2) that passes nothing."""
    nothing, nowhere = np.empty(0, dtype=np.int64), np.empty(0)
    return Course(corners, nothing, nowhere, nothing, nowhere, nowhere)


def _joined(
    stages: Sequence[_TourStage], sheets: FloatArray, settings: WalkSettings, rng: np.random.Generator
) -> WalkPath:
    """One path along all stages, one after the other, past the sheets (m, 2)."""
    lengths = [float(stage.course.along[-1]) for stage in stages]
    start = np.concatenate(([0.0], np.cumsum(lengths)))[:-1]
    climbed = np.concatenate(([0.0], np.cumsum([stage.rise_m[-1] for stage in stages])))[:-1]
    course = Course(
        corners=np.vstack([stage.course.corners for stage in stages]),
        landmark=np.concatenate([stage.course.landmark for stage in stages]),
        landmark_s=np.concatenate([stage.course.landmark_s + s for stage, s in zip(stages, start, strict=True)]),
        point=np.empty(0, dtype=np.int64),
        point_s=np.empty(0),
        room_s=np.concatenate([stage.course.room_s + s for stage, s in zip(stages, start, strict=True)]),
    )
    path = lay_path(course, sheets, settings, rng)
    rise = np.concatenate([stage.rise_m + r for stage, r in zip(stages, climbed, strict=True)])
    lifts = [(s + stage.lift_s, stage.lift_rise_m) for stage, s in zip(stages, start, strict=True) if stage.lift_s]
    lift_s, lift_rise = np.array(lifts).reshape(-1, 2).T
    return replace(
        path,
        rise_m=np.interp(np.arange(len(path.points)) * STEP_M, course.along, rise),
        lift_sample=sample_at(lift_s, len(path.points)),
        lift_rise_m=lift_rise,
    )
