"""Medians of a few arrays, entry by entry, and running medians of few entries: many times quicker than in general."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.core.arrays import FloatArray


def median_of(arrays: Sequence[FloatArray]) -> FloatArray:
    """Median (n,) over k arrays (n,), entry by entry; the mean of the two middle ones where k is even.

    Sorts by exchanging neighbours (odd-even transposition), k^2 / 2 exchanges of whole arrays: for k up to ten or so.
    """
    ranked = list(arrays)
    for start in range(len(ranked)):
        for low in range(start % 2, len(ranked) - 1, 2):
            first, second = ranked[low : low + 2]
            ranked[low : low + 2] = np.minimum(first, second), np.maximum(first, second)
    middle = len(ranked) // 2
    return ranked[middle] if len(ranked) % 2 else (ranked[middle - 1] + ranked[middle]) / 2


def running_median(values: FloatArray, size: int) -> FloatArray:
    """Median (n,) of the ``size`` (odd) entries around each of the values (n,); ends stand for what is beyond."""
    padded = np.pad(values, size // 2, mode="edge")
    return median_of([padded[k : k + len(values)] for k in range(size)])
