"""Smooth random fields over a building, evaluated anywhere and fixed by their seed.

A sum of cosines with normally distributed wave vectors has, in the limit of many terms, a Gaussian
covariance (random Fourier features, Rahimi and Recht 2007).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray

TERMS = 32
"""Cosines a field: enough for a marginal distribution close to normal."""


@dataclass(frozen=True)
class SmoothFields:
    """``a`` independent fields: ``wave`` (a, TERMS, 3) rad/m, ``phase`` (a, TERMS) rad, ``sigma`` their unit."""

    wave: FloatArray
    phase: FloatArray
    sigma: float

    def at(self, position: FloatArray, index: IntArray) -> FloatArray:
        """Value (k,) of field ``index`` (k,) at each position (k, 3), metres."""
        angle = np.einsum("kmd,kd->km", self.wave[index], position) + self.phase[index]
        value: FloatArray = self.sigma * np.sqrt(2 / TERMS) * np.cos(angle).sum(axis=1)
        return value


def make_fields(streams: list[np.random.Generator], sigma: float, length_m: float) -> SmoothFields:
    """Draw one field from each stream: standard deviation ``sigma``, correlation length ``length_m`` (metres)."""
    wave = np.stack([stream.normal(0, 1 / length_m, (TERMS, 3)) for stream in streams])
    phase = np.stack([stream.uniform(0, 2 * np.pi, TERMS) for stream in streams])
    return SmoothFields(wave, phase, sigma)
