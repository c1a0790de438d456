"""The true walk at any time: linear between its dense samples (5 ms apart, so below 0.1 mm)."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.simulation.model import TrueWalk


def position_at(walk: TrueWalk, time_ns: IntArray) -> FloatArray:
    """Camera position (k, 3) in BCS at boot-clock times (k,); the ends are held outside the walk."""
    return blend_at(walk, walk.position, time_ns)


def orientation_at(walk: TrueWalk, time_ns: IntArray) -> FloatArray:
    """Unit quaternions (k, 4), (x, y, z, w), body to BCS, at boot-clock times (k,)."""
    continuous = walk.orientation * continuous_signs(walk.orientation)[:, None]
    blended = blend_at(walk, continuous, time_ns)
    unit: FloatArray = blended / np.linalg.norm(blended, axis=1, keepdims=True)
    return unit


def continuous_signs(orientation: FloatArray) -> FloatArray:
    """Signs (n,) that make a quaternion sequence (n, 4) free of sign flips."""
    flips = np.sum(orientation[1:] * orientation[:-1], axis=1) < 0
    turned = np.append(False, flips).cumsum() % 2
    return np.where(turned == 1, -1.0, 1.0)


def floor_at(walk: TrueWalk, time_ns: IntArray) -> IntArray:
    """Number of the floor (k,) at boot-clock times (k,): that of the nearest sample."""
    if not len(walk.floor_at):
        return np.full(len(time_ns), walk.floor, dtype=np.int64)
    place = np.rint((time_ns - walk.time_ns[0]) * (walk.rate_hz / 1e9)).astype(np.int64)
    floor: IntArray = walk.floor_at[place.clip(0, len(walk.floor_at) - 1)]
    return floor


def blend_at(walk: TrueWalk, samples: FloatArray, time_ns: IntArray) -> FloatArray:
    """Interpolate values (n, d), one a walk sample, at boot-clock times (k,)."""
    place = np.clip((time_ns - walk.time_ns[0]) * (walk.rate_hz / 1e9), 0, len(walk.time_ns) - 1)
    before = np.minimum(place.astype(np.int64), len(walk.time_ns) - 2)
    share = (place - before)[:, None]
    blended: FloatArray = samples[before] * (1 - share) + samples[before + 1] * share
    return blended
