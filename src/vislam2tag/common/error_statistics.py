"""Statistics of errors: lengths counted in bins, and how far a figure would scatter had other walks been walked.

Bins are of equal ratio: small to keep, quick to add up, and quantiles come back to a few percent.

The scatter is by the bootstrap over walks (Efron and Tibshirani 1993). Walks are drawn with replacement, never single
points: the errors of one walk are alike, and points drawn alone would make every interval far too narrow.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vislam2tag.core.arrays import AnyArray, FloatArray, IntArray

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


ROUNDS = 1000
FEWEST_WALKS = 5
"""Of fewer walks no interval is stated."""
LEVEL = 0.95
_SEED = 20221010
"""Fixed, so that the same survey gives the same figures."""


def draws(walks: int) -> IntArray:
    """Indices (ROUNDS, walks) of the walks drawn in each round."""
    return np.random.default_rng(_SEED).integers(0, walks, (ROUNDS, walks))


def multiplicities(drawn: IntArray) -> IntArray:
    """How often (rounds, walks) each walk was drawn in each round."""
    rounds, walks = drawn.shape
    flat = drawn + walks * np.arange(rounds)[:, None]
    return np.bincount(flat.ravel(), minlength=rounds * walks).reshape(rounds, walks).astype(np.int64)


def interval(values: FloatArray) -> tuple[float, float] | None:
    """Bounds between which :data:`LEVEL` of the rounds' values (rounds,) lie; NaN of rounds without a label aside."""
    known = values[np.isfinite(values)]
    if not len(known):
        return None
    low, high = np.quantile(known, ((1 - LEVEL) / 2, (1 + LEVEL) / 2)).tolist()
    return low, high


def mean_interval(values: FloatArray, walk: AnyArray, weight: FloatArray | None = None) -> tuple[float, float] | None:
    """Bounds of the mean of values (n,) of walks (n,), weighed (n,) or alike; None of fewer than FEWEST_WALKS walks."""
    names, number = np.unique(walk, return_inverse=True)
    if len(names) < FEWEST_WALKS:
        return None
    weight = np.ones(len(values)) if weight is None else weight
    sums, weights = np.bincount(number, weight * values), np.bincount(number, weight)
    times = multiplicities(draws(len(names)))
    return interval((times @ sums) / (times @ weights))
