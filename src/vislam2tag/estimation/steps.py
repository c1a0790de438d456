"""Steps from frame to frame: what the neighbouring ones lead to expect, and which ones no camera makes.

A tracker that jumps shows itself by a step that does not fit the steps about it, in the plane as in height.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray

BEFORE, AFTER = (-3, -2, -1), (1, 2, 3)
"""Neighbouring steps whose median predicts a step."""
LEAST_SPREAD_M = 0.003
"""Predictions of steps are not trusted better than this."""
IMPOSSIBLE = 10.0
"""A step that misses its prediction by more than this many standard deviations, and by more than anybody moves, is no
motion."""
FEW = 0.1
"""Where fewer steps than this share miss their predictions at all, those that do are no measure of the usual."""
MEDIAN_SIGMAS = {1: 0.67, 2: 1.18}
"""Median length of a normal error of one or two dimensions, in standard deviations per axis."""


def predicted(step: FloatArray, dt: FloatArray, neighbours: Sequence[int] = BEFORE + AFTER) -> FloatArray:
    """Steps (n - 1,) that the median rate of their neighbours leads to expect; ``dt`` (n - 1,) their times, s."""
    if not len(step):
        return step
    reach = max(AFTER)
    padded = np.pad(step / dt, reach, mode="edge")
    return median_of([padded[reach + k : reach + k + len(step)] for k in neighbours]) * dt


def predicted_in_plane(step: ComplexArray, dt: FloatArray, neighbours: Sequence[int] = BEFORE + AFTER) -> ComplexArray:
    """The same for complex steps (n - 1,), metres."""
    x, y = (predicted(part, dt, neighbours) for part in (step.real, step.imag))
    return np.asarray(x + 1j * y)


def prediction_sigma_m(miss_m: FloatArray, dt: FloatArray, dimensions: int) -> FloatArray:
    """Standard deviation (n - 1,) per axis of how far steps usually miss their predictions; more in a longer step.

    ``miss_m`` (n - 1,) is how far each does, in the plane or (one dimension) in height.
    """
    moving = miss_m[miss_m > 0]
    usual = float(np.median(moving)) / MEDIAN_SIGMAS[dimensions] if moving.size > FEW * len(dt) else 0.0
    return np.asarray(np.maximum(usual, LEAST_SPREAD_M) * np.maximum(dt / np.median(dt), 1.0))


def implausible(miss_m: FloatArray, spread_m: FloatArray, dt: FloatArray, fastest_m_s: float) -> BoolArray:
    """Steps (n - 1,) that miss their predictions by more than chance (``spread_m``) and anybody's motion explain."""
    return np.asarray(miss_m > np.maximum(IMPOSSIBLE * spread_m, fastest_m_s * dt))


def median_of(arrays: Sequence[FloatArray]) -> FloatArray:
    """Median (n,) over k arrays (n,), entry by entry; the mean of the two middle ones where k is even.

    Sorts by exchanging neighbours (odd-even transposition), k^2 / 2 exchanges of whole arrays: for k up to ten or so
    many times quicker than in general.
    """
    ranked = list(arrays)
    for start in range(len(ranked)):
        for low in range(start % 2, len(ranked) - 1, 2):
            first, second = ranked[low : low + 2]
            ranked[low : low + 2] = np.minimum(first, second), np.maximum(first, second)
    middle = len(ranked) // 2
    return ranked[middle] if len(ranked) % 2 else (ranked[middle - 1] + ranked[middle]) / 2
