"""RSSI as numbers that a model can compare (Torres-Sospedra et al. 2015), and augmented copies of them."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.scans.radio_scans import RadioScans

FAINTEST_DBM = -105.0
"""Level that counts as nothing: phones report none below it."""
EXPONENT = float(np.e)
"""Exponent of the powed representation."""
SOFTNESS_DBM = 24.0
"""Scale of the exponential representation."""
_NOISE, _OFFSET = 0.03, 0.04
"""Standard deviation of levels (of 1 = 105 dB): of each, and common to a scan, as phones differ (3 dB and 4 dB)."""
_FAINTEST = 0.005
_MOST_MISSED = 0.4
"""Each scan misses a share of its access points, drawn from 0 to this."""


class Representation(StrEnum):
    """How a level becomes a number from 0 (not heard) to 1 (0 dBm)."""

    POSITIVE = "positive"
    """Linear in dBm."""
    POWED = "powed"
    """The positive one to the power of e: differences between strong levels count more."""
    EXPONENTIAL = "exponential"
    """Closer to received power still."""


def represented(scans: RadioScans, representation: Representation) -> FloatArray:
    """Make the (n, a) matrix of numbers from 0 to 1; 0 where an access point is not heard."""
    return represented_levels(scans.dense(FAINTEST_DBM), representation)


def represented_levels(level_dbm: FloatArray, representation: Representation) -> FloatArray:
    """Return levels, dBm, in an array of any shape, as numbers from 0 to 1."""
    above = np.clip(level_dbm - FAINTEST_DBM, 0.0, -FAINTEST_DBM)
    if representation is Representation.EXPONENTIAL:
        return np.where(above > 0, np.exp((above + FAINTEST_DBM) / SOFTNESS_DBM), 0.0)
    share = above / -FAINTEST_DBM
    return share**EXPONENT if representation is Representation.POWED else share


def augmented(level: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return other levels (n, a) from 0 to 1: some access points missed, all offset, each with noise."""
    n = len(level)
    heard = (level > 0) & (rng.random(level.shape) > _MOST_MISSED * rng.random((n, 1)))
    offset = _OFFSET * rng.standard_normal((n, 1))
    noise = _NOISE * rng.standard_normal(level.shape)
    return np.where(heard, np.clip(level + offset + noise, _FAINTEST, 1.0), 0.0)
