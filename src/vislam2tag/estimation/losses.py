"""Stretches without tracking: landmarks at the camera or not logged at all, or a camera that is frozen."""

from __future__ import annotations

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, runs_of
from vislam2tag.core.tracks import CameraTrack, LandmarkLog

FROZEN_S = 0.3
"""A camera position that stays the same to the last bit for longer is no position."""
STANDING_M_S = 0.3
"""A camera that moves less than this on average while tracking is lost is frozen, noise or not."""
FASTEST_M_S = 3.0
"""Nobody walks faster: a longer jump over a loss is another map, not the way walked meanwhile."""
LEAST_JUMP_M = 0.3
"""... nor does a step shorter than this show that anything jumped as tracking was lost."""
UNSEEN_M_S = 0.5
"""Somebody who walks while the camera is frozen gets elsewhere by this a second (standard deviation per axis) ..."""
FOUND_M_S = 0.25
"""... and by this where the camera makes good for the way as it is found again."""
FROZEN_WALK_M = 6.0
FROZEN_WALK_M_S = 1.0
"""Somebody may have walked this far while the camera was frozen, and this much farther a second."""
FOUND_TURN_RAD = 0.03
NEW_MAP_TURN_RAD = 1.0
"""How far a tracker's map may have turned over a loss; and where it has come out in another map, metres away."""
FOUND_SIGMA_M = 0.1
"""How far off a tracker may be that goes on through a loss."""


def lost_frames(camera: CameraTrack, log: LandmarkLog, frame: IntArray) -> BoolArray:
    """Mask (n,) of the usable frames in which the tracker was lost, by its own word where the log has it.

    Otherwise it was where landmarks are at the camera, or none is logged any more.
    """
    if camera.state is not None:
        return np.asarray(~camera.state.tracking[frame])
    at_camera = np.zeros(len(camera.time_ns), dtype=bool)
    at_camera[log.frame[log.lost]] = True
    silent = np.ones(len(camera.time_ns), dtype=bool)
    silent[log.frame] = False
    silent[: log.frame.min(initial=len(silent))] = False
    return np.asarray((at_camera | silent)[frame])


def frozen_frames(camera: CameraTrack, frame: IntArray, time_s: FloatArray) -> BoolArray:
    """Mask (n,) of the usable frames in which the camera's position stays the same for :data:`FROZEN_S`."""
    position = camera.position_acs[frame]
    frozen = np.zeros(len(frame), dtype=bool)
    for first, after in runs_of(np.all(position[1:] == position[:-1], axis=1)):
        if time_s[after] - time_s[first] > FROZEN_S:
            frozen[first : after + 1] = True
    return frozen


def steps_over_loss(step: ComplexArray, dt: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Steps (k,) over a loss and their variances (k,) per axis beyond the usual drift, m^2.

    A tracker that goes on meanwhile is believed nearly as ever. A frozen camera's way, as far as the tracker says when
    it finds itself again, is spread evenly, with the freedom of somebody who walks unseen: less where it does.
    """
    share = dt / dt.sum()
    jumped = np.abs(step) > np.maximum(FASTEST_M_S * dt, LEAST_JUMP_M)
    makes_good, jumped[-1] = jumped[-1], False  # there a frozen camera makes good for the way
    step = np.where(jumped, 0, step)
    if np.abs(step[:-1]).sum() >= STANDING_M_S * dt[:-1].sum() > 0:
        return step, FOUND_SIGMA_M**2 * share
    displacement = complex(step.sum())
    walkable = abs(displacement) < FASTEST_M_S * (dt.sum() + 1)
    free_m_s = FOUND_M_S if makes_good and walkable else UNSEEN_M_S
    return (displacement if walkable else 0j) * share, (free_m_s * dt.sum()) ** 2 * share


def loss_turn_rad(step: ComplexArray, dt: FloatArray) -> float:
    """Standard deviation of how far the map has turned over a loss with these steps (k,), as logged."""
    walkable = abs(complex(step.sum())) < FASTEST_M_S * (dt.sum() + 1)
    return FOUND_TURN_RAD if walkable else NEW_MAP_TURN_RAD


def walkable_m(frozen: BoolArray, dt: FloatArray) -> FloatArray:
    """How far somebody may have walked over each run of ``frozen`` steps (k,), metres, at its steps; 0 elsewhere."""
    length_m = np.zeros(len(dt))
    for start, stop in runs_of(frozen):
        length_m[start:stop] = FROZEN_WALK_M + FROZEN_WALK_M_S * dt[start:stop].sum()
    return length_m
