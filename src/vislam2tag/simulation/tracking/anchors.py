"""Anchors that the phone app sets along a walk, and how the tracker's map carries them.

docs/reference/phone-tables.md tells more.
"""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.context import AnchorLog
from vislam2tag.core.orientation import multiply
from vislam2tag.core.similarity import as_complex
from vislam2tag.core.tracks import to_plane
from vislam2tag.simulation.model import MapMotion, TrackerLog

APART_M = 5.0
"""An anchor is set where the camera is this far from the newest one, in space."""
FOLLOWED = 8
"""The newest ones, this many, are logged at each frame."""
LEAST_CARRIED, MOST_CARRIED = 0.6, 1.2
"""A loop correction moves points of its age by between these shares, as it does landmarks."""


def set_anchors(tracker: TrackerLog, motion: MapMotion, rng: np.random.Generator) -> AnchorLog:
    """Set anchors as the app does and follow them; all poses are rounded to the float32 that the platform gives."""
    camera = _single(tracker.position_acs)
    ways: list[FloatArray] = []
    first: list[int] = []
    start = int(np.argmin(motion.lost))
    while start < len(camera) and not motion.lost[start]:
        first.append(start)
        ways.append(_anchor_positions(tracker, motion, start, rng))
        apart = np.linalg.norm(camera[start:] - ways[-1], axis=1)
        far = np.flatnonzero((apart >= APART_M) & ~motion.lost[start:])
        start = start + int(far[0]) if len(far) else len(camera)
    return _log(tracker, motion, first, ways)


def _anchor_positions(tracker: TrackerLog, motion: MapMotion, start: int, rng: np.random.Generator) -> FloatArray:
    """Positions (f - start, 3) of the anchor set at frame ``start``."""
    later = slice(start, None)
    here = complex(as_complex(to_plane(tracker.position_acs[start])))
    point = np.full(len(motion.factor) - start, (here - motion.shift[start]) / motion.factor[start])
    for carry in motion.carries:
        if carry.since < start < carry.frame:
            age = 1.0 if carry.even else (start - carry.since) / (carry.frame - carry.since)
            share = 1.0 if carry.even else age * rng.uniform(LEAST_CARRIED, MOST_CARRIED)
            point[carry.frame - start :] += share * carry.move
    plane: ComplexArray = motion.factor[later] * point + motion.shift[later]
    height = tracker.position_acs[start, 1] + motion.rise[later] - motion.rise[start]
    way = _single(np.stack((plane.real, height, -plane.imag), axis=-1))
    way[0] = _single(tracker.position_acs[start])
    return way


def _log(tracker: TrackerLog, motion: MapMotion, first: list[int], ways: list[FloatArray]) -> AnchorLog:
    """Poses of the followed anchors, each by its first frame and positions (f, 3)."""
    anchors, frames, positions, orientations = [], [], [], []
    stops = [*first[FOLLOWED:], *[len(motion.factor)] * FOLLOWED]
    for number, (start, stop, way) in enumerate(zip(first, stops, ways, strict=False)):
        frame = np.arange(start, stop)
        anchors.append(np.full(len(frame), number))
        frames.append(frame)
        positions.append(way[: stop - start])
        orientations.append(_turned(tracker.orientation_acs[start], motion, frame))
    if not anchors:
        none = np.empty(0, dtype=np.int64)
        return AnchorLog(none, none, np.empty((0, 3)), np.empty((0, 4)))
    return AnchorLog(*(np.concatenate(parts) for parts in (anchors, frames, positions, orientations)))


def _turned(orientation: FloatArray, motion: MapMotion, frame: IntArray) -> FloatArray:
    """Quaternions (k, 4) of an anchor that turns with the map."""
    angle = np.angle(motion.factor[frame] / motion.factor[frame[0]]) / 2
    zero = np.zeros_like(angle)
    yaw = np.stack((zero, np.sin(angle), zero, np.cos(angle)), axis=-1)
    return _single(multiply(yaw, np.broadcast_to(orientation, yaw.shape)))


def _single(values: FloatArray) -> FloatArray:
    """Values (...,) rounded to float32."""
    return values.astype(np.float32).astype(np.float64)
