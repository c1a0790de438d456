"""From frame to frame: similarity and affine maps of the horizontal plane, named by their frames (``bcs_T_acs``).

Points of the plane are treated as complex numbers: a similarity is ``q = a p + b`` with ``|a|`` the scale and
``arg a`` the rotation; it never reflects.

Cameras are turned by quaternions (x, y, z, w) between the tracker's frame and the building's. SciPy's Rotation gives
the same quaternions to 1e-15. It is not used here: it takes seven times as long (63 and 9 ms for 20,000), and a quarter
of a second to import, which no other part of mapping needs.
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray


def as_complex(points: FloatArray) -> ComplexArray:
    """Points (..., 2) as complex numbers (...)."""
    return np.array(points, dtype=np.float64, order="C").view(np.complex128)[..., 0]


def as_points(values: ComplexArray) -> FloatArray:
    """Complex numbers (...) as points (..., 2)."""
    return np.stack((values.real, values.imag), axis=-1)


@dataclass(frozen=True)
class Similarity2:
    """Translation, uniform scale and rotation of the plane; ``target_T_source @ points`` maps (..., 2) points."""

    a: complex
    """Scale times unit rotation."""
    b: complex
    """Translation, metres."""

    @classmethod
    def identity(cls) -> Similarity2:
        """Return the map that changes nothing."""
        return cls(1 + 0j, 0j)

    @classmethod
    def from_two_points(cls, source: FloatArray, target: FloatArray) -> Similarity2:
        """Send two points (2, 2) exactly to two others (paper, section V-B).

        Raises ValueError where the source points coincide.
        """
        p, q = as_complex(source), as_complex(target)
        if p[0] == p[1]:
            raise ValueError("two coinciding points do not define a similarity")
        a = complex((q[1] - q[0]) / (p[1] - p[0]))
        return cls(a, complex(q[0]) - a * complex(p[0]))

    @classmethod
    def fit(cls, source: FloatArray, target: FloatArray) -> Similarity2:
        """Least-squares similarity between point sets (n, 2), n >= 2 (Umeyama 1991, equations 40-42).

        In the plane Umeyama's solution without reflection has the closed form of complex linear regression.
        Raises ValueError where all the source points coincide.
        """
        p, q = as_complex(source), as_complex(target)
        if len(p) < 2:
            raise ValueError("fewer than two points do not define a similarity")
        p_mean, q_mean = p.mean(), q.mean()
        spread = float(np.sum(np.abs(p - p_mean) ** 2))
        if not spread > 0:
            raise ValueError("coinciding points do not define a similarity")
        a = complex(np.vdot(p - p_mean, q - q_mean) / spread)
        return cls(a, complex(q_mean - a * p_mean))

    @property
    def scale(self) -> float:
        """Uniform scale factor."""
        return abs(self.a)

    @property
    def rotation_rad(self) -> float:
        """Counter-clockwise rotation."""
        return cmath.phase(self.a)

    @property
    def inverse(self) -> Similarity2:
        """The map back."""
        return Similarity2(1 / self.a, -self.b / self.a)

    def compose(self, other: Similarity2) -> Similarity2:
        """Apply ``other`` first: ``c_T_b.compose(b_T_a)`` is ``c_T_a``."""
        return Similarity2(self.a * other.a, self.a * other.b + self.b)

    def __matmul__(self, points: FloatArray) -> FloatArray:
        """Map points (..., 2)."""
        return as_points(self.a * as_complex(points) + self.b)


@dataclass(frozen=True)
class Affine2:
    """General linear map and translation of the plane; ``target_T_source @ points`` maps (..., 2) points."""

    matrix: FloatArray
    """(2, 2)."""
    translation: FloatArray
    """(2,), metres."""

    @classmethod
    def fit(cls, source: FloatArray, target: FloatArray) -> Affine2:
        """Least-squares affine map between point sets (n, 2), n >= 3.

        Raises ValueError where the source points lie on one line.
        """
        design = np.column_stack((source, np.ones(len(source))))
        solution, _, rank, _ = np.linalg.lstsq(design, target, rcond=None)
        if rank < 3:
            raise ValueError("points on one line do not define an affine map")
        return cls(np.asarray(solution[:2].T, dtype=np.float64), np.asarray(solution[2], dtype=np.float64))

    @property
    def rotation_rad(self) -> float:
        """Rotation of the nearest similarity (polar decomposition in the plane)."""
        m = self.matrix
        return float(np.arctan2(m[1, 0] - m[0, 1], m[0, 0] + m[1, 1]))

    def __matmul__(self, points: FloatArray) -> FloatArray:
        """Map points (..., 2)."""
        mapped: FloatArray = points @ self.matrix.T + self.translation
        return mapped


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
