"""Sections of a session, in each of which the tracker kept one frame of reference; nothing connects two of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.core.arrays import IntArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog


def section_numbers(camera: CameraTrack) -> IntArray:
    """Numbers (s,) of the sections that have usable frames, in order; one where the log tells of none."""
    if camera.state is None:
        return np.zeros(1, dtype=np.int64)
    return np.unique(camera.state.section[camera.usable])


def one_section(camera: CameraTrack, log: LandmarkLog, section: int) -> tuple[CameraTrack, LandmarkLog]:
    """Take one section of a session alone: frames of the others are INVALID, their landmark rows are gone."""
    if camera.state is None:
        return camera, log
    inside = camera.state.section == section
    status = np.where(inside, camera.status, np.int8(Status.INVALID)).astype(np.int8)
    return replace(camera, status=status), log.rows_kept(inside[log.frame])


def longest_section(camera: CameraTrack, log: LandmarkLog) -> tuple[CameraTrack, LandmarkLog]:
    """Take the section with most usable frames alone; the session as it is where it has one section."""
    sections = section_numbers(camera)
    if len(sections) < 2 or camera.state is None:
        return camera, log
    frames = [int(np.count_nonzero(camera.usable & (camera.state.section == section))) for section in sections]
    return one_section(camera, log, int(sections[int(np.argmax(frames))]))
