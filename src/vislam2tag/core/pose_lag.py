"""How much later the pose stamps are than the gyroscope says (poses are stamped when drawn, not when exposed)."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.orientation import turns_rad

MAX_LAG_S = 0.5
STEP_S = 0.02
MAX_FRAMES = 2700
"""Frames looked at: a minute and a half at 30 Hz settles the lag."""
MIN_SAMPLES = 100
MIN_CORRELATION = 0.6
"""Below this the two angular speeds do not describe the same motion."""


def estimate_pose_lag(
    frame_time_ns: IntArray, orientation: FloatArray, gyro_time_ns: IntArray, gyro_rad_per_s: FloatArray
) -> float | None:
    """Lag of the pose stamps in seconds (positive: stamped late), by correlating angular speeds.

    ``orientation`` (n, 4) quaternions at ``frame_time_ns`` (n,), increasing; ``gyro_rad_per_s`` (g, 3) at
    ``gyro_time_ns`` (g,), increasing. Returns None where too little overlaps or the two do not correlate.
    """
    middle_s, speed = angular_speed(frame_time_ns[:MAX_FRAMES], orientation[:MAX_FRAMES])
    if len(gyro_time_ns) < MIN_SAMPLES or len(middle_s) < MIN_SAMPLES:
        return None
    gyro_s = (gyro_time_ns - frame_time_ns[0]) * 1e-9
    gyro_speed = np.linalg.norm(gyro_rad_per_s, axis=1)
    inside = (middle_s > gyro_s[0] + MAX_LAG_S) & (middle_s < gyro_s[-1] - MAX_LAG_S)
    middle_s, speed = middle_s[inside], speed[inside]
    if len(middle_s) < MIN_SAMPLES or not speed.std() > 0:
        return None
    lags = np.arange(-MAX_LAG_S, MAX_LAG_S + STEP_S / 2, STEP_S)
    shifted = np.interp(middle_s - lags[:, None], gyro_s, gyro_speed)
    return peak_of(lags, correlation_of_rows(shifted, speed), STEP_S, MIN_CORRELATION)


def angular_speed(time_ns: IntArray, orientation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mid-times (k,), s since the first frame, and turn rates (k,), rad/s, between neighbouring frames.

    ``time_ns`` (n,) increases; ``orientation`` (n, 4). Steps twice as long as usual are left out.
    """
    elapsed_s = (time_ns - time_ns[:1]) * 1e-9
    step_s = np.diff(elapsed_s)
    angle = turns_rad(orientation)
    steady = step_s < 2 * np.median(step_s) if len(step_s) else np.zeros(0, dtype=bool)
    return (elapsed_s[1:] - step_s / 2)[steady], (angle / np.maximum(step_s, 1e-9))[steady]


def correlation_of_rows(candidates: FloatArray, reference: FloatArray) -> FloatArray:
    """Pearson correlation of each row of ``candidates`` (c, n) with ``reference`` (n,)."""
    centred = candidates - candidates.mean(axis=1, keepdims=True)
    norm = np.linalg.norm(centred, axis=1) * np.linalg.norm(reference - reference.mean())
    correlation: FloatArray = centred @ (reference - reference.mean()) / np.maximum(norm, 1e-12)
    return correlation


def peak_of(lags: FloatArray, correlation: FloatArray, step_s: float, least: float) -> float | None:
    """Lag of the greatest correlation (c,) at lags (c,), s, ``step_s`` apart, refined by a parabola.

    None where that correlation is below ``least`` or at either end.
    """
    best = int(np.argmax(correlation))
    if correlation[best] < least or best in (0, len(lags) - 1):
        return None
    left, middle, right = correlation[best - 1 : best + 2]
    curvature = left - 2 * middle + right
    offset = 0.5 * (left - right) / curvature if curvature < 0 else 0.0
    return float(lags[best] + offset * step_s)
