"""Dead reckoning: what the tracker makes of the motion before any landmark or event."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from second_generator.gait import Motion
from second_generator.habits import Drift, Gait, Losses
from second_generator.random_numbers import normal_plane, wander
from vislam2tag.core.arrays import ComplexArray

Stretch = tuple[int, int]
"""Frames from the first (included) to the second (excluded)."""


@dataclass(frozen=True)
class Odometry:
    """Dead reckoning, ``n`` frames."""

    place: ComplexArray
    """(n,) metres in a frame of its own."""
    from_bcs: ComplexArray
    """(n,) scale and turn of small BCS vectors into that frame."""


def dead_reckoning(motion: Motion, drift: Drift, rng: np.random.Generator) -> Odometry:
    """Add up true steps that are turned, stretched and blurred by the drift; the first heading is any."""
    time_s, number = motion.time_s, len(motion.time_s)
    dt, step = np.diff(time_s, prepend=time_s[0]), np.diff(motion.place, prepend=motion.place[0])
    turned = np.cumsum(drift.heading_walk_rad_per_sqrt_s * np.sqrt(dt) * rng.standard_normal(number))
    turned += drift.heading_rate_rad_per_s * time_s + drift.turn_gain * np.unwrap(motion.course_rad)
    scale = 1 + drift.scale_bias + drift.scale_wander * wander(time_s, drift.scale_memory_s, rng)
    from_bcs = scale * np.exp(1j * (rng.uniform(-np.pi, np.pi) + turned))
    slip = np.hypot(drift.slip_m_per_sqrt_s * np.sqrt(dt), drift.slip_m_per_sqrt_m * np.sqrt(abs(step)))
    return Odometry(np.cumsum(from_bcs * step + slip * normal_plane(rng, number)), from_bcs)


def draw_losses(frames: int, gait: Gait, losses: Losses, rng: np.random.Generator) -> list[Stretch]:
    """Draw stretches without tracking: most of some seconds, some short, few long."""
    stretches: list[Stretch] = []
    for start in np.sort(rng.uniform(0.05, 0.92, rng.poisson(losses.per_min * gait.duration_s / 60)) * frames):
        seconds = rng.choice((rng.uniform(0.3, 1.5), rng.uniform(1.5, 4), rng.uniform(4, 12)), p=(0.3, 0.55, 0.15))
        first, stop = int(start), min(frames - 1, int(start) + max(1, int(seconds * gait.rate_hz)))
        if not stretches or first > stretches[-1][1] + 2:
            stretches.append((first, stop))
    return stretches


def while_lost(
    place: ComplexArray, lost: list[Stretch], losses: Losses, rate_hz: float, rng: np.random.Generator
) -> ComplexArray:
    """Change the odometry's places (n,) as this tracker does while it is lost."""
    place = place.copy()
    for first, stop in lost:
        if losses.motion in ("frozen", "frozen-right"):
            gone = place[stop] - place[first]
            place[first:stop] = place[first]
            place[stop:] -= gone if losses.motion == "frozen" else 0.0
        elif losses.motion == "drifting":
            astray = np.cumsum(normal_plane(rng, stop - first)) * rng.uniform(0.05, 0.3) / np.sqrt(rate_hz)
            place[first:stop] += astray
            place[stop:] += astray[-1]
    return place
