"""Gait: features of short windows, the speed from them, and the direction of walking against that of the phone.

The gait shows the direction of walking even for a phone in a pocket. Each step pushes the body upwards and forwards,
one after the other. The horizontal acceleration in phase with the vertical one points in the direction of walking, in
the phone's frame. (Pedestrian dead reckoning since Kunze et al. 2009 uses principal components, which do not
distinguish forward from backward.) On a thigh the swing of the leg is stronger: a thigh turns about the lateral axis,
and faster forward than backward.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.estimation.dead_reckoning.signals import BAND_HZ, FORWARD, RATE_HZ, WalkSignals, low_pass

WINDOW_S = 2.0
HOP_S = 0.25
SLOW_HZ = 0.4
"""Slower changes are from gravity and sensor drift."""
CADENCE_HZ = (1.2, 2.8)
"""Range in which the step frequency is searched; the result is limited to :data:`CADENCE_RANGE_HZ`."""
CADENCE_RANGE_HZ = (1.3, 2.6)
SPECTRUM = 512
STANDING_M_S2 = 0.6
"""Vertical acceleration (root mean square) below which a person probably stands."""
SWINGING_RAD_S = 0.9
"""A phone that tilts by more (root mean square) swings in a hand instead of being looked at."""
_SHAPES = (
    "one",
    "cadence",
    "cadence squared",
    "bounce",
    "bounce by cadence",
    "vertical acceleration",
    "horizontal acceleration",
    "tilting",
    "turning",
    "regularity",
    "second harmonic",
    "slow part",
    "turn rate",
    "skewness",
)
NAMES = (*_SHAPES, *(f"{name}, swinging" for name in _SHAPES))
"""Features of a still phone, then of a swinging one, because their relations to speed differ."""


@dataclass(frozen=True)
class WindowFeatures:
    """``time_s`` (m,) middles of the windows; ``values`` (m, 28) by :data:`NAMES`; ``moving`` (m,) from 0 (standing) to
    1; ``swinging`` (m,) from 0 (still phone) to 1.
    """

    time_s: FloatArray
    values: FloatArray
    moving: FloatArray
    swinging: FloatArray

    @classmethod
    def of(cls, signals: WalkSignals, up: FloatArray) -> WindowFeatures:
        """Compute features of the two seconds around every quarter of a second; ``up`` (n, 3) is a unit vector."""
        middle = np.arange(0, len(up), round(HOP_S * RATE_HZ))
        taper = np.hanning(round(WINDOW_S * RATE_HZ) + 2)[1:-1]
        taper /= taper.sum()
        force, rate = low_pass(signals.force, BAND_HZ, 4), low_pass(signals.rate, BAND_HZ, 4)
        force, turning = force - low_pass(force, SLOW_HZ), np.einsum("ni,ni->n", rate, up)
        rate = rate - low_pass(rate, SLOW_HZ)
        vertical = np.einsum("ni,ni->n", force, up)
        horizontal = np.einsum("ni,ni->n", force, force) - vertical**2
        yaw = np.einsum("ni,ni->n", rate, up)
        tilt = np.einsum("ni,ni->n", rate, rate) - yaw**2
        windows = _windows(vertical, middle, len(taper))
        squares = windows * windows
        power = squares @ taper
        mean = {
            "horizontal": _windows(horizontal, middle, len(taper)) @ taper,
            "tilt": _windows(tilt, middle, len(taper)) @ taper,
            "yaw": _windows(yaw**2, middle, len(taper)) @ taper,
            "turn": np.abs(_windows(turning, middle, len(taper)) @ taper),
        }
        cadence, spectral = _spectrum(windows * taper)
        low, high = np.percentile(windows, (3, 97), axis=1)
        bounce = (high - low) ** 0.25 - 1.6
        skewness = (squares * windows) @ taper / (power + 1e-6) ** 1.5
        shapes = np.column_stack(
            (
                np.ones(len(middle)),
                cadence - 1.8,
                (cadence - 1.8) ** 2,
                bounce,
                bounce * (cadence - 1.8),
                *(_log_rms(each) for each in (power, mean["horizontal"], mean["tilt"], mean["yaw"])),
                spectral,
                mean["turn"],
                skewness,
            )
        )
        moving = _rather(_log_rms(power), STANDING_M_S2)
        swinging = _rather(_log_rms(mean["tilt"]), SWINGING_RAD_S)
        values = np.column_stack((shapes * (1 - swinging)[:, None], shapes * swinging[:, None]))
        return cls(signals.time_s[middle], values, moving, swinging)


def _windows(values: FloatArray, middle: IntArray, size: int) -> FloatArray:
    """Windows (m, size) of values (n,) around their middles (m,), mirrored at the ends."""
    padded = np.pad(values, size // 2, mode="reflect" if len(values) > size // 2 else "edge")
    return np.asarray(np.lib.stride_tricks.sliding_window_view(padded, size)[middle])


def _log_rms(power: FloatArray) -> FloatArray:
    return np.asarray(0.5 * np.log(np.maximum(power, 1e-3)))


def _rather(log_rms: FloatArray, limit: float) -> FloatArray:
    """From 0 (far below the limit) to 1 (far above it)."""
    return np.asarray(1 / (1 + np.exp(-4 * (log_rms - np.log(limit)))))


def _spectrum(windows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Step frequency (m,) of tapered windows (m, w), and shares of power (m, 3): peak, harmonic, slow part."""
    spectrum = np.fft.rfft(windows, SPECTRUM, axis=1)
    power = spectrum.real**2 + spectrum.imag**2
    frequency = np.fft.rfftfreq(SPECTRUM, 1 / RATE_HZ)
    band = np.flatnonzero((frequency > CADENCE_HZ[0]) & (frequency < CADENCE_HZ[1]))
    best = power[:, band].argmax(axis=1)
    rows, inner = np.arange(len(best)), band[best.clip(1, len(band) - 2)]
    before, at, after = (np.log(power[rows, inner + step] + 1e-12) for step in (-1, 0, 1))
    beside = (0.5 * (before - after) / (before - 2 * at + after - 1e-9)).clip(-0.5, 0.5)
    cadence = (frequency[inner] + beside * frequency[1]).clip(*CADENCE_RANGE_HZ)
    total = power[:, frequency > 0.3].sum(axis=1) + 1e-9
    harmonic = power[:, (frequency > 2.8) & (frequency < 5.5)].sum(axis=1)
    slow = power[:, (frequency > 0.4) & (frequency < 1.2)].sum(axis=1)
    return cadence, np.column_stack((power[rows, band[best]] / total - 0.5, harmonic / total, slow / total))


