"""Axes of a tracker's camera and frame, by which poses are those of a walking person."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.transforms import rotated
from vislam2tag.intake.pose_conventions import MAX_HEAVE, MIN_AHEAD, MIN_FRAMES, MIN_LEVEL, SAME_AHEAD
from vislam2tag.intake.pose_evidence import MIN_WAY_M, PoseEvidence, Poses, Sights
from vislam2tag.sessions.apps import in_acs
from vislam2tag.sessions.sighting_poses import HALF_TURN

XYZW, WXYZ = (3, 4, 5, 6), (4, 5, 6, 3)
"""Places of x, y, z and w of a quaternion in poses (n, 7)."""
_MORE_AHEAD = 0.3
"""The right axes look ahead and stay level by more than any others that are possible."""
_MORE_LEVEL, _MIN_SWAY = 3.0, 0.02
"""The upward direction sways with wrong rotations by more than this factor and share."""
_INVERTED = np.array((1.0, 1.0, 1.0, -1.0, -1.0, -1.0, 1.0))
"""Signs that turn poses into those with inverse rotations."""
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
    time_ns, poses = _sound(time_ns, poses)
    if not _is_walk(poses):
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


def inverse_is_plausible(time_ns: IntArray, poses: FloatArray, cameras: Sequence[str], frames: Sequence[str]) -> bool:
    """Whether poses (n, 7) are clearly more those of a walking person with the inverse of each rotation."""
    time_ns, poses = _sound(time_ns, poses)
    if not _is_walk(poses):
        return False
    direct = _possible(time_ns, poses, cameras, frames)
    inverse = _possible(time_ns, poses * _INVERTED, cameras, frames)
    if not direct or not inverse:
        return bool(inverse) and inverse[0][0] > _MORE_AHEAD
    (ahead, *_, level), (other_ahead, *_, other_level) = direct[0], inverse[0]
    # A constant tilt of the camera is one of the frame in the inverse, which sways as the person turns.
    steadier = 1 - level > max(_MORE_LEVEL * (1 - other_level), _MIN_SWAY)
    return other_ahead > ahead + _MORE_AHEAD or (steadier and other_ahead > ahead - SAME_AHEAD)


def speed_m_s(time_ns: IntArray, poses: FloatArray) -> float:
    """Speed that half of the path exceeds, without jumps of the tracker; 0 if poses (n, 7) are too few."""
    time_ns, poses = _sound(time_ns, poses)
    return _evidence(time_ns, poses).speed_m_s if _is_walk(poses) else 0.0


def offsets_apart_m(poses: FloatArray, offsets: FloatArray, landmark: IntArray) -> FloatArray:
    """How far sightings (n,) of a landmark are apart, m: its median over landmarks, for four readings (2, 2).

    ``poses`` (n, 7) are those of the camera, ``offsets`` (n, 3) from it to the landmark. The first index is whether the
    rotations are inverted, the second whether the axes y and z of offsets are opposite to those of the camera. NaN
    if no landmark was seen twice.
    """
    names, index, count = np.unique(landmark, return_inverse=True, return_counts=True)
    apart = np.full((2, 2), np.nan)
    if not (count > 1).any():
        return apart
    unit = _unit(poses)
    for inverted, opposite in np.ndindex(2, 2):
        turn = unit * _INVERTED[3:] if inverted else unit
        at = poses[:, :3] + rotated(turn, offsets * HALF_TURN if opposite else offsets)
        middle = np.column_stack([np.bincount(index, axis) / count for axis in at.T])
        square = np.bincount(index, np.sum((at - middle[index]) ** 2, axis=1), len(names)) / count
        apart[inverted, opposite] = np.median(np.sqrt(square[count > 1]))
    return apart


def _sound(time_ns: IntArray, poses: FloatArray) -> tuple[IntArray, FloatArray]:
    """Times and poses without unusable ones and those that go back in time."""
    sound = np.isfinite(poses).all(axis=1) & (np.linalg.norm(poses[:, 3:], axis=1) > 0)
    sound[1:] &= np.diff(time_ns) > 0
    return time_ns[sound], poses[sound]


def _is_walk(poses: FloatArray) -> bool:
    way_m = np.linalg.norm(np.diff(poses[:, :3], axis=0), axis=1).sum()
    return len(poses) >= MIN_FRAMES and bool(way_m >= MIN_WAY_M)


def _possible(
    time_ns: IntArray, poses: FloatArray, cameras: Sequence[str], frames: Sequence[str]
) -> list[tuple[float, str, str, float]]:
    """How far poses look ahead and stay level with each axes of camera and frame that are possible, most first.

    The last of each is how steady the upward direction is in the axes of the camera, at most 1.
    """
    found = []
    for frame in frames:
        for camera in cameras:
            evidence = _evidence(time_ns, in_acs(poses, camera, frame))
            if evidence.level >= MIN_LEVEL and evidence.heave <= MAX_HEAVE and not evidence.ahead < MIN_AHEAD:
                found.append((evidence.ahead - evidence.heave, camera, frame, evidence.level))
    return sorted(found, reverse=True)


def _evidence(time_ns: IntArray, poses: FloatArray) -> PoseEvidence:
    return PoseEvidence.of(Poses.of(time_ns, poses[:, :3], _unit(poses)), None, _NO_SIGHTS)


def _unit(poses: FloatArray) -> FloatArray:
    """The quaternions of poses (n, 7) with length 1."""
    unit: FloatArray = poses[:, 3:] / np.linalg.norm(poses[:, 3:], axis=1)[:, None]
    return unit
