"""By how much the clock of the inertial sensors is off that of the poses, however much: both see the same turns.

The lag of pose stamps, at most half a second, is another thing (:mod:`vislam2tag.core.pose_lag`).
"""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.clock_alignment import LEAST_MARGIN, best_shift, comparable, resampled
from vislam2tag.core.orientation import turns_rad
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.sessions.readings import readings_of

LEAST_CORRELATION = 0.7
"""Below this the two do not describe the same motion: they are of one phone."""
FEWEST_SAMPLES = 200
FASTEST_RAD_PER_S = 20.0


def sensor_clock_offset_s(camera: CameraTrack, sensors: pl.DataFrame) -> float | None:
    """What to add to the sensors' times (a session's table), seconds; None where the turns do not tell."""
    usable = camera.usable
    time_ns, orientation = camera.time_ns[usable], camera.orientation_acs[usable]
    gyro_ns, turning = readings_of(sensors, "GYRO", ("v1", "v2", "v3"))
    if len(time_ns) < FEWEST_SAMPLES or len(gyro_ns) < FEWEST_SAMPLES:
        return None
    if not comparable(time_ns, gyro_ns):
        return None
    frame_speed = turns_rad(orientation) / np.maximum(np.diff(time_ns) * 1e-9, 1e-6)
    seen = resampled(time_ns[1:], _capped(frame_speed))
    felt = resampled(gyro_ns, _capped(np.linalg.norm(turning, axis=1)))
    found = best_shift(seen, felt)
    if found.correlation < LEAST_CORRELATION or found.correlation - found.other < LEAST_MARGIN:
        return None
    return found.shift_s + float(time_ns[1] - gyro_ns[0]) * 1e-9


def _capped(speed: FloatArray) -> FloatArray:
    return np.clip(np.nan_to_num(speed), 0.0, FASTEST_RAD_PER_S)
