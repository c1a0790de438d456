"""Lengths counted in bins of equal ratio: small to keep, quick to add up, and quantiles come back to a few percent."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray

PER_OCTAVE = 8
"""Bins from one length to its double."""
SMALLEST_M = 1e-3
"""Lower edge of bin 0, which also takes what is smaller, metres."""
BINS = 20 * PER_OCTAVE
"""The last bin reaches a kilometre and takes what is greater."""


def bins_of(lengths_m: FloatArray) -> IntArray:
    """Bin (n,) of each length (n,), metres, not NaN."""
    octaves = np.log2(np.maximum(lengths_m, SMALLEST_M) / SMALLEST_M)
    index: IntArray = np.minimum(np.floor(octaves * PER_OCTAVE), BINS - 1).astype(np.int64)
    return index


def lower_edge_m(index: int) -> float:
    """Lower edge of a bin, and the upper one of the bin before, metres."""
    return float(SMALLEST_M * 2 ** (index / PER_OCTAVE))


def counts_of(lengths_m: FloatArray) -> dict[int, int]:
    """Number of lengths by bin, in order; bins that none falls into are left out."""
    found, counts = np.unique(bins_of(lengths_m), return_counts=True)
    return dict(zip(found.tolist(), counts.tolist(), strict=True))


def quantile_m(counts: Mapping[int, int], share: float) -> float:
    """Length below which ``share`` (0 to 1) of the counted ones lie, evenly spread within a bin; NaN where none is."""
    if not counts:
        return float("nan")
    index = np.array(sorted(counts))
    upto = np.cumsum([counts[i] for i in index])
    wanted = share * upto[-1]
    place = min(int(np.searchsorted(upto, wanted)), len(index) - 1)
    at, inside = int(index[place]), counts[int(index[place])]
    low, high = lower_edge_m(at), lower_edge_m(at + 1)
    return low + (high - low) * float(wanted - (upto[place] - inside)) / inside
