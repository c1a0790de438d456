"""Poses of landmarks in our axes, from positions in the tracker's frame or offsets from the camera."""

from __future__ import annotations

import numpy as np

from vislam2tag.common.errors import UsageError
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.core.transforms import rotated
from vislam2tag.sessions.apps import in_acs

AT_REST = (0.0, 0.0, 0.0, 1.0)
"""The orientation of landmarks whose own is not known."""
HALF_TURN = (1.0, -1.0, -1.0)
"""Signs between the axes of a camera with y up and of one with y down."""


def at_frames(camera: CameraTrack, time_ns: IntArray, most_apart_ns: int) -> IntArray:
    """Times (k,), ns, as those of the closest usable frames, except where these are further away.

    Raises UsageError if no frame is usable.
    """
    frame_ns = camera.time_ns[camera.usable]
    closest = frame_ns[closest_places(frame_ns, time_ns)]
    return np.where(np.abs(closest - time_ns) <= most_apart_ns, closest, time_ns)


def of_positions(position: FloatArray, turn: FloatArray | None, frame: str) -> FloatArray:
    """Poses (k, 7) of positions (k, 3) and quaternions (k, 4) in a tracker's frame with ``y-up`` or ``z-up``."""
    at_rest = np.tile(AT_REST, (len(position), 1))
    poses = in_acs(np.column_stack((position, at_rest if turn is None else turn)), "y-up", frame)
    return np.column_stack((poses[:, :3], at_rest if turn is None else poses[:, 3:]))


def of_offsets(offset: FloatArray, time_ns: IntArray, camera: CameraTrack, axes: str) -> FloatArray:
    """Poses (k, 7) of offsets (k, 3), metres, in the axes of a camera with ``y-up`` or ``y-down``.

    Raises UsageError if no frame is usable.
    """
    frames = np.flatnonzero(camera.usable)
    frame_ns = camera.time_ns[frames]
    closest = frames[closest_places(frame_ns, time_ns)]
    at = np.column_stack([np.interp(time_ns, frame_ns, axis) for axis in camera.position_acs[frames].T])
    ours = offset * HALF_TURN if axes == "y-down" else offset
    return np.column_stack((at + rotated(camera.orientation_acs[closest], ours), np.tile(AT_REST, (len(offset), 1))))


def closest_places(sorted_ns: IntArray, time_ns: IntArray) -> IntArray:
    """Places (k,) of the times that are closest to ``time_ns`` (k,)."""
    if not len(sorted_ns):
        raise UsageError("no pose is usable")
    after = np.searchsorted(sorted_ns, time_ns).clip(1, max(len(sorted_ns) - 1, 1)).clip(max=len(sorted_ns) - 1)
    before = np.maximum(after - 1, 0)
    return np.where(np.abs(sorted_ns[before] - time_ns) <= np.abs(sorted_ns[after] - time_ns), before, after)
