"""Which way somebody walks against where the phone points: a phone in a pocket does not look ahead, but its gait tells.

With each step a body is pushed forwards and upwards, one after the other. Where the horizontal acceleration that goes
with the vertical one points tells the direction of walking in the phone's own frame (as in pedestrian dead reckoning
since Kunze et al. 2009, there by principal components, which do not tell ahead from behind). On a thigh, the swing of
the leg is stronger than that: a thigh turns about the line across the way, and quicker ahead than back.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray
from vislam2tag.estimation.dead_reckoning.features import CADENCE_RANGE_HZ, SLOW_HZ, WindowFeatures
from vislam2tag.estimation.dead_reckoning.heading import FORWARD
from vislam2tag.estimation.dead_reckoning.signals import BAND_HZ, RATE_HZ, WalkSignals, low_pass

DELAY_RAD = np.radians(75)
"""So far in a step the horizontal acceleration that points one way lies behind the vertical one ..."""
AHEAD_RAD = np.radians(156)
"""... and so it points, seen from where a walker looks: both on the 60 walks of site 1, floor F1, phone in the hand."""
WINDOW_S = 4.0
FEWEST_WINDOWS = 4
ALIKE = 0.85
"""Windows must agree so well (length of their mean direction): where they did on 86 real walks, phones in the hand, the
gait was never more than 31 degrees off."""
LEAST_TURN_RAD = 0.8
"""A phone in the hand points ahead as well as the gait tells."""
LEG_RAD_S = 1.2
"""A phone on a thigh tilts to and fro by more (root mean square) ..."""
ABOUT_ONE_AXIS = 0.6
"""... about one axis (length of the mean of its doubled directions, weighted by power) ..."""
LOPSIDED = 0.3
"""... and so unevenly (skewness): legs swing ahead in two fifths of a stride. Of 60 hands three swung as much."""


def turned_by_gait(signals: WalkSignals, up: FloatArray, features: WindowFeatures) -> float:
    """How far anticlockwise of where the phone points somebody walks, rad; 0 where no gait says that they differ.

    ``up`` (n, 3) is a unit vector in the device's axes.
    """
    forward = FORWARD - (up @ FORWARD)[:, None] * up
    forward /= np.maximum(np.linalg.norm(forward, axis=1, keepdims=True), 1e-6)
    left = np.cross(up, forward)
    moving = np.interp(signals.time_s, features.time_s, features.moving) > 0.5
    rate = low_pass(signals.rate, BAND_HZ, 4)
    rate -= low_pass(rate, SLOW_HZ)
    ahead = _ahead_by_swing(_level(rate, forward, left)[moving]) or _ahead_by_push(signals, up, forward, left, moving)
    turned = float(np.angle(ahead))
    return turned if ahead and abs(turned) > LEAST_TURN_RAD else 0.0


def _ahead_by_swing(tilting: ComplexArray) -> complex:
    """Where a leg's walker goes, by its turning (n,) about level axes, rad/s; 0 where no leg swings.

    What swings along where the phone points may be a hand, which then points ahead.
    """
    if not len(tilting):
        return 0.0
    power = float(np.mean(np.abs(tilting) ** 2))
    axis = complex(np.mean(tilting**2)) / max(power, 1e-9)
    if power < LEG_RAD_S**2 or abs(axis) < ABOUT_ONE_AXIS:
        return 0.0
    right = np.exp(0.5j * np.angle(axis))
    if abs(right.imag) > np.cos(LEAST_TURN_RAD):
        return 1.0
    about = (tilting * right.conjugate()).real
    skewness = float(np.mean(about**3) / np.mean(about**2) ** 1.5)
    return complex(1j * right * np.sign(skewness)) if abs(skewness) > LOPSIDED else 0.0


def _ahead_by_push(
    signals: WalkSignals, up: FloatArray, forward: FloatArray, left: FloatArray, moving: BoolArray
) -> complex:
    """Where the steps push; 0 where windows disagree, or few have steps."""
    length = round(WINDOW_S * RATE_HZ)
    count = len(up) // length
    if count < FEWEST_WINDOWS:
        return 0.0
    from scipy.signal import butter, hilbert, sosfiltfilt

    steps = butter(3, CADENCE_RANGE_HZ, "band", fs=RATE_HZ, output="sos")
    force = sosfiltfilt(steps, signals.force, axis=0)
    vertical = hilbert(np.einsum("ni,ni->n", force, up)) * np.exp(-1j * DELAY_RAD)
    pushed = _level(force, forward, left) * vertical.real * moving
    push = pushed[: count * length].reshape(count, length).sum(axis=1)
    push = push[np.abs(push) > 0] * np.exp(-1j * AHEAD_RAD)
    if len(push) < FEWEST_WINDOWS or abs((push / np.abs(push)).mean()) < ALIKE:
        return 0.0
    return complex(push.sum())


def _level(values: FloatArray, forward: FloatArray, left: FloatArray) -> ComplexArray:
    """The level part (n,) of vectors (n, 3): real where the phone points, imaginary to the left of that."""
    return np.asarray(np.einsum("ni,ni->n", values, forward) + 1j * np.einsum("ni,ni->n", values, left))
