"""Which way is up in the device's axes, how far the phone turned, and where it points by its own compass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import InertialLog
from vislam2tag.estimation.dead_reckoning.signals import RATE_HZ, WalkSignals, low_pass

GRAVITY_HZ = 0.3
"""Steps are quicker than this, tilting the phone is slower."""
COMPASS_HZ = 0.25
FORWARD = np.array((0.0, 1.0, -1.0)) / np.sqrt(2)
"""Walkers look along this axis of a phone: its top edge points ahead where it lies flat, its back where it stands."""


@dataclass(frozen=True)
class Headings:
    """``up`` (n, 3) unit vectors in the device's axes; ``turned_rad`` (n,) rotation about them since the start,
    anticlockwise; ``drift_rad`` (n,) the walker's heading by the phone's own, from east, less ``turned_rad``, slow: NaN
    where it has none.
    """

    up: FloatArray
    turned_rad: FloatArray
    drift_rad: FloatArray

    @classmethod
    def of(cls, signals: WalkSignals, log: InertialLog) -> Headings:
        """Integrate the gyroscope about gravity and compare with the rotation vector, where there is one."""
        up, turned = turned_about_up(signals)
        return cls(up, turned, _drift(signals, log, turned))


def turned_about_up(signals: WalkSignals) -> tuple[FloatArray, FloatArray]:
    """``up`` and ``turned_rad`` of :class:`Headings`."""
    slow = low_pass(signals.force, GRAVITY_HZ)
    up = slow / np.maximum(np.linalg.norm(slow, axis=1, keepdims=True), 1e-6)
    about_up = np.einsum("ni,ni->n", signals.rate, up)
    return up, np.concatenate(([0.0], np.cumsum((about_up[1:] + about_up[:-1]) / 2) / RATE_HZ))


def _drift(signals: WalkSignals, log: InertialLog, turned_rad: FloatArray) -> FloatArray:
    if len(log.orientation_ns) < 2:
        return np.full(len(turned_rad), np.nan)
    from scipy.spatial.transform import Rotation

    ahead = Rotation.from_quat(log.orientation).apply(FORWARD)
    # Directions are interpolated as angles that were unwrapped: components of quaternions flip their signs.
    heading = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    at = (log.orientation_ns - signals.start_ns) * 1e-9
    return low_pass(np.interp(signals.time_s, at, heading) - turned_rad, COMPASS_HZ)