COEFFICIENTS = "speed_model.json"
"""File of the package with the coefficients and their training data."""
FASTEST_M_S = 3.0


@dataclass(frozen=True)
class SpeedModel:
    """``coefficients`` (28,) by :data:`~vislam2tag.estimation.dead_reckoning.gait.NAMES`, m/s."""

    coefficients: FloatArray

    def speed_m_s(self, features: WindowFeatures, time_s: FloatArray) -> FloatArray:
        """Speed (n,) at the moments ``time_s`` (n,) of a walk, m/s."""
        window = (features.values @ self.coefficients).clip(0, FASTEST_M_S) * features.moving
        return np.asarray(np.interp(time_s, features.time_s, window))


@cache
def speed_model() -> SpeedModel:
    """The model of the package."""
    record = json.loads(files(__package__).joinpath(COEFFICIENTS).read_text(encoding="utf-8"))
    return SpeedModel(np.array([record["coefficients"][name] for name in NAMES]))


DELAY_RAD = np.radians(75)
"""Phase by which the horizontal acceleration in one direction is behind the vertical one ..."""
AHEAD_RAD = np.radians(156)
"""... and its direction relative to the walker's view; both from the 60 walks of site 1, floor F1, phone in the
hand."""
GAIT_WINDOW_S = 4.0
FEWEST_WINDOWS = 4
ALIKE = 0.85
"""Required agreement of windows (length of their mean direction). On 86 real walks with this agreement, phones in the
hand, the gait had errors of at most 31 degrees."""
LEAST_TURN_RAD = 0.8
"""For smaller angles a phone in the hand is assumed to point forward."""
LEG_RAD_S = 1.2
"""A phone on a thigh tilts by more than this (root mean square) ..."""
ABOUT_ONE_AXIS = 0.6
"""... about one axis (length of the mean of its doubled directions, weighted by power) ..."""
LOPSIDED = 0.3
"""... and unevenly (skewness): legs swing forward in two fifths of a stride. Three of 60 hands swung as much."""


def turned_by_gait(signals: WalkSignals, up: FloatArray, features: WindowFeatures) -> float:
    """Angle from the phone's direction to that of walking, counter-clockwise, rad; 0 if no gait shows a difference.

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
    """Direction of walking from the turning (n,) of a leg about level axes, rad/s; 0 if no leg swings.

    A swing along the phone's direction may be that of a hand, which then points forward.
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
    """Direction in which the steps push; 0 if windows disagree, or few have steps."""
    length = round(GAIT_WINDOW_S * RATE_HZ)
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
    """The level part (n,) of vectors (n, 3): real in the phone's direction, imaginary to its left."""
    return np.asarray(np.einsum("ni,ni->n", values, forward) + 1j * np.einsum("ni,ni->n", values, left))
