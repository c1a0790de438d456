"""How a path is walked: speed over time, steps, and where the phone points."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.simulation.settings import WalkSettings
from vislam2tag.simulation.walking.route import STEP_M, WalkPath

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
"""Standing in the lift while it stands, too."""
PITCH_RAD = -0.3
"""The phone's camera looks down a little while walking."""


def walk_along(
    path: WalkPath, samples: int, settings: WalkSettings, runs_m: FloatArray, rng: np.random.Generator
) -> FloatArray:
    """Walk a path: the distance along it (n,) at :data:`RATE_HZ`; ``runs_m`` (r, 3) are runs: start, end, speed.

    Distance is the path's own parameter, which slows where corners are rounded and stops where the way turns back.
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
    """How long lifts (r,) take to rise (or sink) so far, doors excepted."""
    return np.asarray(np.abs(rise_m) / LIFT_M_PER_S)


def _dwell(time: FloatArray, path: WalkPath, settings: WalkSettings, rng: np.random.Generator) -> FloatArray:
    """Seconds (p,) stood still before each sample: at the start and in pauses."""
    pauses = rng.poisson(settings.pauses_per_minute * time[-1] / 60)
    at = np.concatenate(([1], rng.integers(1, len(time), pauses)))
    held = np.zeros(len(time))
    np.add.at(held, at, np.concatenate(([1.5], rng.uniform(1.0, 5.0, pauses))))
    if settings.look and len(path.landmark_sample):
        np.add.at(held, path.landmark_sample, rng.uniform(0.0, 0.6, len(path.landmark_sample)))
    np.add.at(held, path.lift_sample, lift_seconds(path.lift_rise_m) + DOORS_S)
    stood: FloatArray = np.cumsum(held)
    return stood


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
    """Quaternions (n, 4) of a phone held upright whose camera looks along ``yaw``; raised where ``look`` is 1."""
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
