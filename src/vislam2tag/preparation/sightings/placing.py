"""Where the camera saw a flat landmark: from its four corners, with the uncertainty that their pixels leave."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import cv2
import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.preparation.sightings.detectors import Seen

MISFIT = 4.0
"""Corners farther from where the pose puts them, root mean square in their own sigmas, are of something else."""
_CAMERA = np.diag((1.0, -1.0, -1.0))
"""From OpenCV's camera (y down, z ahead) to ours (y up, z back)."""
_SHEET = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)))
"""A landmark's axes (x right, y out of the sheet, z down) in OpenCV's for a square (x right, y up, z out of it)."""


@dataclass(frozen=True)
class Placed:
    """A landmark's pose in the camera's frame: ``position_m`` (3,), ``orientation`` (4,) quaternion (x, y, z, w),
    landmark to camera, and ``sigma_m`` of its position per axis.
    """

    position_m: FloatArray
    orientation: FloatArray
    sigma_m: float


def placed(seen: Seen, lens_px: FloatArray) -> Placed | None:
    """Place a landmark by the lens (4,) fx, fy, cx, cy, pixels; None where its corners fit no pose.

    Of the two poses that a small square far away has (Collins and Bartoli, IJCV 2014), each brought to the nearest of
    least squares, the one that fits better; its position hardly differs. The covariance is that of least squares, by
    the derivatives of the projection.
    """
    from scipy.spatial.transform import Rotation

    width, height = seen.size_m
    square = np.array(((-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)), np.float64) * (width / 2, height / 2, 0)
    middle = np.array((*seen.centre_m, 0.0))
    camera = np.array(((lens_px[0], 0, lens_px[2]), (0, lens_px[1], lens_px[3]), (0, 0, 1)), np.float64)
    if not np.isfinite(seen.corners_px).all() or not np.isfinite(camera).all():
        return None
    found = _poses(square, seen.corners_px, camera)
    if not found:
        return None
    _, turn, shift = min(found, key=lambda pose: pose[0])
    if seen.centre_m != (0.0, 0.0):  # the derivative below is that of the landmark's own place
        shift = shift - cv2.Rodrigues(turn)[0] @ middle[:, None]
        square = square + middle
    again, derivative = cv2.projectPoints(square, turn, shift, camera, np.zeros(4))
    misfit = (again[:, 0] - seen.corners_px) / seen.sigma_px
    if float(np.sqrt(np.mean(misfit**2))) > MISFIT:
        return None
    normal = derivative[:, :6].T @ derivative[:, :6]
    covariance = seen.sigma_px**2 * np.linalg.pinv(normal)
    rotation = _CAMERA @ cv2.Rodrigues(turn)[0] @ _SHEET
    return Placed(
        _CAMERA @ shift[:, 0],
        Rotation.from_matrix(rotation).as_quat(),
        float(np.sqrt(np.trace(covariance[3:, 3:]) / 3)),
    )


def _poses(
    square: FloatArray, corners_px: FloatArray, camera: FloatArray
) -> list[tuple[float, FloatArray, FloatArray]]:
    """How far corners are off, root mean square, pixels, turn (3, 1) and shift (3, 1) of poses that may fit."""
    found = list[tuple[float, FloatArray, FloatArray]]()
    for way in (cv2.SOLVEPNP_IPPE, cv2.SOLVEPNP_ITERATIVE):  # the first is lost exactly in front of a square
        with suppress(cv2.error):
            _, turns, shifts, _ = cv2.solvePnPGeneric(square, corners_px, camera, np.zeros(4), flags=way)
            for rough in zip(turns, shifts, strict=True):
                finer = cv2.solvePnPRefineLM(square, corners_px, camera, np.zeros(4), *rough)
                turn, shift = (np.asarray(one, np.float64) for one in finer)
                off = cv2.projectPoints(square, turn, shift, camera, np.zeros(4))[0][:, 0] - corners_px
                if np.isfinite(off).all() and shift[2, 0] > 0:
                    found.append((float(np.sqrt(np.mean(off**2))), turn, shift))
    return found
