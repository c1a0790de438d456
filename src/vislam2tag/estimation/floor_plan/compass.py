"""The direction of a walk by the phone's rotation vector, which knows north to some 25 degrees indoors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.estimation.odometry import Odometry

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

SAMPLES = 200
"""Moments that are compared, evenly spread over the walk."""
AWAY_S = 0.2
"""A reading further from a frame is not compared with it."""
MOST_TILT = 0.3
"""Mean sine of the angle between both verticals; more means that the axes of camera and sensors do not fit."""


def compass_turn_rad(camera: CameraTrack, odometry: Odometry) -> float | None:
    """Turn of the continuous frame relative to east and north (``enu_R_continuous``), rad, mean over the walk.

    Camera and sensors have their axes turned about the view by a multiple of 90 degrees, which gravity shows. None if
    the phone has no rotation vector.
    """
    from scipy.spatial.transform import Rotation  # slow to load, and findings need this module's constants only

    log = camera.inertial
    if log is None or not len(log.orientation_ns):
        return None
    rows = np.unique(np.linspace(0, len(odometry.frame) - 1, SAMPLES).astype(np.int64))
    frame = odometry.frame[rows]
    at = np.searchsorted(log.orientation_ns, camera.time_ns[frame]).clip(0, len(log.orientation_ns) - 1)
    near = np.abs(log.orientation_ns[at] - camera.time_ns[frame]) < AWAY_S * 1e9
    if not near.any():
        return None
    device = Rotation.from_quat(log.orientation[at[near]])
    acs_from_camera = Rotation.from_quat(camera.orientation_acs[frame[near]])
    turned = [
        _turns(device * Rotation.from_euler("z", 90 * quarter, degrees=True) * acs_from_camera.inv())
        for quarter in range(4)
    ]
    turn, tilt = min(turned, key=lambda one: float(one[1].mean()))
    if tilt.mean() > MOST_TILT:
        return None
    drift = np.angle(odometry.turn[rows[near]])
    return float(np.angle(np.exp(1j * (turn - drift)).mean()))


def _turns(enu_from_acs: Rotation) -> tuple[FloatArray, FloatArray]:
    """Turns (k,) about the vertical, rad, and sines (k,) of the angles between both verticals."""
    east, up = enu_from_acs.apply([1.0, 0.0, 0.0]), enu_from_acs.apply([0.0, 1.0, 0.0])
    return np.arctan2(east[:, 1], east[:, 0]), np.hypot(up[:, 0], up[:, 1]) + (up[:, 2] < 0)
