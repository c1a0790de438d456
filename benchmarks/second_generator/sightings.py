"""Which frames sight which landmarks, and what is wrong with what they see."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from second_generator.habits import Gait, Sight, SightingErrors
from second_generator.odometry import Stretch
from second_generator.random_numbers import gross_error, log_uniform, normal_plane, wander
from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray


@dataclass(frozen=True)
class Pass:
    """Sightings of one sheet from coming within reach to leaving it."""

    sheet: int
    frames: IntArray
    """Ascending, at least one."""


@dataclass(frozen=True)
class Errors:
    """Errors of the sightings of all frames and sheets, 0 elsewhere."""

    place: ComplexArray
    """(n, m) metres along the axes of the BCS."""
    heading_rad: FloatArray
    """(n, m)"""


def draw_passes(
    apart_m: FloatArray, lost: list[Stretch], gait: Gait, sight: Sight, rng: np.random.Generator
) -> list[Pass]:
    """Draw the passes, by first sighting, from the distances (n, m); nothing is sighted while tracking is lost."""
    tracking = np.ones(len(apart_m), dtype=bool)
    for first, stop in lost:
        tracking[first:stop] = False
    passes: list[Pass] = []
    for sheet, away in enumerate(apart_m.T):
        near = away < max(0.3, sight.reach_m + sight.reach_spread_m * rng.standard_normal())
        edges = np.flatnonzero(np.diff(near, prepend=False, append=False)).reshape(-1, 2)
        for first, stop in edges.tolist():
            if rng.random() < sight.missed:
                continue
            frames = _frames_sighting(np.arange(first, stop), away[first:stop], gait, sight, rng)
            frames = frames[tracking[frames]]
            if len(frames):
                passes.append(Pass(sheet, frames))
    return sorted(passes, key=lambda one: int(one.frames[0]))


def _frames_sighting(
    within: IntArray, away_m: FloatArray, gait: Gait, sight: Sight, rng: np.random.Generator
) -> IntArray:
    """Frames that sight a sheet out of those within reach of it."""
    count = len(within)
    if sight.pattern == "one":
        one = int(np.argmin(away_m)) if rng.random() < 0.6 else int(rng.integers(count))
        return within[one : one + 1]
    if sight.pattern == "few":
        start = int(rng.integers(count))
        return within[start : start + int(rng.integers(1, 9))]
    if sight.pattern == "first":
        return within[: max(1, int(rng.uniform(0.1, 0.8) * count))]
    if sight.pattern == "blink" and count > 2:
        recognised = wander(np.arange(count) / gait.rate_hz, 0.5, rng) > -0.3
        return within[recognised] if recognised.any() else within[:1]
    return within


def seen_at(passes: list[Pass], shape: tuple[int, int]) -> BoolArray:
    """Mask (n, m) of the sightings."""
    seen = np.zeros(shape, dtype=bool)
    for one in passes:
        seen[one.frames, one.sheet] = True
    return seen


def draw_errors(
    passes: list[Pass],
    offsets: ComplexArray,
    along_wall: ComplexArray,
    habits: SightingErrors,
    rng: np.random.Generator,
) -> Errors:
    """Draw errors of sightings: one for each pass that grows with distance, little noise, gross errors.

    ``offsets`` (n, m) are the true ones from camera to sheet, ``along_wall`` (m,) the sheets' true X axes.
    """
    place, heading = np.zeros(offsets.shape, dtype=np.complex128), np.zeros(offsets.shape)
    for one in passes:
        at, count = (one.frames, one.sheet), len(one.frames)
        offset = offsets[at]
        from_m = max(float(abs(offset[0])), 0.3)
        shared = habits.pass_bias_m * (0.5 + 0.5 * from_m) * normal_plane(rng, 1)
        if rng.random() < habits.outlier_pass:
            shared = shared + gross_error(rng)
        gross = rng.random(count) < habits.outlier / np.sqrt(count)
        gross_m = log_uniform(rng, 0.2, 2) * np.exp(1j * rng.uniform(-np.pi, np.pi, count))
        noise = habits.frame_noise_m * normal_plane(rng, count)
        place[at] = shared + habits.depth_bias * offset + noise + gross * gross_m
        turned = rng.standard_normal() + 0.2 * rng.standard_normal(count)
        lean = habits.lean_rad * np.sin(np.angle(offset) - np.angle(along_wall[one.sheet]))
        heading[at] = habits.heading_noise_rad * turned + lean
    return Errors(place, heading)
