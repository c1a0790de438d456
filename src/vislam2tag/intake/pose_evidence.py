"""Evidence in a log of poses for and against each convention in which it may be written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import InertialLog
from vislam2tag.core.transforms import rotated

FRAME_S = 0.1
"""Frames are thinned to this interval."""
MAX_STEP_S = 2.0
"""Frames with a longer gap between them are not neighbours."""
MIN_WAY_M = 5.0
"""Shorter walks are not judged."""
FAST_M_S = 4.0
"""Walkers stay below this; trackers that correct themselves exceed it only for moments."""
_JUMPS = 0.02
"""Share of the fastest steps that are ignored for the usual speed."""
_JUMP_FACTOR = 5.0
"""Steps faster than the usual speed by this factor are jumps."""
_FORCE_S = 0.5
"""Half the time over which accelerations are averaged: about one step."""
_ABSURD = 1e4
"""Larger readings come from a damaged file, m/s2 and rad/s."""
_SAME_TURN_RAD_S = 0.5
"""Turn rates of poses and gyroscope differ by less in magnitude, whatever the convention, except at tracker resets."""
_UNTURNED = 0.99
"""If the mean viewing direction is almost as long as a unit vector, the camera never turns and shows no direction."""
MIN_APART_M = 10.0
"""Distances between landmarks are compared from this length on, because cameras see landmarks from a few metres."""
_MIN_DISTANCES = 3
_MIN_PAIRS = 100
_MIN_TURN_RAD_S = 0.05
"""If poses and gyroscope turn less than this (root mean square), they cannot be compared."""


@dataclass(frozen=True)
class Poses:
    """Thinned-out poses: ``time_s`` (n,) increasing, ``position`` (n, 3) metres, ``rotation`` (n, 3, 3)."""

    time_s: FloatArray
    position: FloatArray
    rotation: FloatArray

    @classmethod
    def of(cls, time_ns: IntArray, position: FloatArray, orientation: FloatArray) -> Poses:
        """Thin out poses with increasing times (n,), ns, and unit quaternions (n, 4), x, y, z, w."""
        time_s = _seconds(time_ns, int(time_ns[0]))
        _, kept = np.unique(np.floor(time_s / FRAME_S), return_index=True)
        return cls(time_s[kept], position[kept], matrices(orientation[kept]))


@dataclass(frozen=True)
class Inertial:
    """What the IMU measured between neighbouring poses: ``pair`` (k,) index of the first of the two, ``turn_rad_s`` and
    ``up`` (k, 3) mean turn rate and upward direction in the axes of the phone.
    """

    pair: IntArray
    turn_rad_s: FloatArray
    up: FloatArray

    @classmethod
    def of(cls, log: InertialLog | None, poses: Poses, start_ns: int, lag_s: float) -> Inertial | None:
        """Return the readings on the clock of poses that begin at ``start_ns`` and whose stamps are ``lag_s`` late.

        None if the two cannot be compared: no common time, no turns, or turn rates of different magnitude.
        """
        if log is None or len(poses.time_s) < _MIN_PAIRS:
            return None
        first, last = poses.time_s[:-1] - lag_s, poses.time_s[1:] - lag_s
        rate_s, force_s = _seconds(log.rate_ns, start_ns), _seconds(log.force_ns, start_ns)
        inside = (first > max(rate_s[0], force_s[0] + _FORCE_S)) & (last < min(rate_s[-1], force_s[-1] - _FORCE_S))
        pair = np.flatnonzero(inside & (last - first < MAX_STEP_S))
        turn = _mean(rate_s, log.rate.clip(-_ABSURD, _ABSURD), first[pair], last[pair])
        middle = (first[pair] + last[pair]) / 2
        up = _mean(force_s, log.force.clip(-_ABSURD, _ABSURD), middle - _FORCE_S, middle + _FORCE_S)
        length = np.linalg.norm(up, axis=1)
        own = np.linalg.norm(turn_rates(poses)[pair], axis=1)
        alike = (np.abs(np.linalg.norm(turn, axis=1) - own) < _SAME_TURN_RAD_S) & (length > 0)
        if alike.sum() < max(_MIN_PAIRS, len(pair) / 2) or np.sqrt(np.mean(own[alike] ** 2)) < _MIN_TURN_RAD_S:
            return None
        return cls(pair[alike], turn[alike], up[alike] / length[alike, None])


@dataclass(frozen=True)
class Sights:
    """First sightings of surveyed landmarks: ``pose`` (k,) index, ``position_bcs`` (k, 2) of the landmark, metres."""

    pose: IntArray
    position_bcs: FloatArray


@dataclass(frozen=True)
class InertialMatch:
    """How well one fixed rotation between camera and phone explains what the IMU measured."""

    explained: float
    """Share of the turn rates' sum of squares that the gyroscope explains; 1 is perfect."""
    explained_mirrored: float
    """The same for a reflection: greater if one of the two is left-handed."""
    tilt_deg: float
    """Median angle between the upward directions of accelerometer and poses."""


