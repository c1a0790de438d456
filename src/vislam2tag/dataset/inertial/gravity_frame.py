"""The phone's orientation in a level frame: z up, heading free (docs/reference/imu-windows.md)."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.orientation import multiply
from vislam2tag.dataset.inertial.sensor_series import RotationSeries, SensorSeries

GRAVITY_MEMORY_S = 3.0
"""Standard deviation of the weights by which the filter averages gravity: longer than a stride, shorter than drift."""

_GREATEST_COMPONENT = 2.0
"""A unit quaternion has none beyond 1; what is clearly more is no rotation."""


class LevelOrientation(RotationSeries):
    """``level_R_body`` at any time between its readings."""


def logged_orientation(game_rotation: SensorSeries) -> LevelOrientation:
    """Take Android's game rotation vector (``v1`` to ``v4``: x, y, z and w, which old phones leave 0)."""
    quaternion = game_rotation.values.copy()
    quaternion[~(np.abs(quaternion) <= _GREATEST_COMPONENT).all(axis=1)] = 0.0
    implied = np.sqrt(np.maximum(1 - np.sum(quaternion[:, :3] ** 2, axis=1), 0.0))
    quaternion[:, 3] = np.where(quaternion[:, 3] == 0, implied, quaternion[:, 3])
    turns = np.linalg.norm(quaternion, axis=1) > 0
    quaternion[~turns] = (0.0, 0.0, 0.0, 1.0)
    return LevelOrientation(game_rotation.time_ns, Rotation.from_quat(quaternion))


def filtered_orientation(accelerometer: SensorSeries, gyroscope: SensorSeries) -> LevelOrientation:
    """Integrate the gyroscope (rad/s), and level it by gravity averaged in the integrated frame (m/s^2).

    A complementary filter without delay: the average of the accelerometer before and after, seen from the frame of the
    gyroscope, is gravity but for what its drift turns within a few seconds.
    """
    time_s = (gyroscope.time_ns - gyroscope.time_ns[0]) * 1e-9
    turn = (gyroscope.values[1:] + gyroscope.values[:-1]) / 2 * np.diff(time_s)[:, None]
    start_R_body = Rotation.from_quat(_running_product(Rotation.from_rotvec(turn).as_quat()))
    at_s = (accelerometer.time_ns - gyroscope.time_ns[0]) * 1e-9
    force = np.column_stack([np.interp(time_s, at_s, axis) for axis in accelerometer.values.T])
    memory = GRAVITY_MEMORY_S / np.median(np.diff(time_s))
    up = gaussian_filter1d(start_R_body.apply(force), memory, axis=0, mode="reflect")
    return LevelOrientation(gyroscope.time_ns, _upright(up) * start_R_body)


def _running_product(quaternion: FloatArray) -> FloatArray:
    """Products (n + 1, 4) of the first 0, 1, ... n quaternions (n, 4), by doubling: log2(n) vectorised steps."""
    product = np.concatenate((np.array([[0.0, 0.0, 0.0, 1.0]]), quaternion))
    reach = 1
    while reach < len(product):
        product[reach:] = multiply(product[:-reach], product[reach:])
        reach *= 2
    unit: FloatArray = product / np.linalg.norm(product, axis=1, keepdims=True)
    return unit


def _upright(up: FloatArray) -> Rotation:
    """Return the smallest rotations that turn the directions (n, 3) up."""
    x, y, z = (up / np.linalg.norm(up, axis=1, keepdims=True)).T
    angle = np.arccos(z.clip(-1, 1)) / np.maximum(np.hypot(x, y), 1e-12)
    return Rotation.from_rotvec(np.column_stack((y * angle, -x * angle, np.zeros_like(x))))
