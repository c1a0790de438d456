"""Scans as another phone might have taken them at the same place: what a model learns from besides the scans."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray

_NOISE, _OFFSET = 0.03, 0.04
"""Standard deviation of levels (of 1 = 105 dB): of each, and common to a scan, as phones differ (3 dB and 4 dB)."""
_FAINTEST = 0.005
_MOST_MISSED = 0.4
"""Each scan misses a share of its access points, drawn from 0 to this."""


def altered(level: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return other levels (n, a) from 0 to 1: some access points missed, all offset, each with noise."""
    n = len(level)
    heard = (level > 0) & (rng.random(level.shape) > _MOST_MISSED * rng.random((n, 1)))
    offset = _OFFSET * rng.standard_normal((n, 1))
    noise = _NOISE * rng.standard_normal(level.shape)
    return np.where(heard, np.clip(level + offset + noise, _FAINTEST, 1.0), 0.0)
