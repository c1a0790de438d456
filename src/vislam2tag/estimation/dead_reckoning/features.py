"""What short windows of walking look like, whatever the phone's rate and however it is turned about the vertical."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.estimation.dead_reckoning.signals import BAND_HZ, RATE_HZ, WalkSignals, low_pass

WINDOW_S = 2.0
HOP_S = 0.25
SLOW_HZ = 0.4
"""Slower changes are gravity's and the sensors' own."""
CADENCE_HZ = (1.2, 2.8)
"""Where the steps' frequency is looked for; what is found is kept within :data:`CADENCE_RANGE_HZ`."""
CADENCE_RANGE_HZ = (1.3, 2.6)
SPECTRUM = 512
STANDING_M_S2 = 0.6
"""Vertical acceleration (root mean square) below which somebody rather stands."""
SWINGING_RAD_S = 0.9
"""A phone that tilts to and fro by more (root mean square) swings in a hand rather than being looked at."""
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
"""Each number counts for a quiet phone or for a swinging one: the speeds that it tells of differ."""


@dataclass(frozen=True)
class WindowFeatures:
    """``time_s`` (m,) the windows' middles; ``values`` (m, 28) by :data:`NAMES`; ``moving`` (m,) from 0, standing, to
    1; ``swinging`` (m,) from 0, a phone held still, to 1.
    """

    time_s: FloatArray
    values: FloatArray
    moving: FloatArray
    swinging: FloatArray

    @classmethod
    def of(cls, signals: WalkSignals, up: FloatArray) -> WindowFeatures:
        """Describe the two seconds around every quarter of a second; ``up`` (n, 3) is a unit vector."""
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
    """From 0, far below the limit, to 1, far above it."""
    return np.asarray(1 / (1 + np.exp(-4 * (log_rms - np.log(limit)))))


def _spectrum(windows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Steps a second (m,) of tapered windows (m, w), and (m, 3) shares of power: their peak, harmonic, slow part."""
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
