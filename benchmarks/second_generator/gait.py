"""How somebody walks a route, and at what times the phone has frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d, label

from second_generator.habits import Gait
from second_generator.random_numbers import wander
from second_generator.route import STEP_M
from vislam2tag.core.arrays import ComplexArray, FloatArray

CLOCK_HZ = 10
STANDS_WITHIN_M = 1.2


@dataclass(frozen=True)
class Motion:
    """True motion, ``n`` frames."""

    time_s: FloatArray
    """(n,) strictly increasing."""
    place: ComplexArray
    """(n,) BCS metres."""
    course_rad: FloatArray
    """(n,) direction of the route."""


def walk_route(route: ComplexArray, sheets: ComplexArray, gait: Gait, rng: np.random.Generator) -> Motion:
    """Walk a route (r,) past sheets (m,): with changing pace, pauses, a wandering line, sway of steps and hand."""
    time_s = _frame_times(gait, rng)
    clock = np.arange(0, gait.duration_s + 0.2, 1 / CLOCK_HZ)
    walked = _walked(clock, route, sheets, gait, rng)
    at = np.interp(time_s, clock, walked) / STEP_M
    forward = _along(route_tangent(route), at)
    aside = gaussian_filter1d(rng.standard_normal(len(route)), 3.0 / STEP_M)
    aside *= rng.uniform(0.03, 0.25) / aside.std()
    moving = np.clip(np.gradient(at * STEP_M, time_s) / gait.speed_mps, 0, 1)
    step_phase = np.cumsum(2 * np.pi * rng.uniform(0.8, 1.0) * np.diff(time_s, prepend=time_s[0]))
    sway = rng.uniform(0.01, 0.04) * np.sin(step_phase) * moving
    hand = wander(time_s, 1.5, rng) * rng.uniform(0.01, 0.05) + 1j * wander(time_s, 1.5, rng) * 0.02
    left = np.interp(at, np.arange(len(route)), aside) + sway
    return Motion(time_s, _along(route, at) + 1j * forward * left + hand, np.angle(forward))


def route_tangent(route: ComplexArray) -> ComplexArray:
    """Direction of a route at each of its points (r,), of size 1 except where it turns back."""
    tangent = gaussian_filter1d(np.gradient(route), 0.2 / STEP_M)
    return np.asarray(tangent / np.maximum(abs(tangent), 1e-6))


def _along(values: ComplexArray, at: FloatArray) -> ComplexArray:
    """Interpolate values (r,) at fractional indices (n,)."""
    index = np.arange(len(values))
    return np.asarray(np.interp(at, index, values.real) + 1j * np.interp(at, index, values.imag))


def _frame_times(gait: Gait, rng: np.random.Generator) -> FloatArray:
    number = int(gait.duration_s * gait.rate_hz)
    late = (gait.jitter * rng.standard_normal(number)).clip(-0.45, 0.45)
    time_s = (np.arange(number) + late) / gait.rate_hz
    for start in rng.uniform(0, gait.duration_s, rng.poisson(gait.holes_per_min * gait.duration_s / 60)):
        time_s = time_s[(time_s < start) | (time_s > start + rng.exponential(0.4))]
    return np.asarray(time_s)


def _walked(
    clock: FloatArray, route: ComplexArray, sheets: ComplexArray, gait: Gait, rng: np.random.Generator
) -> FloatArray:
    """Metres along the route at the times of a clock (c,)."""
    pace = gait.speed_mps * np.exp(0.8 * gaussian_filter1d(rng.standard_normal(len(clock)), 4.0 * CLOCK_HZ))
    for start in rng.uniform(0, gait.duration_s, rng.poisson(gait.pauses_per_min * gait.duration_s / 60)):
        pace[(clock > start) & (clock < start + rng.exponential(4))] = 0
    walked = np.concatenate(([0.0], np.cumsum(pace[:-1]) / CLOCK_HZ))
    for stop in nearest_points(route, sheets):
        i = int(np.searchsorted(walked, stop))
        if rng.random() < gait.stands_at_sheet and 0 < i < len(walked):
            pause = np.full(int(CLOCK_HZ * rng.uniform(0.5, 4)), walked[i])
            walked = np.concatenate((walked[:i], pause, walked[i:]))[: len(walked)]
    return np.asarray(gaussian_filter1d(walked, 0.3 * CLOCK_HZ, mode="nearest").clip(0, (len(route) - 2) * STEP_M))


def nearest_points(route: ComplexArray, sheets: ComplexArray) -> list[float]:
    """Metres along the route where it comes nearest to a sheet each time that it passes one, ascending."""
    every = 10
    apart = abs(route[::every, None] - sheets)
    stops: list[float] = []
    for away in apart.T:
        stretch, number = label(away < STANDS_WITHIN_M)
        passes = (np.flatnonzero(stretch == one) for one in range(1, number + 1))
        stops += [float(near[np.argmin(away[near])]) * every * STEP_M for near in passes]
    return sorted(stops)
