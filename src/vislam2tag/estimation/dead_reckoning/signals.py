"""Inertial readings on one clock of 50 Hz, and the heading from them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.context import InertialLog

RATE_HZ = 50.0
BAND_HZ = 6.0
"""Bandwidth of walking, which sensors of 15 Hz or more cover."""
SHORTEST_S = 2.0
LONGEST_GAP_S = 0.3
"""Longest gap between two readings; motion in longer gaps is unknown."""
_MOST = 1e9
"""Larger readings, m/s^2 or rad/s, are from damaged files; their squares may overflow."""


@dataclass(frozen=True)
class WalkSignals:
    """A walk's sensors at ``n`` moments, 50 a second.

    ``start_ns`` is the first moment, and ``time_s`` (n,) are seconds since then. ``force`` (n, 3) is the specific
    force, m/s^2, and ``rate`` (n, 3) the angular velocity, rad/s, both in the device's axes. ``known`` (n,) is a mask
    of moments that are not in a gap between readings.
    """

    start_ns: int
    time_s: FloatArray
    force: FloatArray
    rate: FloatArray
    known: BoolArray

    @classmethod
    def of(cls, log: InertialLog) -> WalkSignals | None:
        """Resample a log; None if accelerometer and gyroscope have less than a few seconds in common, or if values are
        impossible.
        """
        if min(len(log.force_ns), len(log.rate_ns)) < 2 or max(np.abs(log.force).max(), np.abs(log.rate).max()) > _MOST:
            return None
        start_ns = int(max(log.force_ns[0], log.rate_ns[0]))
        duration_s = float(min(log.force_ns[-1], log.rate_ns[-1]) - start_ns) * 1e-9
        if duration_s < SHORTEST_S:
            return None
        time_s = np.arange(0.0, duration_s, 1 / RATE_HZ)
        known = ~(_in_gap(time_s, log.force_ns, start_ns) | _in_gap(time_s, log.rate_ns, start_ns))
        force = _averaged(time_s, log.force_ns, log.force, start_ns)
        return cls(start_ns, time_s, force, _averaged(time_s, log.rate_ns, log.rate, start_ns), known)


def low_pass(values: FloatArray, cutoff_hz: float, order: int = 2) -> FloatArray:
    """Low-pass filter for values (n, ...) at 50 Hz, without delay.

    A Butterworth filter run forwards and backwards over values that are continued beyond both ends by point reflection,
    like SciPy's ``sosfiltfilt``, which takes half a second to import. Each run solves a banded triangular system.
    """
    from scipy.linalg.lapack import dtbtrs  # not needed for walks without a loss

    pad = min(len(values) - 1, int(6 * RATE_HZ))
    before, after = 2 * values[0] - values[pad:0:-1], 2 * values[-1] - values[-2 : -2 - pad : -1]
    smooth = np.asfortranarray(np.concatenate((before, values, after)).reshape(pad + len(values) + pad, -1))
    feedback, gain = _butterworth(cutoff_hz, order)
    bands = np.tile(feedback, (len(smooth), 1)).T
    for _ in range(2):
        start = smooth[0]  # steady state before the first value
        driven = gain * (smooth - start)
        for _ in range(order):
            driven[1:] += driven[:-1]
        smooth = (dtbtrs(bands, driven, uplo="L", overwrite_b=True)[0] + start)[::-1]
    return np.ascontiguousarray(smooth[pad : pad + len(values)]).reshape(values.shape)


@cache
def _butterworth(cutoff_hz: float, order: int) -> tuple[FloatArray, float]:
    """Coefficients (order + 1,) of outputs of a digital low-pass, the latest first, and the gain of its inputs.

    By the bilinear transform; the inputs' coefficients are the gain times those of ``(1 + x) ** order``.
    """
    poles = np.tan(np.pi * cutoff_hz / RATE_HZ) * np.exp(0.5j * np.pi * (1 + (2 * np.arange(order) + 1) / order))
    feedback: FloatArray = np.asarray(np.poly((1 + poles) / (1 - poles)).real, dtype=np.float64)
    return feedback, float(feedback.sum()) / 2**order


def _averaged(time_s: FloatArray, time_ns: IntArray, values: FloatArray, start_ns: int) -> FloatArray:
    """Mean (n, c) over the interval around each moment (n,) of readings (k, c), linear between them."""
    at = (time_ns - start_ns) * 1e-9
    edges = np.append(time_s, time_s[-1] + 1 / RATE_HZ) - 0.5 / RATE_HZ
    # The integral of a linear signal is quadratic: adding the edges to the readings makes it exact.
    both = np.sort(np.concatenate((at, edges)), kind="stable")  # a stable sort merges sorted parts
    level = np.stack([np.interp(both, at, column) for column in values.T], axis=1)
    parts = (level[1:] + level[:-1]) / 2 * np.diff(both)[:, None]
    integral = np.concatenate((np.zeros((1, values.shape[1])), np.cumsum(parts, axis=0)))
    return np.asarray(np.diff(integral[np.searchsorted(both, edges)], axis=0) * RATE_HZ)


def _in_gap(time_s: FloatArray, time_ns: IntArray, start_ns: int) -> BoolArray:
    """Mask (n,) of the moments between readings (k,) that are too far apart."""
    at = (time_ns - start_ns) * 1e-9
    after = np.searchsorted(at, time_s).clip(1, len(at) - 1)
    return np.asarray(at[after] - at[after - 1] > LONGEST_GAP_S)


GRAVITY_HZ = 0.3
"""Steps are faster than this, and tilting the phone is slower."""
COMPASS_HZ = 0.25
FORWARD = np.array((0.0, 1.0, -1.0)) / np.sqrt(2)
"""Direction of view in a phone's axes: the top edge of a flat phone and the back of an upright one point forward."""


@dataclass(frozen=True)
class Headings:
    """``up`` (n, 3) unit vectors in the device's axes; ``turned_rad`` (n,) rotation about them since the start,
    counter-clockwise; ``drift_rad`` (n,) the walker's heading by the phone's own, from east, minus ``turned_rad``,
    slow: NaN if it has none.
    """

    up: FloatArray
    turned_rad: FloatArray
    drift_rad: FloatArray

    @classmethod
    def of(cls, signals: WalkSignals, log: InertialLog) -> Headings:
        """Integrate the gyroscope about gravity and compare with the rotation vector, if there is one."""
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
    # Directions are interpolated as unwrapped angles, because components of quaternions flip their signs.
    heading = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    at = (log.orientation_ns - signals.start_ns) * 1e-9
    return low_pass(np.interp(signals.time_s, at, heading) - turned_rad, COMPASS_HZ)
