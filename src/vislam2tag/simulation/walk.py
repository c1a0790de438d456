"""True walks through a building: speed, steps, orientation of the phone, stairs and lifts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.transforms import wrapped
from vislam2tag.simulation.model import FloorTour, SimulatedFloor, TrueWalk
from vislam2tag.simulation.route import STEP_M, WalkPath, lay_floor_tour, make_path
from vislam2tag.simulation.settings import WalkSettings

RATE_HZ = 200.0
STEP_HZ = 1.9
"""Steps a second at 1 m/s; people step faster with the square root of their speed."""
BOB_M = 0.015
"""Amplitude of the vertical bobbing at 1 m/s (3 cm from top to bottom)."""
SWAY_M = 0.012
STAIRS_SLOPE = 0.1
STAIRS_SPEED = 0.6
"""Factor of the horizontal speed on stairs."""
LIFT_M_PER_S = 0.7
"""Mean speed of a lift."""
DOORS_S = 7.0
"""Time for which a lift stands with open doors."""
PITCH_RAD = -0.3
"""The phone's camera looks down a little while walking."""


def walk_along(
    path: WalkPath, samples: int, settings: WalkSettings, runs_m: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Walk a path: the distance along it (n,) at :data:`RATE_HZ`; ``runs_m`` (r, 3) are runs: start, end, speed.

    Distance is the path's own parameter. It slows at rounded corners and stops at points where the path turns back.
    """
    along = np.arange(len(path.points), dtype=np.float64) * STEP_M
    speed = _speed_on_path(path, along, settings, rng)
    for start, stop, running in runs_m:
        speed[(along >= start) & (along < stop)] = running
    speed = np.asarray(gaussian_filter1d(speed, 12, mode="nearest"))
    time = np.concatenate(([0.0], np.cumsum(STEP_M / speed[1:])))
    time += _dwell(time, path, settings, rng)
    clock = np.arange(samples) / RATE_HZ
    return np.asarray(gaussian_filter1d(np.interp(clock, time, along), 0.2 * RATE_HZ, mode="nearest"))


def _speed_on_path(path: WalkPath, along: FloatArray, settings: WalkSettings, rng: np.random.Generator) -> FloatArray:
    """Walking speed (p,) at each sample of a path: own pace, slower in turns and at landmarks, m/s."""
    own = settings.speed_m_s * float(rng.normal(1.1, 0.06))
    knots = np.arange(0.0, along[-1] + 12.0, 6.0)
    spread = 0.3 if settings.straight_corridor else 0.1
    speed = own * np.interp(along, knots, rng.normal(1.0, spread, len(knots)).clip(0.45, 1.7))
    speed /= 1 + 0.6 * np.abs(np.gradient(_direction(path), along)).clip(0, 2)
    if settings.look:
        for sample in path.landmark_sample.tolist():
            near = slice(max(sample - 100, 0), sample + 101)
            speed[near] *= 1 - 0.55 * np.exp(-0.5 * ((along[near] - along[sample]) / 0.5) ** 2)
    if len(path.rise_m):
        speed[np.abs(np.gradient(path.rise_m, along)) > STAIRS_SLOPE] *= STAIRS_SPEED
    return np.asarray(speed.clip(0.2))


def lift_seconds(rise_m: FloatArray) -> FloatArray:
    """Duration of lift rides (r,) over this rise, without doors."""
    return np.asarray(np.abs(rise_m) / LIFT_M_PER_S)


def _dwell(time: FloatArray, path: WalkPath, settings: WalkSettings, rng: np.random.Generator) -> FloatArray:
    """Pauses (p,) before each sample, seconds: at the start and on the way."""
    pauses = rng.poisson(settings.pauses_per_minute * time[-1] / 60)
    at = np.concatenate(([1], rng.integers(1, len(time), pauses)))
    held = np.zeros(len(time))
    np.add.at(held, at, np.concatenate(([1.5], rng.uniform(1.0, 5.0, pauses))))
    if settings.look and len(path.landmark_sample):
        np.add.at(held, path.landmark_sample, rng.uniform(0.0, 0.6, len(path.landmark_sample)))
    np.add.at(held, path.lift_sample, lift_seconds(path.lift_rise_m) + DOORS_S)
    return np.asarray(np.cumsum(held))


def on_path(path: WalkPath, travelled: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Position (n, 2) and direction (n,) of travel (unwrapped, rad) at distances along a path, smooth in time."""
    along = np.arange(len(path.points)) * STEP_M
    position = np.asarray(CubicSpline(along, path.points, axis=0)(travelled))
    heading = np.interp(travelled, along, _direction(path))
    return position, gaussian_filter1d(heading, 0.35 * RATE_HZ, mode="nearest")


def _direction(path: WalkPath) -> FloatArray:
    """Direction (p,) of a path at its samples, unwrapped, rad."""
    dx, dy = np.gradient(path.points, axis=0).T
    return np.unwrap(np.arctan2(dy, dx))


def gait_displacement(speed: FloatArray, heading: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Gait: displacement (n, 3) of the phone by bobbing and swaying, metres."""
    pace = gaussian_filter1d(speed, 0.4 * RATE_HZ, mode="nearest")
    phase = 2 * np.pi * np.cumsum(STEP_HZ * np.sqrt(pace.clip(0))) / RATE_HZ + rng.uniform(0, 2 * np.pi)
    amplitude = np.minimum(pace, 2.5)
    up = BOB_M * amplitude * (np.sin(phase) + 0.15 * np.sin(2 * phase + 0.7))
    side = SWAY_M * np.minimum(amplitude, 1.0) * np.sin(phase / 2)
    ahead = 0.4 * BOB_M * amplitude * np.sin(phase + 1.2)
    cos, sin = np.cos(heading), np.sin(heading)
    return np.column_stack((ahead * cos - side * sin, ahead * sin + side * cos, up))


def look_weight(samples: int, passes: IntArray) -> FloatArray:
    """Weight (n,) of looking at a landmark instead of ahead, about the samples at which one is passed."""
    weight = np.zeros(samples)
    reach = round(2.5 * RATE_HZ)
    for at in passes.tolist():
        span = slice(max(at - reach, 0), min(at + reach, samples))
        t = (np.arange(span.start, span.stop) - at) / RATE_HZ
        bump = 0.5 * (np.tanh((t + 1.0) / 0.25) - np.tanh((t - 0.5) / 0.25))
        weight[span] = np.maximum(weight[span], bump)
    return weight


def phone_orientation(yaw: FloatArray, look: FloatArray, speed: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Quaternions (n, 4) of an upright phone whose camera looks along ``yaw``; raised if ``look`` is 1."""
    wobble = [_slow_noise(len(yaw), spread, rng) for spread in (0.03, 0.04, 0.04)]
    shake = 0.008 * np.minimum(speed, 2.0)
    phase = 2 * np.pi * STEP_HZ * np.arange(len(yaw)) / RATE_HZ
    pitch = PITCH_RAD * (1 - 0.8 * look) + wobble[1] + shake * np.sin(phase)
    angles = np.column_stack((yaw - np.pi / 2 + wobble[0], np.pi / 2 + pitch, wobble[2] + shake * np.sin(phase / 2)))
    return np.asarray(Rotation.from_euler("ZXZ", angles).as_quat())


def _slow_noise(samples: int, spread: float, rng: np.random.Generator) -> FloatArray:
    """Smooth noise (n,) of about half a second's correlation."""
    knots = np.arange(-2, samples / RATE_HZ * 2 + 4)
    spline = CubicSpline(knots / 2, rng.normal(0, spread, len(knots)))
    return np.asarray(spline(np.arange(samples) / RATE_HZ))


START_NS = 40_000_000_000_000
"""Default boot-clock time of a walk's start."""
PRESS_REACH_M = 0.8
"""Control points farther away than this are not pressed at."""


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
    (:func:`~vislam2tag.simulation.model.seen_from_first`).
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
    """Time samples (k,) at which the walk reaches these samples (j,) of the path; those beyond its end are dropped."""
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
    """Time samples (k,) of the closest approach to each control point on the path, and the points' indices (k,)."""
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
    """Start and end samples (b, 2) of the times at which someone blocks the view."""
    share = (np.arange(people) + rng.uniform(0.2, 0.8, people)) / max(people, 1)
    start = ((0.1 + 0.8 * share) * samples).astype(np.int64)
    stop = start + (rng.uniform(2.0, 5.0, people) * RATE_HZ).astype(np.int64)
    return np.asarray(np.minimum(np.column_stack((start, stop)), samples - 1), dtype=np.int64)


def _stairs_climbed(path: WalkPath, travelled: FloatArray) -> FloatArray:
    """Height (n,) climbed by stairs until this distance along a path, smooth in time."""
    rise = np.interp(travelled, np.arange(len(path.points)) * STEP_M, path.rise_m)
    return np.asarray(gaussian_filter1d(rise, 0.3 * RATE_HZ, mode="nearest"))


def _lifts_ridden(path: WalkPath, travelled: FloatArray) -> tuple[FloatArray, IntArray]:
    """Height (n,) gained in lifts until this distance along a path, and the rides' first and last samples (r, 2).

    The lift starts after the first half of the time for its doors.
    """
    gained, rides = np.zeros(len(travelled)), []
    for sample, rise in zip(path.lift_sample.tolist(), path.lift_rise_m.tolist(), strict=True):
        # A person in the lift is between the sample before and this one.
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
