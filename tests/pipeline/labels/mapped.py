"""A short walk at 1 m/s whose frames have the statuses that a test asks for."""

from __future__ import annotations

import numpy as np

from tests.drifting import camera_track
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, Trajectory


def walk(seconds: FloatArray, statuses: list[Status], sigma_m: float = 0.1) -> tuple[CameraTrack, Trajectory]:
    """Frames at these seconds (n,), tracked at 1 m/s and mapped 10 m to the north of the tracker's frame."""
    camera = camera_track(seconds.astype(np.complex128), seconds)
    status = np.array(statuses, dtype=np.int8)
    mapped = (status == Status.OK) | (status == Status.UNCERTAIN)
    count = len(seconds)
    position = np.column_stack((seconds, np.full(count, 10.0), np.full(count, np.nan)))
    covariance = np.broadcast_to(np.eye(2) * sigma_m**2, (count, 2, 2)).copy()
    position[~mapped], covariance[~mapped] = np.nan, np.nan
    return camera, Trajectory(camera.time_ns, position, camera.orientation_acs, covariance, status)
