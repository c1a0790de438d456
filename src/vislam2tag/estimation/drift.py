"""How far a tracker may have drifted between two frames: covariances of its drift, from sums along the path.

State at a frame, in the BCS, relative to a reference path: ``(x, y)`` position error in metres, relative scale error,
heading error in rad. From frame a to b a heading error turns the way between them, and a drift of the heading at a
frame in between turns the rest of the way, ``X = path[b] - path[frame]``. So the covariance of the drift from a to b is
made of sums of the step's variance times 1, ``X`` and ``X X^T`` - all from running sums, for any number of pairs.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray

STATES = 4
"""x, y, scale, heading."""


class DriftKind(Enum):
    """What drifts."""

    POSITION = "position"
    HEADING = "heading"
    SCALE = "scale"


@dataclass(frozen=True)
class PathDriftSums:
    """Running sums along a path of one kind of drift; make it by :meth:`along` or :meth:`directed`."""

    kind: DriftKind
    path: ComplexArray
    sums: FloatArray
    """(6, n): variance, times x, y, xx, xy, yy of the path; of the position's drift (3, n): xx, xy, yy."""

    @classmethod
    def along(cls, kind: DriftKind, path: ComplexArray, variance: FloatArray) -> PathDriftSums:
        """Sum the variances (n - 1,) of the steps of a path (n,), complex metres in the BCS."""
        centred = path - path.mean()
        terms = np.stack((variance, np.zeros_like(variance), variance))
        if kind is not DriftKind.POSITION:
            x, y = centred.real[1:], centred.imag[1:]
            terms = variance * np.stack((np.ones_like(x), x, y, x * x, x * y, y * y))
        return cls(kind, centred, _summed(terms))

    @classmethod
    def directed(cls, path: ComplexArray, by: ComplexArray) -> PathDriftSums:
        """Let each step lead elsewhere along ``by`` (n - 1,), complex, one standard deviation in metres, BCS."""
        return cls(DriftKind.POSITION, path, _summed(np.stack((by.real**2, by.real * by.imag, by.imag**2))))

    def between(self, a: IntArray, b: IntArray) -> FloatArray:
        """Covariances (k, 4, 4) of the drift from frames ``a`` to frames ``b`` >= a (k,)."""
        sums = self.sums.take(b, axis=1) - self.sums.take(a, axis=1)
        drift = np.zeros((len(a), STATES, STATES))
        if self.kind is DriftKind.POSITION:
            drift[:, 0, 0], drift[:, 1, 1] = sums[0], sums[2]
            drift[:, 0, 1] = drift[:, 1, 0] = sums[1]
            return drift
        total, sx, sy, sxx, sxy, syy = sums
        x, y = self.path.real[b], self.path.imag[b]
        mean_x, mean_y = x * total - sx, y * total - sy
        xx = np.maximum(x * x * total - 2 * x * sx + sxx, 0)
        yy = np.maximum(y * y * total - 2 * y * sy + syy, 0)
        xy = x * y * total - x * sy - y * sx + sxy
        if self.kind is DriftKind.HEADING:
            xx, yy, xy, mean_x, mean_y = yy, xx, -xy, -mean_y, mean_x
        row = 3 if self.kind is DriftKind.HEADING else 2
        drift[:, 0, 0], drift[:, 1, 1], drift[:, row, row] = xx, yy, total
        drift[:, 0, 1] = drift[:, 1, 0] = xy
        drift[:, 0, row] = drift[:, row, 0] = mean_x
        drift[:, 1, row] = drift[:, row, 1] = mean_y
        return drift


def _summed(terms: FloatArray) -> FloatArray:
    """Running sums (t, n) of terms (t, n - 1), from nothing at the first frame."""
    sums = np.zeros((len(terms), terms.shape[1] + 1))
    np.cumsum(terms, axis=1, out=sums[:, 1:])
    return sums


def transitions(path: ComplexArray, a: IntArray, b: IntArray) -> FloatArray:
    """Matrices (k, 4, 4) that carry a state at frames ``a`` to frames ``b`` without any drift."""
    displacement = path[b] - path[a]
    transition = np.tile(np.eye(STATES), (len(a), 1, 1))
    transition[:, 0, 2], transition[:, 1, 2] = displacement.real, displacement.imag
    transition[:, 0, 3], transition[:, 1, 3] = -displacement.imag, displacement.real
    return transition
