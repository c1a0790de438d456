"""Resampling to a uniform rate by means over its periods: what is integrated stays the same, nothing aliases."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray


def period_means(time_ns: IntArray, values: FloatArray, start_ns: IntArray, samples: int, rate_hz: float) -> FloatArray:
    """Mean of a signal over each of ``samples`` periods from each start: (w, samples, k).

    The signal ``values`` (n, k) is linear between its times (n,), strictly increasing; starts (w,).
    """
    edges_s = (start_ns - time_ns[0])[:, None] * 1e-9 + np.arange(samples + 1) / rate_hz
    return np.diff(_integral(((time_ns - time_ns[0]) * 1e-9), values, edges_s), axis=1) * rate_hz


def _integral(time_s: FloatArray, values: FloatArray, at_s: FloatArray) -> FloatArray:
    """Integral of the piecewise linear signal from its first time to each time (...,): (..., k)."""
    step_s = np.diff(time_s)
    whole = np.cumsum((values[1:] + values[:-1]) / 2 * step_s[:, None], axis=0)
    whole = np.concatenate((np.zeros((1, values.shape[1])), whole))
    before = np.clip(np.searchsorted(time_s, at_s, side="right") - 1, 0, len(step_s) - 1)
    beyond_s = (at_s - time_s[before])[..., None]
    slope = (values[before + 1] - values[before]) / step_s[before][..., None]
    integral: FloatArray = whole[before] + beyond_s * (values[before] + slope * beyond_s / 2)
    return integral
