"""Axes of a tracker's camera and frame, by which poses are those of a walking person."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.intake.pose_conventions import MAX_HEAVE, MIN_AHEAD, MIN_FRAMES, MIN_LEVEL
from vislam2tag.intake.pose_evidence import MIN_WAY_M, PoseEvidence, Poses, Sights
from vislam2tag.sessions.apps import in_acs

XYZW, WXYZ = (3, 4, 5, 6), (4, 5, 6, 3)
"""Places of x, y, z and w of a quaternion in poses (n, 7)."""
_MORE_AHEAD = 0.3
"""The right axes look ahead and stay level by more than any others that are possible."""
_NO_SIGHTS = Sights(np.empty(0, dtype=np.int64), np.empty((0, 2)))
Axes = tuple[str, str, tuple[int, ...]]
"""Camera (``y-up`` or ``y-down``), frame (``y-up`` or ``z-up``) and order of the quaternion."""


def plausible_axes(
    time_ns: IntArray,
    poses: FloatArray,
    orders: Sequence[tuple[int, ...]] = (XYZW,),
    cameras: Sequence[str] = ("y-up", "y-down"),
    frames: Sequence[str] = ("y-up", "z-up"),
) -> Axes | None:
    """The axes that make poses (n, 7) at times (n,), ns, those of a walking person; None if none or several do.

    ``orders`` are the possible orders of the quaternion: another one replaces the first only if it fits clearly better.
    """
    sound = np.isfinite(poses).all(axis=1) & (np.linalg.norm(poses[:, 3:], axis=1) > 0)
    sound[1:] &= np.diff(time_ns) > 0
    time_ns, poses = time_ns[sound], poses[sound]
    if len(time_ns) < MIN_FRAMES or np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1).sum() < MIN_WAY_M:
        return None
    best: tuple[float, Axes] | None = None
    for order in orders:
        found = _possible(time_ns, poses[:, (0, 1, 2, *order)], cameras, frames)
        clear = len(found) == 1 or (len(found) > 1 and found[0][0] - found[1][0] > _MORE_AHEAD)
        if found and not clear and best is None:
            return None
        if clear and (best is None or found[0][0] > best[0] + _MORE_AHEAD):
            best = found[0][0], (found[0][1], found[0][2], order)
    return None if best is None else best[1]


def _possible(
    time_ns: IntArray, poses: FloatArray, cameras: Sequence[str], frames: Sequence[str]
) -> list[tuple[float, str, str]]:
    """How far poses look ahead and stay level with each axes of camera and frame that are possible, most first."""
    found = []
    for frame in frames:
        for camera in cameras:
            evidence = _evidence(time_ns, in_acs(poses, camera, frame))
            if evidence.level >= MIN_LEVEL and evidence.heave <= MAX_HEAVE and not evidence.ahead < MIN_AHEAD:
                found.append((evidence.ahead - evidence.heave, camera, frame))
    return sorted(found, reverse=True)


def _evidence(time_ns: IntArray, poses: FloatArray) -> PoseEvidence:
    unit = poses[:, 3:] / np.linalg.norm(poses[:, 3:], axis=1)[:, None]
    return PoseEvidence.of(Poses.of(time_ns, poses[:, :3], unit), None, _NO_SIGHTS)