@dataclass(frozen=True)
class PoseEvidence:
    """Evidence for and against one interpretation of the poses."""

    speed_m_s: float
    """Speed that half of the path exceeds, without jumps of the tracker."""
    fast_share: float
    """Share of the time faster than :data:`FAST_M_S`."""
    level: float
    """Length of the mean upward direction in the axes of the camera: 1 for a phone that is never tilted."""
    heave: float
    """Vertical share of the path."""
    ahead: float
    """Mean cosine between the horizontal directions in which the camera looks and moves; NaN if it never turns."""
    stretch: float
    """Median ratio of the distances between landmarks to the surveyed ones; NaN if there are too few."""
    inertial: InertialMatch | None
    """None if the IMU cannot be compared."""

    @classmethod
    def of(cls, poses: Poses, inertial: Inertial | None, sights: Sights) -> PoseEvidence:
        """Judge poses; ``inertial`` was measured between them."""
        step_s = np.diff(poses.time_s)
        near = (step_s > 0) & (step_s <= MAX_STEP_S)
        length = np.linalg.norm(np.diff(poses.position, axis=0), axis=1)
        moved = (length > 0) & (step_s > 0)
        speed_m_s = _usual_speed(length[moved], step_s[moved])
        step, step_s, length = np.diff(poses.position, axis=0)[near], step_s[near], length[near]
        slow = (length > 0) & (length < FAST_M_S * step_s)
        up = poses.rotation[:, 1, :]
        return cls(
            speed_m_s=speed_m_s,
            fast_share=float(step_s[length > FAST_M_S * step_s].sum() / step_s.sum()) if len(step_s) else 0.0,
            level=float(np.linalg.norm(up.mean(axis=0))),
            heave=float(np.abs(step[slow, 1]).sum() / length[slow].sum()) if slow.any() else 0.0,
            ahead=_ahead(-poses.rotation[:-1][near][slow][:, :, 2], step[slow]),
            stretch=_stretch(poses, sights),
            inertial=None if inertial is None else _match(poses, inertial),
        )


def _usual_speed(length: FloatArray, step_s: FloatArray) -> float:
    """Speed that half of the path exceeds, without the jumps of a tracker that corrects itself."""
    if not len(length):
        return 0.0
    speed = length / step_s
    way = np.where(speed <= np.quantile(speed, 1 - _JUMPS), length, 0.0)
    order = np.argsort(speed)
    total = np.cumsum(way[order])
    return float(speed[order][np.searchsorted(total, total[-1] / 2)])


def _stretch(poses: Poses, sights: Sights) -> float:
    """Median ratio of the distances between landmarks as walked, from where they were seen, and as surveyed.

    Pairs of landmarks with a jump of the tracker between them are not compared, because the frame may have changed.
    """
    step_s, length = np.diff(poses.time_s), np.linalg.norm(np.diff(poses.position, axis=0), axis=1)
    jump = (step_s > MAX_STEP_S) | (length > _JUMP_FACTOR * _usual_speed(length, step_s) * step_s)
    piece = np.concatenate(((0,), np.cumsum(jump)))[sights.pose]
    first, second = np.triu_indices(len(sights.pose), 1)
    surveyed_m = np.linalg.norm(sights.position_bcs[first] - sights.position_bcs[second], axis=1)
    far = (surveyed_m >= MIN_APART_M) & (piece[first] == piece[second])
    if far.sum() < _MIN_DISTANCES:
        return float("nan")
    at = poses.position[sights.pose]
    walked = np.linalg.norm(at[first[far]] - at[second[far]], axis=1)
    return float(np.median(walked / surveyed_m[far]))


