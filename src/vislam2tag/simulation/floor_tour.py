"""Walks over several floors: from corridor to corridor by stairs or lift, and how high one is when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.simulation.choices import Climb
from vislam2tag.simulation.model import FloorTour, SimulatedFloor, seen_from_first
from vislam2tag.simulation.route import STEP_M, Course, WalkPath, course_on, lay_path, room_nodes, sample_at, wander
from vislam2tag.simulation.settings import WalkSettings

STAY_M = (45.0, 75.0)
"""How far one walks on a floor before leaving it; shorter walks leave sooner."""
SHARE_ON_FLOOR = 0.25
"""At most this share of what can be walked at all goes by before the first floor is left."""
FLIGHTS = np.array([(0.0, 0.0), (1.0, 0.0), (4.5, 0.0), (4.5, 1.3), (1.0, 1.3), (0.0, 0.0)])
"""Stairs from a corridor's corner and back to it a storey higher: outwards and sideways, metres."""
FLIGHT_SHARES = np.array([0.0, 0.0, 0.5, 0.5, 1.0, 1.0])
"""Share of the storey climbed at each of these corners."""
CABIN_M = 1.6
"""A lift stands so far out of the corridor's corner."""


@dataclass(frozen=True)
class _TourStage:
    """One part of a tour: a course on a floor, or the way to another one."""

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
    """The nearest corridor node that both floors have: its index on either."""
    apart = np.linalg.norm(floor.nodes[:, None] - other.nodes, axis=2)
    mine, theirs = np.nonzero(apart < STEP_M)
    junction = np.bincount(floor.edges.ravel(), minlength=len(floor.nodes))[mine] > 1
    corridor = junction & ~np.isin(mine, list(room_nodes(floor))) & ~np.isin(theirs, list(room_nodes(other)))
    mine, theirs = mine[corridor], theirs[corridor]
    nearest = int(np.argmin(np.linalg.norm(floor.nodes[mine] - floor.nodes[here], axis=1)))
    return int(mine[nearest]), int(theirs[nearest])


def _shortest(floor: SimulatedFloor, start: int, stop: int) -> IntArray:
    """Nodes (r,) of the shortest way between two nodes, both included."""
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
