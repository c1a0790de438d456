"""Angles, and quaternions (x, y, z, w) between the tracker's frame and the building's.

SciPy's Rotation gives the same quaternions to 1e-15. It is not used here: it takes seven times as long (63 and 9 ms for
20,000), and a quarter of a second to import, which no other part of mapping needs.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray

_HALF = np.sqrt(0.5)
"""Sine and cosine of half a quarter turn."""


def wrapped(angle_rad: FloatArray) -> FloatArray:
    """The same directions (...) as angles from -pi to pi; those that are there already stay to the last digit.

    (:func:`math.remainder` does so for one number.)
    """
    return np.asarray(angle_rad - 2 * np.pi * np.round(angle_rad / (2 * np.pi)))


def multiply(left: FloatArray, right: FloatArray) -> FloatArray:
    """Hamilton product of quaternions (..., 4), (x, y, z, w); ``right`` is applied first."""
    lx, ly, lz, lw = np.moveaxis(left, -1, 0)
    rx, ry, rz, rw = np.moveaxis(right, -1, 0)
    return np.stack(
        (
            lw * rx + lx * rw + ly * rz - lz * ry,
            lw * ry - lx * rz + ly * rw + lz * rx,
            lw * rz + lx * ry - ly * rx + lz * rw,
            lw * rw - lx * rx - ly * ry - lz * rz,
        ),
        axis=-1,
    )


def rotated(orientation: FloatArray, vectors: FloatArray) -> FloatArray:
    """Vectors (n, 3) turned by unit quaternions (n, 4)."""
    around, real = orientation[:, :3], orientation[:, 3:]
    across = 2 * np.cross(around, vectors)
    return np.asarray(vectors + real * across + np.cross(around, across))


def turns_rad(orientation: FloatArray) -> FloatArray:
    """Angles (n - 1,) between neighbouring unit quaternions (n, 4), 0 to pi."""
    cosine = np.abs(np.sum(orientation[1:] * orientation[:-1], axis=1))
    return np.asarray(2 * np.arccos(np.minimum(cosine, 1.0)))


def angular_speed(time_ns: IntArray, orientation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mid-times (k,), s since the first frame, and turn rates (k,), rad/s, between neighbouring frames.

    ``time_ns`` (n,) increases; ``orientation`` (n, 4). Steps twice as long as usual are left out.
    """
    elapsed_s = (time_ns - time_ns[:1]) * 1e-9
    step_s = np.diff(elapsed_s)
    angle = turns_rad(orientation)
    steady = step_s < 2 * np.median(step_s) if len(step_s) else np.zeros(0, dtype=bool)
    return (elapsed_s[1:] - step_s / 2)[steady], (angle / np.maximum(step_s, 1e-9))[steady]


def level_view(orientation_bcs: FloatArray) -> FloatArray:
    """Directions (n, 2), unit, in which cameras look in the plane, by camera-to-BCS quaternions (n, 4).

    A camera looks along its own -z axis. One that looks up or down, steeper than 60 degrees, is taken to look as it did
    before, or, at the start, as it does afterwards; 0 where none ever looks level.
    """
    view = rotated(orientation_bcs, np.tile([0.0, 0.0, -1.0], (len(orientation_bcs), 1)))[:, :2]
    length = np.hypot(*view.T)
    level = np.flatnonzero(length > 0.5)
    if not level.size:
        return np.zeros_like(view)
    last = level[np.maximum(np.searchsorted(level, np.arange(len(view)), side="right") - 1, 0)]
    return np.asarray(view[last] / length[last, None])


def camera_to_bcs(orientation_acs: FloatArray, rotation_rad: FloatArray | float) -> FloatArray:
    """Turn camera-to-ACS quaternions (n, 4) into camera-to-BCS ones.

    The ACS has y up, the BCS z up: ``(x, y, z)`` becomes ``(x, -z, y)`` (a quarter turn about x), then the plane is
    rotated by ``rotation_rad`` (scalar or (n,)) about the vertical axis. The sign is fixed by ``w >= 0``.
    """
    half = np.broadcast_to(np.asarray(rotation_rad, dtype=np.float64) / 2, orientation_acs.shape[:-1])
    cos, sin = np.cos(half), np.sin(half)
    bcs_q_acs = np.stack((_HALF * cos, _HALF * sin, _HALF * sin, _HALF * cos), axis=-1)
    result = multiply(bcs_q_acs, orientation_acs)
    signed: FloatArray = np.where(result[..., 3:] < 0, -result, result)
    return signed
