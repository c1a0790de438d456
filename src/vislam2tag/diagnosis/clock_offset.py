"""By how much the clock of the inertial sensors is off that of the poses, however much: both see the same turns.

The lag of pose stamps, at most half a second, is another thing (:mod:`vislam2tag.core.pose_lag`).
"""

from __future__ import annotations

import numpy as np
import polars as pl
from scipy.signal import correlate

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.orientation import turns_rad
from vislam2tag.core.tracks import CameraTrack

STEP_S = 0.05
LEAST_OVERLAP_S = 40.0
LEAST_CORRELATION = 0.7
"""Below this the two do not describe the same motion ..."""
LEAST_MARGIN = 0.15
"""... nor where another offset, farther than this off, fits nearly as well."""
OTHER_OFFSET_S = 2.0
FEWEST_SAMPLES = 200
FASTEST_RAD_PER_S = 20.0


def sensor_clock_offset_s(camera: CameraTrack, sensors: pl.DataFrame) -> float | None:
    """What to add to the sensors' times (a session's table), seconds; None where the turns do not tell."""
    usable = camera.usable
    time_ns, orientation = camera.time_ns[usable], camera.orientation_acs[usable]
    gyro = sensors.filter((pl.col("sensor") == "GYRO") & ~pl.col("repeated")).sort("time_ns")
    if len(time_ns) < FEWEST_SAMPLES or len(gyro) < FEWEST_SAMPLES:
        return None
    gyro_ns = gyro["time_ns"].to_numpy()
    frame_speed = turns_rad(orientation) / np.maximum(np.diff(time_ns) * 1e-9, 1e-6)
    seen = _resampled(time_ns[1:], frame_speed)
    felt = _resampled(gyro_ns, np.linalg.norm(gyro.select("v1", "v2", "v3").to_numpy(), axis=1))
    shift = _best_shift(seen, felt)
    return None if shift is None else shift + float(time_ns[1] - gyro_ns[0]) * 1e-9


def _resampled(time_ns: IntArray, speed: FloatArray) -> FloatArray:
    """Speeds every :data:`STEP_S` from the first one on, each a mean over a few samples, capped."""
    elapsed_s = (time_ns - time_ns[0]) * 1e-9
    capped = np.clip(np.nan_to_num(speed), 0.0, FASTEST_RAD_PER_S)
    bins = (elapsed_s / STEP_S).astype(np.int64)
    count = np.bincount(bins)
    mean = np.bincount(bins, capped) / np.maximum(count, 1)
    there = np.flatnonzero(count)
    return np.asarray(np.interp(np.arange(len(count)), there, mean[there]))


def _best_shift(seen: FloatArray, felt: FloatArray) -> float | None:
    """By how many seconds to delay the second series so that it fits the first; None where that is not clear."""
    ones = [np.ones(len(series)) for series in (seen, felt)]
    overlap = correlate(ones[0], ones[1])
    sums = [correlate(seen, ones[1]), correlate(ones[0], felt)]
    squares = [correlate(seen**2, ones[1]), correlate(ones[0], felt**2)]
    count = np.maximum(overlap, 1.0)
    spread = [
        np.maximum(square / count - (total / count) ** 2, 1e-12) for square, total in zip(squares, sums, strict=True)
    ]
    together = correlate(seen, felt) / count - sums[0] * sums[1] / count**2
    correlation = np.where(overlap * STEP_S >= LEAST_OVERLAP_S, together / np.sqrt(spread[0] * spread[1]), -1.0)
    best = int(np.argmax(correlation))
    apart = np.abs(np.arange(len(correlation)) - best) * STEP_S > OTHER_OFFSET_S
    second = float(correlation[apart].max(initial=-1.0))
    if correlation[best] < LEAST_CORRELATION or correlation[best] - second < LEAST_MARGIN:
        return None
    return (best - (len(felt) - 1)) * STEP_S
