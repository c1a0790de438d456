"""Inertial readings as a phone would have them that is carried otherwise, or samples otherwise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import InertialLog
from vislam2tag.estimation.dead_reckoning.gait import CADENCE_RANGE_HZ, WindowFeatures
from vislam2tag.estimation.dead_reckoning.signals import BAND_HZ, RATE_HZ, Headings, WalkSignals, low_pass

SWING_RAD = np.radians(25)
SWING_HZ = 0.95
"""An arm swings once in two steps."""
ARM_M = 0.5
THIGH_RAD = np.radians(20)
"""A hip bends from 10 degrees back to 30 degrees ahead while its leg walks ..."""
RECOIL = 0.25
"""... and goes ahead faster than back: so much of the swing has twice its frequency."""
THIGH_M = 0.3
"""From the hip to a trouser pocket."""
IN_POCKET_DEG = (100.0, 20.0, 75.0)
"""How a phone is turned in a pocket, about its z, y and x axes in turn."""


def held(log: InertialLog, angles_deg: tuple[float, float, float]) -> InertialLog:
    """The same phone turned about its z, y and x axes in turn, degrees."""
    hold = Rotation.from_euler("zyx", angles_deg, degrees=True)
    orientation = (Rotation.from_quat(np.array(log.orientation)) * hold).as_quat()
    force, rate = (hold.inv().apply(np.array(values)) for values in (log.force, log.rate))
    return replace(log, force=force, rate=rate, orientation=orientation)


def swung(log: InertialLog) -> InertialLog:
    """The same phone in a hand that swings about a shoulder :data:`ARM_M` away, as a pendulum about its x axis."""
    pace = 2 * np.pi * SWING_HZ

    def arm(time_ns: IntArray) -> _Swing:
        phase = pace * (time_ns - log.force_ns[0]) * 1e-9
        sine = SWING_RAD * np.sin(phase)
        return _Swing(sine, SWING_RAD * pace * np.cos(phase), -(pace**2) * sine)

    return _swinging(log, ARM_M, arm)


def on_thigh(log: InertialLog) -> InertialLog:
    """The same phone in a trouser pocket: turned, and swinging about the hip in time with the steps that it felt.

    A log without a few seconds of readings is only turned.
    """
    signals = WalkSignals.of(log)
    if signals is None:
        return held(log, IN_POCKET_DEG)
    angle = _thigh_rad(signals, log)
    rate = np.gradient(angle, 1 / RATE_HZ)
    curves = angle, rate, np.gradient(rate, 1 / RATE_HZ)

    def thigh(time_ns: IntArray) -> _Swing:
        at_s = (time_ns - signals.start_ns) * 1e-9
        return _Swing(*(np.interp(at_s, signals.time_s, curve) for curve in curves))

    return held(_swinging(log, THIGH_M, thigh), IN_POCKET_DEG)


def sampled(log: InertialLog, every: int, noise_m_s2: float) -> InertialLog:
    """Every so many readings only, with noise, a tenth of which (rad/s) the gyroscope has."""
    rng = np.random.default_rng(0)
    force, rate = log.force[::every], log.rate[::every]
    force = force + rng.normal(0, noise_m_s2, force.shape)
    rate = rate + rng.normal(0, noise_m_s2 / 10, rate.shape)
    return replace(log, force_ns=log.force_ns[::every], force=force, rate_ns=log.rate_ns[::every], rate=rate)


@dataclass(frozen=True)
class _Swing:
    """``angle_rad`` (k,) of a pendulum, its ``rate`` (k,), rad/s, and how that changes (k,), rad/s^2."""

    angle_rad: FloatArray
    rate: FloatArray
    change: FloatArray


def _swinging(log: InertialLog, length_m: float, swing: Callable[[IntArray], _Swing]) -> InertialLog:
    """The same phone at the end of a pendulum about its x axis, of which ``swing`` tells at times (k,), ns."""

    def turn(time_ns: IntArray) -> Rotation:
        return Rotation.from_rotvec(np.outer(swing(time_ns).angle_rad, (1.0, 0.0, 0.0)))

    felt, turned = swing(log.force_ns), swing(log.rate_ns)
    moved = length_m * np.column_stack((0 * felt.rate, felt.change, felt.rate**2))
    force = turn(log.force_ns).inv().apply(np.array(log.force)) + moved
    rate = turn(log.rate_ns).inv().apply(np.array(log.rate)) + np.outer(turned.rate, (1.0, 0.0, 0.0))
    orientation = log.orientation
    if len(orientation):
        orientation = (Rotation.from_quat(np.array(orientation)) * turn(log.orientation_ns)).as_quat()
    return replace(log, force=force, rate=rate, orientation=orientation)


def _thigh_rad(signals: WalkSignals, log: InertialLog) -> FloatArray:
    """How far ahead (n,) a thigh is at each moment, rad: one swing in two steps, none while nobody walks."""
    from scipy.signal import butter, hilbert, sosfiltfilt

    up = Headings.of(signals, log).up
    features = WindowFeatures.of(signals, up)
    steps = butter(3, CADENCE_RANGE_HZ, "band", fs=RATE_HZ, output="sos")
    vertical = sosfiltfilt(steps, np.einsum("ni,ni->n", signals.force, up))
    phase = np.unwrap(np.angle(hilbert(vertical))) / 2
    moving = np.interp(signals.time_s, features.time_s, features.moving)
    return low_pass(THIGH_RAD * moving * (0.5 + np.sin(phase) + RECOIL * np.sin(2 * phase)), BAND_HZ)
