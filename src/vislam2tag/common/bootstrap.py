"""How far a figure would scatter had other walks been walked: the bootstrap over walks (Efron and Tibshirani 1993).

Walks are drawn with replacement, never single points: the errors of one walk are alike, and points drawn alone would
make every interval far too narrow.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import AnyArray, FloatArray, IntArray

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