def _seconds(time_ns: IntArray, start_ns: int) -> FloatArray:
    return np.asarray((time_ns - start_ns) * 1e-9, dtype=np.float64)


def matrices(orientation: FloatArray) -> FloatArray:
    """Rotation matrices (n, 3, 3) of unit quaternions (n, 4), x, y, z, w."""
    axes = np.broadcast_to(np.eye(3)[:, None], (3, len(orientation), 3))
    return np.stack([rotated(orientation, axis) for axis in axes], axis=-1)


def turn_rates(poses: Poses) -> FloatArray:
    """Turn rates (n - 1, 3) of the camera in its own axes, rad/s."""
    between = poses.rotation[:-1].transpose(0, 2, 1) @ poses.rotation[1:]
    skew = between - between.transpose(0, 2, 1)
    axis = np.stack((skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]), axis=1) / 2  # its length is the angle's sine
    sine = np.linalg.norm(axis, axis=1)
    angle = np.arctan2(sine, (np.trace(between, axis1=1, axis2=2) - 1) / 2)
    scale = np.divide(angle, sine, out=np.ones_like(sine), where=sine > 1e-9)
    return np.asarray(axis * (scale / np.diff(poses.time_s))[:, None])


def _mean(time_s: FloatArray, values: FloatArray, first: FloatArray, last: FloatArray) -> FloatArray:
    """Mean (k, 3) of readings (m, 3) from ``first`` (k,) to ``last`` (k,), seconds."""
    area = (values[1:] + values[:-1]) / 2 * np.diff(time_s)[:, None]
    total = np.vstack((np.zeros((1, 3)), np.cumsum(area, axis=0)))
    columns = [np.interp(last, time_s, column) - np.interp(first, time_s, column) for column in total.T]
    return np.column_stack(columns) / (last - first)[:, None]


def _ahead(look: FloatArray, step: FloatArray) -> float:
    """Mean cosine between the horizontal parts of directions (k, 3), each step weighted by its length."""
    look, step = look[:, (0, 2)], step[:, (0, 2)]
    weight = np.linalg.norm(step, axis=1)
    size = np.linalg.norm(look, axis=1) * weight
    known = size > 0
    if not known.any() or np.linalg.norm(look[known].mean(axis=0)) > _UNTURNED * np.hypot(*look[known].T).max():
        return float("nan")
    return float(np.average(np.sum(look * step, axis=1)[known] / size[known], weights=weight[known]))


def _match(poses: Poses, inertial: Inertial) -> InertialMatch:
    """Fit the rotation between phone and camera to turn rates and upward directions (Wahba's problem, by SVD)."""
    turn, up = turn_rates(poses)[inertial.pair], poses.rotation[inertial.pair][:, 1, :]
    usual = np.sqrt(np.mean(np.sum(turn**2, axis=1)))
    left, _, right = np.linalg.svd(turn.T @ inertial.turn_rad_s / usual**2 + up.T @ inertial.up)
    handed = np.sign(np.linalg.det(left @ right))

    def explained(sign: float) -> tuple[float, FloatArray]:
        camera_from_phone = left @ np.diag((1.0, 1.0, sign)) @ right
        rest = turn - inertial.turn_rad_s @ camera_from_phone.T
        return float(1 - np.mean(np.sum(rest**2, axis=1)) / usual**2), camera_from_phone

    share, camera_from_phone = explained(handed)
    cosine = np.sum(up * (inertial.up @ camera_from_phone.T), axis=1)
    return InertialMatch(share, explained(-handed)[0], float(np.degrees(np.median(np.arccos(cosine.clip(-1, 1))))))


