"""Which way somebody walks against where the phone points: a phone in a pocket does not look ahead, but its gait tells.

With each step a body is pushed forwards and upwards, one after the other. Where the horizontal acceleration that goes
with the vertical one points tells the direction of walking in the phone's own frame (as in pedestrian dead reckoning
since Kunze et al. 2009, there by principal components, which do not tell ahead from behind).
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.dead_reckoning.features import CADENCE_RANGE_HZ, WindowFeatures
from vislam2tag.dead_reckoning.heading import FORWARD
from vislam2tag.dead_reckoning.signals import RATE_HZ, WalkSignals

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


def turned_by_gait(signals: WalkSignals, up: FloatArray, features: WindowFeatures) -> float:
    """How far anticlockwise of where the phone points somebody walks, rad; 0 where no gait says that they differ.

    ``up`` (n, 3) is a unit vector in the device's axes.
    """
    from scipy.signal import butter, hilbert, sosfiltfilt

    length = round(WINDOW_S * RATE_HZ)
    count = len(up) // length
    if count < FEWEST_WINDOWS:
        return 0.0
    forward = FORWARD - (up @ FORWARD)[:, None] * up
    forward /= np.maximum(np.linalg.norm(forward, axis=1, keepdims=True), 1e-6)
    steps = butter(3, CADENCE_RANGE_HZ, "band", fs=RATE_HZ, output="sos")
    force = sosfiltfilt(steps, signals.force, axis=0)
    beside = np.einsum("ni,ni->n", force, np.cross(up, forward))
    horizontal = np.einsum("ni,ni->n", force, forward) + 1j * beside
    vertical = hilbert(np.einsum("ni,ni->n", force, up)) * np.exp(-1j * DELAY_RAD)
    moving = np.interp(signals.time_s, features.time_s, features.moving) > 0.5
    push = (horizontal * vertical.real * moving)[: count * length].reshape(count, length).sum(axis=1)
    push = push[np.abs(push) > 0] * np.exp(-1j * AHEAD_RAD)
    if len(push) < FEWEST_WINDOWS or abs((push / np.abs(push)).mean()) < ALIKE:
        return 0.0
    turned = float(np.angle(push.sum()))
    return turned if abs(turned) > LEAST_TURN_RAD else 0.0
