"""Landmarks in a session's pictures: a quick look at few pictures, a close one around what it found.

A flat landmark is placed from its four corners, with the uncertainty that their pixels leave.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import cv2
import numpy as np

from vislam2tag.common.progress import Progress, silent
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.preparation.detectors import Detector, Picture, Seen, in_order
from vislam2tag.sessions.apps.pictures import Pictures

QUICK_S = 0.4
"""Pictures of the quick look are so far apart: who walks by sees a landmark for a second and more."""
CLOSE_S = 0.6
"""Pictures this near to one that shows a landmark are looked at closely."""
GREATEST_SIGMA_M = 0.3
"""A sighting less sure than this, per axis, tells no more than where somebody stood."""


@dataclass(frozen=True)
class PictureSighting:
    """A landmark in one picture: ``time_ns`` of the pose that it was taken at."""

    landmark: str
    time_ns: int
    pose: Placed


@dataclass(frozen=True)
class Search:
    """What a search found: sightings in order of time, and how many corners fit no pose, or no sure one."""

    sightings: tuple[PictureSighting, ...]
    doubtful: int
    pictures: int
    """How many were there."""
    missing: int
    """Pictures that could not be unpacked, as where a video is cut off."""


def search(pictures: Pictures, detectors: Sequence[Detector], progress: Progress[int] = silent) -> Search:
    """Look for landmarks; ``progress`` counts the pictures that were passed.

    Those before a picture that shows a landmark are kept until they are too old to be looked at closely, so that no
    video is decoded twice. Raises SessionError where the pictures cannot be opened.
    """
    quick = set(_every(pictures.time_ns, QUICK_S).tolist())
    count, looked, doubtful = len(pictures.time_ns), 0, 0
    found = list[PictureSighting]()
    recent = deque[tuple[int, Picture]]()
    close_ns = round(CLOSE_S * 1e9)
    close_until_ns = -np.inf
    for number, picture in in_order(pictures):
        now_ns = int(pictures.time_ns[number])
        recent.append((number, picture))
        while now_ns - pictures.time_ns[recent[0][0]] > close_ns:
            recent.popleft()
        if number in quick and (grey := picture()) is not None:
            looked += 1
            if any(detector.find(grey) for detector in detectors):
                close_until_ns = now_ns + close_ns
        while recent and now_ns <= close_until_ns:
            seen, unsure = _closely(pictures, *recent.popleft(), detectors)
            found += seen
            doubtful += unsure
        progress(number + 1, count)
    return Search(tuple(found), doubtful, count, len(quick) - looked)


def _closely(
    pictures: Pictures, number: int, picture: Picture, detectors: Sequence[Detector]
) -> tuple[list[PictureSighting], int]:
    """The sure sightings in one picture, and how many are doubtful."""
    grey = picture()
    if grey is None:
        return [], 0
    sure, unsure = surest([detector.find(grey) for detector in detectors], pictures.lens_px[number])
    time_ns = int(pictures.time_ns[number])
    return [PictureSighting(name, time_ns, pose) for name, pose in sure.items()], unsure


def surest(seen: Sequence[Sequence[Seen]], lens_px: FloatArray) -> tuple[dict[str, Placed], int]:
    """Pose of each landmark in one picture, by what each detector saw, and how many sightings are doubtful.

    Of several detectors (a sheet's picture, its tag) the surest counts. A landmark that one detector sees at two places
    hangs twice: nobody knows which one it is, and neither counts.
    """
    sure: dict[str, Placed] = {}
    doubtful = 0
    for of_one in seen:
        count = Counter(each.landmark for each in of_one)
        for each in of_one:
            pose = placed(each, lens_px) if count[each.landmark] == 1 else None
            if pose is None or not pose.sigma_m <= GREATEST_SIGMA_M:
                doubtful += 1
            elif each.landmark not in sure or pose.sigma_m < sure[each.landmark].sigma_m:
                sure[each.landmark] = pose
    return sure, doubtful


def _every(time_ns: IntArray, step_s: float) -> IntArray:
    """Numbers of the pictures that are the first in each step of time."""
    if not len(time_ns):
        return np.empty(0, dtype=np.int64)
    step = (time_ns - time_ns[0]) // int(step_s * 1e9)
    return np.flatnonzero(np.diff(step, prepend=-1) > 0)


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
