"""Similarity and affine maps of the horizontal plane, named by their frames (``bcs_T_acs``).

Points of the plane are treated as complex numbers: a similarity is ``q = a p + b`` with ``|a|`` the scale and
``arg a`` the rotation; it never reflects.
"""

from __future__ import annotations

import cmath
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray


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
            raise ValueError("two coinciding points define no similarity")
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
            raise ValueError("fewer than two points define no similarity")
        p_mean, q_mean = p.mean(), q.mean()
        spread = float(np.sum(np.abs(p - p_mean) ** 2))
        if not spread > 0:
            raise ValueError("coinciding points define no similarity")
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
            raise ValueError("points on one line define no affine map")
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
