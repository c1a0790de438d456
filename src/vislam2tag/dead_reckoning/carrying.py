"""Inertial readings as a phone would have them that is carried otherwise, or samples otherwise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import InertialLog

SWING_RAD = np.radians(25)
SWING_HZ = 0.95
"""An arm swings once in two steps."""
ARM_M = 0.5


def held(log: InertialLog, angles_deg: tuple[float, float, float]) -> InertialLog:
    """The same phone turned about its z, y and x axes in turn, degrees."""
    hold = Rotation.from_euler("zyx", angles_deg, degrees=True)
    orientation = (Rotation.from_quat(np.array(log.orientation)) * hold).as_quat()
    force, rate = (hold.inv().apply(np.array(values)) for values in (log.force, log.rate))
    return replace(log, force=force, rate=rate, orientation=orientation)


def swung(log: InertialLog) -> InertialLog:
    """The same phone in a hand that swings about a shoulder :data:`ARM_M` away, as a pendulum about its x axis."""
    pace = 2 * np.pi * SWING_HZ
    phase, turn = _swing(log, log.force_ns)
    along = -ARM_M * SWING_RAD * pace**2 * np.sin(phase)
    outwards = ARM_M * (SWING_RAD * pace * np.cos(phase)) ** 2
    force = turn.inv().apply(np.array(log.force)) + np.column_stack((0 * phase, along, outwards))
    phase, turn = _swing(log, log.rate_ns)
    rate = turn.inv().apply(np.array(log.rate)) + np.outer(SWING_RAD * pace * np.cos(phase), (1.0, 0.0, 0.0))
    orientation = log.orientation
    if len(orientation):
        orientation = (Rotation.from_quat(np.array(orientation)) * _swing(log, log.orientation_ns)[1]).as_quat()
    return replace(log, force=force, rate=rate, orientation=orientation)


def sampled(log: InertialLog, every: int, noise_m_s2: float) -> InertialLog:
    """Every so many readings only, with noise, a tenth of which (rad/s) the gyroscope has."""
    rng = np.random.default_rng(0)
    force, rate = log.force[::every], log.rate[::every]
    force = force + rng.normal(0, noise_m_s2, force.shape)
    rate = rate + rng.normal(0, noise_m_s2 / 10, rate.shape)
    return replace(log, force_ns=log.force_ns[::every], force=force, rate_ns=log.rate_ns[::every], rate=rate)


def _swing(log: InertialLog, time_ns: IntArray) -> tuple[FloatArray, Rotation]:
    """Phase (k,) of the swing at these times (k,), rad, and how far it turns the phone."""
    phase = 2 * np.pi * SWING_HZ * (time_ns - log.force_ns[0]) * 1e-9
    return np.asarray(phase), Rotation.from_rotvec(np.outer(SWING_RAD * np.sin(phase), (1.0, 0.0, 0.0)))
