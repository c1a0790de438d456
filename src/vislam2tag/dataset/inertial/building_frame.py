"""How the phone's level frame stands in the building: from the tracker's orientation and the phone's own.

The camera's axes are parallel to the phone's, but which is which depends on the recorder (ARCore has poses of the
camera and of the sensors). Gravity and the turns of a walk, seen from both, tell it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.dataset.inertial.gravity_frame import LevelOrientation

TURN_S = 0.5
"""Turns are compared over this time: longer than a late pose stamp, shorter than a swing of the hand."""
MIN_ALIKE = 0.5
"""Correlation of the tilting turns below which camera and phone do not describe the same motion."""
MIN_LEAD = 0.2
"""By how much the best assignment of axes must beat the second."""
MIN_GRAVITY = 0.9
"""Mean cosine between the two ideas of up; 25 degrees."""
COMPARED_NS = 100_000_000
"""Frames are thinned to one in this time: headings are averaged, turns compared over longer ones."""
HEADING_SPAN_S = 5.0
"""Headings are averaged over this time before and after: late stamps cancel, the phone's own heading hardly drifts."""
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class LevelHeading:
    """Heading of the level frame's x axis in the BCS at frames (n,): ``turn`` is ``exp(i heading)``.

    It is shorter than 1 by the cosine of the angle between the two ideas of up. ``camera_axes`` is ``camera_R_body``.
    """

    time_ns: IntArray
    turn: ComplexArray
    camera_axes: Rotation

    def at(self, time_ns: IntArray) -> ComplexArray:
        """Average about each time (k,); the shorter, the less tracker and phone agree. Zero where no frame is near."""
        span_ns = round(HEADING_SPAN_S * 1e9)
        first = np.searchsorted(self.time_ns, time_ns - span_ns)
        last = np.searchsorted(self.time_ns, time_ns + span_ns, side="right")
        total = np.concatenate((np.zeros(1, dtype=complex), np.cumsum(self.turn)))
        mean: ComplexArray = (total[last] - total[first]) / np.maximum(last - first, 1)
        return mean


def level_heading(time_ns: IntArray, bcs_R_camera: Rotation, level: LevelOrientation) -> LevelHeading | None:
    """Compare the two orientations at frames (n,), in time order; None where they do not describe the same motion."""
    kept = np.flatnonzero(np.diff(time_ns // COMPARED_NS, prepend=-1))
    time_ns, bcs_R_camera = time_ns[kept], bcs_R_camera[kept]
    level_R_body = level.at(time_ns)
    camera_R_body = _camera_axes(time_ns, bcs_R_camera, level_R_body)
    if camera_R_body is None:
        return None
    matrix = (bcs_R_camera * camera_R_body * level_R_body.inv()).as_matrix()
    heading = np.arctan2(matrix[:, 1, 0] - matrix[:, 0, 1], matrix[:, 0, 0] + matrix[:, 1, 1])
    return LevelHeading(time_ns, (np.cos(heading) + 1j * np.sin(heading)) * matrix[:, 2, 2], camera_R_body)


def _camera_axes(time_ns: IntArray, bcs_R_camera: Rotation, level_R_body: Rotation) -> Rotation | None:
    """Choose among the 24 ways in which the camera's axes can be parallel to the phone's, by frames (n,)."""
    later = np.searchsorted(time_ns, time_ns + round(TURN_S * 1e9))
    pairs = np.flatnonzero(later < len(time_ns))
    if len(pairs) == 0:
        return None
    up_camera, up_body = bcs_R_camera.inv().apply(_UP), level_R_body.inv().apply(_UP)
    turn_camera = _tilting(bcs_R_camera, up_camera, pairs, later[pairs])
    turn_body = _tilting(level_R_body, up_body, pairs, later[pairs])
    ways = Rotation.create_group("O").as_matrix()
    gravity = np.einsum("wij,ij->w", ways, up_camera.T @ up_body) / len(time_ns)
    norm = np.sqrt(np.sum(turn_camera**2) * np.sum(turn_body**2))
    alike = np.einsum("wij,ij->w", ways, turn_camera.T @ turn_body) / max(norm, 1e-12)
    alike[gravity < MIN_GRAVITY] = -1.0
    second, best = np.argsort(alike)[-2:]
    if alike[best] < MIN_ALIKE or alike[best] - alike[second] < MIN_LEAD:
        return None
    return Rotation.from_matrix(ways[best])


def _tilting(world_R_own: Rotation, up: FloatArray, start: IntArray, end: IntArray) -> FloatArray:
    """Turns (p, 3) between pairs of frames in their own axes, without the part about the vertical."""
    turn = (world_R_own[start].inv() * world_R_own[end]).as_rotvec()
    tilting: FloatArray = turn - np.sum(turn * up[start], axis=1, keepdims=True) * up[start]
    return tilting
