"""Lengths along lines, and what counts as way walked.

Steps are taken between frames half a second apart, so that gait and noise do not count.

The length of a walk and of its labelled part are summed by the same steps, so that no part is longer than the whole.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray

STEP_NS = 500_000_000
"""Lengths are summed between frames this far apart."""
FASTEST_M_PER_S = 6.0
"""A faster step is a jump of the tracker or of the mapping, no walking."""


def step_frames(time_ns: IntArray) -> IntArray:
    """Pick the frames (k,) between which way is summed: the first of each half second since the first (n,)."""
    if not len(time_ns):
        return np.empty(0, dtype=np.int64)
    frames: IntArray = np.flatnonzero(np.diff((time_ns - time_ns[0]) // STEP_NS, prepend=-1))
    return frames


def step_lengths(points: FloatArray) -> FloatArray:
    """Distances (k - 1,) between points (k, 2) one after the other; NaN where one is not known."""
    lengths: FloatArray = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return lengths


def line_length(line: FloatArray) -> float:
    """Length of a line (k, 2)."""
    return float(step_lengths(line).sum())


def arc_lengths(line: FloatArray) -> FloatArray:
    """Distance (k,) of each corner of a line (k, 2) from its first, along it."""
    return np.concatenate(([0.0], np.cumsum(step_lengths(line))))


def points_along(line: FloatArray, distance: FloatArray) -> FloatArray:
    """Points (n, 2) of a line (k, 2) at these distances (n,) from its first corner, along it."""
    corners = arc_lengths(line)
    return np.column_stack([np.interp(distance, corners, line[:, axis]) for axis in (0, 1)])


def steps_without_jumps(steps_m: FloatArray, time_ns: IntArray) -> FloatArray:
    """Steps (k - 1,) between frames at times (k,); 0 where they are unknown or jumps."""
    motion: FloatArray = np.where(steps_m <= FASTEST_M_PER_S * np.diff(time_ns) * 1e-9, steps_m, 0.0)
    return motion