_SWAP = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)))
"""y and z exchanged: a reflection."""
_SWAP_XY = np.array(((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
_Z_UP = np.array(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))
"""From a frame with z up to the ACS."""
_MIRROR = np.diag((1.0, 1.0, -1.0))


@dataclass(frozen=True)
class Convention:
    """A convention other than the one expected."""

    name: str
    """A clause for messages: ``poses map the world to the camera``."""
    cure: str
    read: Callable[[Poses], Poses]
    """Converts poses from this convention to the expected one."""
    vehicle_alike: bool = False
    """Whether correct poses of someone in a vehicle look the same."""


def _inverted(poses: Poses) -> Poses:
    rotation = poses.rotation.transpose(0, 2, 1)
    return replace(poses, position=-np.einsum("nij,nj->ni", rotation, poses.position), rotation=rotation)


def _in_axes(axes: FloatArray) -> Callable[[Poses], Poses]:
    """The frame has other axes, and so has the camera in a reflection."""
    camera = axes.T if np.linalg.det(axes) < 0 else np.eye(3)
    return lambda poses: replace(poses, position=poses.position @ axes.T, rotation=axes @ poses.rotation @ camera)


def _with_positions(axes: FloatArray) -> Callable[[Poses], Poses]:
    """The positions alone have other axes (3, 3), or another unit."""
    return lambda poses: replace(poses, position=poses.position @ axes.T)


def _of_length(metres: float) -> Callable[[Poses], Poses]:
    return _with_positions(np.eye(3) * metres)


def _of_time(seconds: float) -> Callable[[Poses], Poses]:
    return lambda poses: replace(poses, time_s=poses.time_s * seconds)


def _real_part_first(poses: Poses) -> Poses:
    """Rotations of quaternions whose four numbers were read in the order x, y, z, w."""
    from scipy.spatial.transform import Rotation  # a quarter of a second, which only odd poses take

    return replace(poses, rotation=matrices(Rotation.from_matrix(poses.rotation).as_quat()[:, (1, 2, 3, 0)]))


CONVENTIONS = (
    Convention("poses map the world to the camera", "Invert each pose; the format expects camera to world.", _inverted),
    Convention("the z axis points up", "Write x, z, -y instead; the y axis must point up.", _in_axes(_Z_UP)),
    Convention("y and z are exchanged", "Exchange them; the y axis must point up.", _in_axes(_SWAP)),
    Convention(
        "the z axis points up in the positions, but not in the orientations",
        "Write the positions as x, z, -y; the y axis must point up.",
        _with_positions(_Z_UP),
    ),
    Convention(
        "y and z of the positions are exchanged",
        "Exchange them; the y axis must point up.",
        _with_positions(_SWAP),
    ),
    Convention(
        "x and y of the positions are exchanged",
        "Exchange them; the y axis must point up.",
        _with_positions(_SWAP_XY),
    ),
    Convention(
        "the frame is left-handed, like that of Unity",
        "Change the signs of z, qx and qy; the format expects a right-handed frame.",
        _in_axes(_MIRROR),
    ),
    Convention("the quaternions begin with the real part w", "Write qx, qy, qz, qw in this order.", _real_part_first),
    Convention(
        "the camera's y axis points down and its z axis forward",
        "Rotate each orientation by 180 degrees about the camera's x axis; y must point up, z backwards.",
        lambda poses: replace(poses, rotation=poses.rotation @ np.diag((1.0, -1.0, -1.0))),
    ),
    Convention("times are in milliseconds", "Divide them by 1000; the format expects seconds.", _of_time(1e-3)),
    Convention("times are in microseconds", "Divide them by 1,000,000; the format expects seconds.", _of_time(1e-6)),
    Convention("lengths are in millimetres", "Divide them by 1000; the format expects metres.", _of_length(1e-3)),
    Convention("lengths are in centimetres", "Divide them by 100; the format expects metres.", _of_length(1e-2)),
    Convention(
        "lengths are in feet",
        "Multiply them by 0.3048; the format expects metres.",
        _of_length(0.3048),
        vehicle_alike=True,
    ),
)
"""In the order in which messages name them."""
