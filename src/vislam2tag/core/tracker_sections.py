"""Parts of a session: stretches in which the tracker kept one frame of reference. Nothing connects them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.arrays import IntArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog


def parts_of(camera: CameraTrack) -> IntArray:
    """Numbers of the parts that have usable frames, in order; one part where the log tells of none."""
    if camera.state is None:
        return np.zeros(1, dtype=np.int64)
    return np.unique(camera.state.part[camera.usable])


def one_part(camera: CameraTrack, log: LandmarkLog, part: int) -> tuple[CameraTrack, LandmarkLog]:
    """Take one part of a session alone: frames of the others are INVALID, their landmark rows are gone."""
    if camera.state is None:
        return camera, log
    inside = camera.state.part == part
    status = np.where(inside, camera.status, np.int8(Status.INVALID)).astype(np.int8)
    return replace(camera, status=status), log.rows_kept(inside[log.frame])


def longest_part(camera: CameraTrack, log: LandmarkLog) -> tuple[CameraTrack, LandmarkLog]:
    """Take the part with most usable frames alone; the session as it is where it has one part."""
    parts = parts_of(camera)
    if len(parts) < 2 or camera.state is None:
        return camera, log
    frames = [int(np.count_nonzero(camera.usable & (camera.state.part == part))) for part in parts]
    return one_part(camera, log, int(parts[int(np.argmax(frames))]))
