"""Conventions that poses may have by mistake: how to read each as it should be, and how to mend the file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.intake.pose_evidence import Poses, matrices

_SWAP = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)))
"""y and z exchanged: a reflection."""
_Z_UP = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))
"""From a frame with z up to the ACS."""
_MIRROR = np.diag((1.0, 1.0, -1.0))


@dataclass(frozen=True)
class Convention:
    """A convention other than the one expected."""

    name: str
    """A clause that ends "it looks as if": ``poses map the world to the camera``."""
    cure: str
    read: Callable[[Poses], Poses]
    """Turns poses in this convention into poses as expected."""
    vehicle_alike: bool = False
    """Whether poses look the same if they are right, but of someone on a vehicle."""


def _inverted(poses: Poses) -> Poses:
    rotation = poses.rotation.transpose(0, 2, 1)
    return replace(poses, position=-np.einsum("nij,nj->ni", rotation, poses.position), rotation=rotation)


def _in_axes(axes: FloatArray) -> Callable[[Poses], Poses]:
    """The frame, and for a reflection the camera too, has other axes."""
    camera = axes.T if np.linalg.det(axes) < 0 else np.eye(3)
    return lambda poses: replace(poses, position=poses.position @ axes.T, rotation=axes @ poses.rotation @ camera)


def _positions_in_axes(axes: FloatArray) -> Callable[[Poses], Poses]:
    return lambda poses: replace(poses, position=poses.position @ axes.T)


def _of_length(metres: float) -> Callable[[Poses], Poses]:
    return lambda poses: replace(poses, position=poses.position * metres)


def _of_time(seconds: float) -> Callable[[Poses], Poses]:
    return lambda poses: replace(poses, time_s=poses.time_s * seconds)


def _real_part_first(poses: Poses) -> Poses:
    """Rotations of quaternions whose four numbers were read in the order x, y, z, w."""
    return replace(poses, rotation=matrices(_quaternions(poses.rotation)[:, (1, 2, 3, 0)]))


def _quaternions(rotation: FloatArray) -> FloatArray:
    """Unit quaternions (n, 4), x, y, z, w, of rotation matrices (n, 3, 3)."""
    trace = np.trace(rotation, axis1=1, axis2=2)
    diagonal = np.diagonal(rotation, axis1=1, axis2=2)
    # The outer product of a quaternion with itself, times 4: its longest column is the quaternion, up to its length.
    outer = np.empty((len(rotation), 4, 4))
    symmetric = rotation + rotation.transpose(0, 2, 1)
    skew = rotation - rotation.transpose(0, 2, 1)
    outer[:, :3, :3] = symmetric
    outer[:, range(3), range(3)] = 1 + 2 * diagonal - trace[:, None]
    outer[:, 3, 3] = 1 + trace
    real = np.stack((skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]), axis=1)
    outer[:, 3, :3] = outer[:, :3, 3] = real
    longest = outer[np.arange(len(rotation)), np.argmax(np.diagonal(outer, axis1=1, axis2=2), axis=1)]
    return np.asarray(longest / np.linalg.norm(longest, axis=1, keepdims=True))


CONVENTIONS = (
    Convention("poses map the world to the camera", "Invert each pose: camera to world is expected.", _inverted),
    Convention("the z axis points up", "Write x, z, -y instead: the y axis must point up.", _in_axes(_Z_UP)),
    Convention("y and z are exchanged", "Exchange them: the y axis must point up.", _in_axes(_SWAP)),
    Convention(
        "the z axis of the positions, but not of the orientations, points up",
        "Write the positions as x, z, -y: the y axis must point up.",
        _positions_in_axes(_Z_UP),
    ),
    Convention(
        "y and z of the positions are exchanged",
        "Exchange them: the y axis must point up.",
        _positions_in_axes(_SWAP),
    ),
    Convention(
        "the frame is left-handed, as Unity's",
        "Change the signs of z, qx and qy: a right-handed frame is expected.",
        _in_axes(_MIRROR),
    ),
    Convention("quaternions begin with their real part w", "Write qx, qy, qz, qw in this order.", _real_part_first),
    Convention(
        "the camera's y axis points down and its z axis ahead",
        "Turn each orientation by half a turn about the camera's x axis: y must point up, z back.",
        lambda poses: replace(poses, rotation=poses.rotation @ np.diag((1.0, -1.0, -1.0))),
    ),
    Convention("times are in milliseconds", "Divide them by 1000: seconds are expected.", _of_time(1e-3)),
    Convention("times are in microseconds", "Divide them by 1,000,000: seconds are expected.", _of_time(1e-6)),
    Convention("lengths are in millimetres", "Divide them by 1000: metres are expected.", _of_length(1e-3)),
    Convention("lengths are in centimetres", "Divide them by 100: metres are expected.", _of_length(1e-2)),
    Convention(
        "lengths are in feet",
        "Multiply them by 0.3048: metres are expected.",
        _of_length(0.3048),
        vehicle_alike=True,
    ),
)
"""In the order in which they are named."""
