"""RSSI as numbers that a model can compare: positive, powed and exponential (Torres-Sospedra et al. 2015)."""

from __future__ import annotations

from enum import StrEnum

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.positioning.scans import RadioScans

FAINTEST_DBM = -105.0
"""Level that counts as nothing: phones report none below it."""
EXPONENT = float(np.e)
"""Exponent of the powed representation."""
SOFTNESS_DBM = 24.0
"""Scale of the exponential representation."""


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
    above = np.clip(scans.dense(FAINTEST_DBM) - FAINTEST_DBM, 0.0, -FAINTEST_DBM)
    if representation is Representation.EXPONENTIAL:
        return np.where(above > 0, np.exp((above + FAINTEST_DBM) / SOFTNESS_DBM), 0.0)
    share = above / -FAINTEST_DBM
    return share**EXPONENT if representation is Representation.POWED else share
