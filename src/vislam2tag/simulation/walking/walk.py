"""True walks through a building."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.orientation import wrapped
from vislam2tag.simulation.model import SimulatedFloor, TrueWalk
from vislam2tag.simulation.settings import WalkSettings
from vislam2tag.simulation.walking.floor_tour import FloorTour, lay_floor_tour
from vislam2tag.simulation.walking.gait import (
    DOORS_S,
    RATE_HZ,
    gait_displacement,
    lift_seconds,
    look_weight,
    on_path,
    phone_orientation,
    walk_along,
)
from vislam2tag.simulation.walking.route import STEP_M, WalkPath, make_path

START_NS = 40_000_000_000_000
"""Boot-clock time of a walk's start where none is given."""
PRESS_REACH_M = 0.8
"""A control point farther off than this is not pressed at."""


def make_walk(
    floor: SimulatedFloor,
    duration_s: float,
    settings: WalkSettings,
    rng: np.random.Generator,
    start_ns: int = START_NS,
    tour: FloorTour | None = None,
) -> TrueWalk:
    """Walk ``duration_s`` seconds over a floor, past its landmarks, sampled at 200 Hz from ``start_ns`` on.

    On a ``tour`` the walk goes over all its floors; ``floor`` is then the first with all landmarks on it
    (:func:`~vislam2tag.simulation.walking.floor_tour.seen_from_first`).
    """
    samples = round(duration_s * RATE_HZ) + 1
    runs = _runs(duration_s, settings, rng)
    longest = duration_s * settings.speed_m_s * 1.9 + float((runs[:, 1] - runs[:, 0]).sum())
    path = make_path(floor, longest, settings, rng) if tour is None else lay_floor_tour(tour, longest, settings, rng)
    travelled = walk_along(path, samples, settings, runs, rng)
    plane, heading = on_path(path, travelled)
    speed = np.linalg.norm(np.gradient(plane, 1 / RATE_HZ, axis=0), axis=1)
    passes = _reached(travelled, path.landmark_sample)
    passed = path.landmark[: len(passes)]
    look = look_weight(samples, passes) if settings.look else np.zeros(samples)
    yaw = _turn_to_sheets(heading, look, plane, floor, passes, passed)
    carried = np.column_stack((plane, np.full(samples, rng.normal(1.37, 0.03))))
    time_ns = start_ns + np.arange(samples, dtype=np.int64) * round(1e9 / RATE_HZ)
    presses, points = _presses(floor, path, travelled, plane) if settings.control_points else (passes[:0], passes[:0])
    walk = TrueWalk(
        floor=floor.number,
        rate_hz=RATE_HZ,
        time_ns=time_ns,
        position=carried + gait_displacement(speed, heading, rng),
        orientation=phone_orientation(yaw, look, speed, rng),
        speed=speed,
        presses_ns=time_ns[presses],
        pressed_point=points,
        landmarks_passed=passed,
        blocked_ns=time_ns[_blocked(samples, settings.people, rng)],
    )
    return walk if tour is None else _with_climbs(walk, tour, path, travelled)


def _with_climbs(walk: TrueWalk, tour: FloorTour, path: WalkPath, travelled: FloatArray) -> TrueWalk:
    """Lift a walk by the stairs and lifts on its way; ``travelled`` (n,) metres along the path."""
    ridden, rides = _lifts_ridden(path, travelled)
    rise = _stairs_climbed(path, travelled) + ridden
    return replace(
        walk,
        position=walk.position + np.column_stack((np.zeros((len(rise), 2)), rise)),
        floor_at=_floor_of(tour, rise),
        unseen_m=ridden,
        rides_ns=walk.time_ns[rides],
    )


def _runs(duration_s: float, settings: WalkSettings, rng: np.random.Generator) -> FloatArray:
    """Running stretches (r, 3): start and end along the path, metres, and speed, m/s; in the walk's middle part."""
    count = settings.runs
    share = (np.arange(count) + rng.uniform(0.2, 0.8, count)) / max(count, 1)
    start = (0.15 + 0.6 * share) * duration_s * settings.speed_m_s * 0.75
    speed = rng.uniform(2.0, 3.0, count)
    return np.column_stack((start, start + speed * rng.uniform(5.0, 9.0, count), speed))


