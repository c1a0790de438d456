"""Axes of other trackers' cameras and frames, turned into those of the ACS and of the camera as we have it.

A camera has x to the right of its picture, y up, z towards whoever looks at the picture (OpenGL, ARKit, ARCore), and
the ACS has y up. Computer vision has the camera's y down and z ahead, and robotics its frame's z up.
"""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.orientation import multiply
from vislam2tag.sessions.tables.camera import POSE_COLUMNS

HALF_TURN_ABOUT_X = np.array((1.0, 0.0, 0.0, 0.0))
"""Quaternion (x, y, z, w) between the two conventions of a camera, either way."""
_ACS_Q_Z_UP = np.array((-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))
"""Quaternion from a frame with z up to one with y up: (x, y, z) becomes (x, z, -y)."""


def other_camera(orientation: FloatArray) -> FloatArray:
    """Orientations (n, 4) of a camera with y down and z ahead, as those of one with y up and z back; and back again."""
    return multiply(orientation, np.broadcast_to(HALF_TURN_ABOUT_X, orientation.shape))


def from_z_up(position: FloatArray, orientation: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Positions (n, 3), metres, and orientations (n, 4) in a frame with z up, in one with y up."""
    turned = multiply(np.broadcast_to(_ACS_Q_Z_UP, orientation.shape), orientation)
    return np.stack((position[:, 0], position[:, 2], -position[:, 1]), axis=1), turned


def in_acs(poses: FloatArray, camera: str, frame: str) -> FloatArray:
    """Poses (n, 7), position and quaternion (x, y, z, w), of a camera with ``y-up`` or ``y-down`` in a frame with
    ``y-up`` or ``z-up``, as poses of ours.
    """
    position, orientation = poses[:, :3], poses[:, 3:]
    if camera == "y-down":
        orientation = other_camera(orientation)
    if frame == "z-up":
        position, orientation = from_z_up(position, orientation)
    return np.column_stack((position, orientation))


def poses_of_matrices(matrices: FloatArray) -> FloatArray:
    """Poses (n, 7), position and quaternion (x, y, z, w), of matrices (n, 3, 4) from the camera's frame to the ACS.

    A matrix that is no rotation, or not finite, gives NaN.
    """
    from scipy.spatial.transform import Rotation  # a tenth of a second, which other formats do without

    rotation = matrices[:, :, :3]
    with np.errstate(invalid="ignore", over="ignore"):
        unit = np.abs(rotation @ rotation.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2)) < ALMOST_UNIT
        sound = unit & (np.linalg.det(np.where(unit[:, None, None], rotation, np.eye(3))) > 0)
    poses = np.full((len(matrices), 7), np.nan)
    if sound.any():
        poses[sound, 3:] = Rotation.from_matrix(rotation[sound]).as_quat()
        poses[sound, :3] = matrices[sound, :, 3]
    return poses


ALMOST_UNIT = 0.01
"""Rows of a rotation that were printed with few digits are unit vectors to within this."""


def pose_rows(rows: pl.DataFrame, poses: FloatArray) -> pl.DataFrame:
    """Put poses (n, 7) beside ``row`` and ``time_ns`` of ``rows``."""
    return rows.select("row", "time_ns").hstack([pl.Series(name, poses[:, i]) for i, name in enumerate(POSE_COLUMNS)])
