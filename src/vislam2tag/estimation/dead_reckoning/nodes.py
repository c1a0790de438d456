"""A walk reduced to the moments at which its unknowns stand, and the motion between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.estimation.dead_reckoning.features import WindowFeatures
from vislam2tag.estimation.dead_reckoning.heading import Headings
from vislam2tag.estimation.dead_reckoning.signals import RATE_HZ, WalkSignals

HOP_S = 0.5
CLOSE_S = 0.05
"""So near to a fix no further node is made: stretches must not be short."""


@dataclass(frozen=True)
class Nodes:
    """``k`` moments of a walk and the k - 1 stretches between them.

    ``time_s`` (k,); ``motion`` (k - 1,) complex metres, in a frame that the gyroscope holds still; ``length_m``
    (k - 1,) of the way; ``turn_rad`` (k - 1,) how far the phone turned, either way; ``known`` (k - 1,) mask of the
    stretches without a gap in the readings; ``drift_rad`` (k,) the phone's own heading less the gyroscope's, NaN where
    it has none; ``swinging`` (k - 1,) from 0, the phone is held still, to 1.
    """

    time_s: FloatArray
    motion: ComplexArray
    length_m: FloatArray
    turn_rad: FloatArray
    known: BoolArray
    drift_rad: FloatArray
    swinging: FloatArray

    @classmethod
    def of(
        cls,
        signals: WalkSignals,
        headings: Headings,
        features: WindowFeatures,
        speed_m_s: FloatArray,
        at_s: FloatArray,
    ) -> Nodes:
        """Sum the motion up between nodes: two a second, and one at each of the moments ``at_s`` within the walk."""
        end_s = signals.time_s[-1]
        regular = np.concatenate((np.arange(0, end_s - CLOSE_S, HOP_S), [end_s]))
        apart = np.abs(regular[:, None] - at_s).min(axis=1, initial=np.inf) > CLOSE_S
        time_s = np.unique(np.concatenate((regular[apart], at_s)))
        way = np.concatenate(([0.0], np.cumsum(speed_m_s[:-1]))) / RATE_HZ
        velocity = speed_m_s * np.exp(1j * headings.turned_rad)
        path = np.concatenate(([0.0], np.cumsum(velocity[:-1]))) / RATE_HZ
        unknown = np.concatenate(([0], np.cumsum(~signals.known[:-1])))
        return cls(
            time_s,
            np.diff(np.interp(time_s, signals.time_s, path.real) + 1j * np.interp(time_s, signals.time_s, path.imag)),
            np.diff(np.interp(time_s, signals.time_s, way)),
            np.abs(np.diff(np.interp(time_s, signals.time_s, headings.turned_rad))),
            np.diff(np.interp(time_s, signals.time_s, unknown)) == 0,
            np.interp(time_s, signals.time_s, headings.drift_rad),
            np.interp((time_s[1:] + time_s[:-1]) / 2, features.time_s, features.swinging),
        )

    @property
    def raw(self) -> ComplexArray:
        """(k,) the path from the start as the sensors have it, complex metres."""
        return np.concatenate(([0.0], np.cumsum(self.motion)))

    def index_of(self, time_s: FloatArray) -> IntArray:
        """Index (f,) of the nodes at these moments (f,), which are nodes."""
        return np.asarray(np.searchsorted(self.time_s, time_s))