def _reached(travelled: FloatArray, path_samples: IntArray) -> IntArray:
    """Time samples (k,) at which the walk reaches these samples (j,) of the path; those beyond its end are left out."""
    marks = path_samples * STEP_M
    return np.asarray(np.searchsorted(travelled, marks[marks < travelled[-1]]), dtype=np.int64)


def _turn_to_sheets(
    heading: FloatArray, look: FloatArray, plane: FloatArray, floor: SimulatedFloor, passes: IntArray, passed: IntArray
) -> FloatArray:
    """Camera yaw (n,): ahead, and towards the nearest landmark in time by the weight ``look``."""
    if not len(passes):
        return heading
    middles = (passes[1:] + passes[:-1]) / 2
    nearest = passed[np.searchsorted(middles, np.arange(len(heading)))]
    to_sheet = floor.landmark_position[nearest, :2] - plane
    bearing = np.arctan2(to_sheet[:, 1], to_sheet[:, 0])
    turn = wrapped(bearing - heading)
    return np.asarray(gaussian_filter1d(heading + look * turn, 0.12 * RATE_HZ, mode="nearest"))


def _presses(
    floor: SimulatedFloor, path: WalkPath, travelled: FloatArray, plane: FloatArray
) -> tuple[IntArray, IntArray]:
    """Time samples (k,) of the closest approach to each control point passed over, and the points' indices (k,)."""
    reached = _reached(travelled, path.point_sample)
    points = path.point[: len(reached)]
    window = round(1.5 * RATE_HZ)
    samples, near = np.zeros_like(reached), np.zeros(len(reached), dtype=np.bool_)
    for i, (at, point) in enumerate(zip(reached.tolist(), points.tolist(), strict=True)):
        first = max(at - window, 0)
        off = np.linalg.norm(plane[first : at + window] - floor.control_points[point], axis=1)
        samples[i], near[i] = first + int(np.argmin(off)), off.min() < PRESS_REACH_M
    return samples[near], points[near]


def _blocked(samples: int, people: int, rng: np.random.Generator) -> IntArray:
    """Start and end samples (b, 2) of the times at which somebody blocks the view."""
    share = (np.arange(people) + rng.uniform(0.2, 0.8, people)) / max(people, 1)
    start = ((0.1 + 0.8 * share) * samples).astype(np.int64)
    stop = start + (rng.uniform(2.0, 5.0, people) * RATE_HZ).astype(np.int64)
    return np.asarray(np.minimum(np.column_stack((start, stop)), samples - 1), dtype=np.int64)


def _stairs_climbed(path: WalkPath, travelled: FloatArray) -> FloatArray:
    """Height (n,) climbed by stairs when so far along a path, smooth in time."""
    rise = np.interp(travelled, np.arange(len(path.points)) * STEP_M, path.rise_m)
    return np.asarray(gaussian_filter1d(rise, 0.3 * RATE_HZ, mode="nearest"))


def _lifts_ridden(path: WalkPath, travelled: FloatArray) -> tuple[FloatArray, IntArray]:
    """Height (n,) gained in lifts when so far along a path, and the rides' first and last samples (r, 2).

    The lift moves off when the first half of the time for its doors has passed.
    """
    gained, rides = np.zeros(len(travelled)), []
    for sample, rise in zip(path.lift_sample.tolist(), path.lift_rise_m.tolist(), strict=True):
        # Who stands is held between the sample before and this one.
        entered = int(np.searchsorted(travelled, (sample - 0.95) * STEP_M))
        since = (np.arange(len(travelled)) - entered) / RATE_HZ - DOORS_S / 2
        share = (since / float(lift_seconds(np.array(rise)))).clip(0, 1)
        gained += rise * share**3 * (10 - 15 * share + 6 * share**2)
        moving = np.flatnonzero((share > 0) & (share < 1))
        if len(moving):
            rides.append((moving[0], moving[-1]))
    return gained, np.array(rides, dtype=np.int64).reshape(-1, 2)


def _floor_of(tour: FloorTour, rise_m: FloatArray) -> IntArray:
    """Number (n,) of the floor nearest to each height (n,) above the first floor."""
    numbers = np.array([floor.number for floor in tour.floors], dtype=np.int64)
    order = np.argsort(tour.rise_m, kind="stable")
    levels = tour.rise_m[order]
    return numbers[order][np.searchsorted((levels[1:] + levels[:-1]) / 2, rise_m)]
