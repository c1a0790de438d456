"""Which walls a straight line crosses: for radio losses and for the total station's line of sight."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray

_LINES_AT_ONCE = 4096


def count_crossings(start: FloatArray, end: FloatArray, walls: FloatArray) -> IntArray:
    """Count the walls (w, 2, 2) that each straight line from ``start`` (k, 2) to ``end`` (k, 2) crosses; metres."""
    count = np.zeros(len(start), dtype=np.int64)
    for first in range(0, len(start), _LINES_AT_ONCE):
        part = slice(first, first + _LINES_AT_ONCE)
        count[part] = _crossing(start[part], end[part], walls).sum(axis=1)
    return count


def _crossing(start: FloatArray, end: FloatArray, walls: FloatArray) -> BoolArray:
    """(k, w) mask: line and wall cross where each one's ends lie on different sides of the other."""
    lines, wall_lines = _implicit(start, end), _implicit(walls[:, 0], walls[:, 1])
    ends_apart = (_homogeneous(start) @ wall_lines.T) * (_homogeneous(end) @ wall_lines.T) < 0
    walls_apart = (lines @ _homogeneous(walls[:, 0]).T) * (lines @ _homogeneous(walls[:, 1]).T) < 0
    mask: BoolArray = ends_apart & walls_apart
    return mask


def _implicit(first: FloatArray, second: FloatArray) -> FloatArray:
    """Coefficients (k, 3) of the line through two points: zero on it, signed by side."""
    dx, dy = (second - first).T
    return np.column_stack((-dy, dx, dy * first[:, 0] - dx * first[:, 1]))


def _homogeneous(points: FloatArray) -> FloatArray:
    """Points (k, 2) with a third coordinate of 1."""
    return np.column_stack((points, np.ones(len(points))))
