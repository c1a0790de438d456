"""The tracker's vertical axis made continuous: jumps and re-expressions taken out, and how far to trust the rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.visits import usable_rank
from vislam2tag.smoother.medians import running_median

USUAL_STEPS = 7
"""Steps between frames of which the median is what the camera was doing."""
ODD_STEP_M = 0.03
"""A step this far from the usual one may be the tracker's; only then the landmarks are asked."""
JUMP_M = 0.1
JUMP_M_PER_S = 1.5
"""Nobody changes height faster than this (plus :data:`JUMP_M`): such a step is a jump of the tracker."""
WALK_M = 0.3
WALK_M_PER_S = 3.0
"""Nor does anybody walk faster than this (plus :data:`WALK_M`)."""
LARGEST_JUMP_M = 2.0
"""A jump frees the height by its own size, at most by this (standard deviation, metres)."""
DRIFT_M = 0.015
"""Vertical drift per square root of metre walked."""
STAIRS_DRIFT_M = 0.05
"""Further drift per square root of metre climbed."""
REST_DRIFT_M = 0.003
"""Drift per square root of second, walking or not."""
LOSS_M_PER_S = 0.2
"""While tracking is lost the camera may change height by this (standard deviation)."""


@dataclass(frozen=True)
class VerticalTrack:
    """The camera's height up to an offset that wanders, at the ``f`` usable frames of a walk.

    ``frame`` (f,) index into the camera track; ``time_s`` (f,) from the first usable frame; ``height_m`` (f,)
    continuous height; ``shift_m`` (f,) what was added to the tracker's vertical axis to make it so; ``variance_m2``
    (f,) variance that the offset has gained since the start, non-decreasing; ``speed_m_s`` (f,) horizontal speed over
    about a second.
    """

    frame: IntArray
    time_s: FloatArray
    height_m: FloatArray
    shift_m: FloatArray
    variance_m2: FloatArray
    speed_m_s: FloatArray

    def raised(self, step_m: FloatArray, variance_m2: FloatArray) -> VerticalTrack:
        """Add steps (f,) that the tracker did not see, each before its frame, and their variances (f,)."""
        rise = np.cumsum(step_m)
        return VerticalTrack(
            self.frame,
            self.time_s,
            self.height_m + rise,
            self.shift_m + rise,
            self.variance_m2 + np.cumsum(variance_m2),
            self.speed_m_s,
        )


def vertical_track(camera: CameraTrack, log: LandmarkLog) -> VerticalTrack:
    """Take jumps and re-expressions out of the camera's ``ty``; needs at least one usable frame."""
    frame = np.flatnonzero(camera.usable)
    time_s = (camera.time_ns[frame] - camera.time_ns[frame[0]]) * 1e-9
    logged = camera.position_acs[frame, 1]
    elapsed = np.diff(time_s)
    step = np.diff(logged)
    usual = _usual_steps(step, elapsed)
    step = step - _common_steps(camera, log, step, usual)
    odd = step - usual
    jump = np.abs(odd) > JUMP_M + JUMP_M_PER_S * elapsed
    step[jump] = usual[jump]
    plane = camera.plane_acs[frame]
    walked = np.minimum(np.linalg.norm(np.diff(plane, axis=0), axis=1), JUMP_M_PER_S * elapsed)
    variance = DRIFT_M**2 * walked + STAIRS_DRIFT_M**2 * np.abs(step) + REST_DRIFT_M**2 * elapsed
    variance += np.where(jump, np.minimum(np.abs(odd), LARGEST_JUMP_M), 0.0) ** 2
    variance += _loss_variance(camera, log, elapsed)
    height = logged[0] + np.concatenate(([0.0], np.cumsum(step)))
    gained = np.concatenate(([0.0], np.cumsum(variance)))
    return VerticalTrack(frame, time_s, height, height - logged, gained, _speed(time_s, plane))


def _usual_steps(step: FloatArray, elapsed: FloatArray) -> FloatArray:
    """Vertical steps (f - 1,) that the neighbouring ones lead to expect, metres."""
    if not len(step):
        return step
    return running_median(step / elapsed, USUAL_STEPS) * elapsed


def _common_steps(camera: CameraTrack, log: LandmarkLog, step: FloatArray, usual: FloatArray) -> FloatArray:
    """Part (f - 1,) of each step that all landmarks made as well: the tracker re-expressed its frame.

    Only where it explains an odd step of the camera; landmarks that move alone are the tracker's new idea of them.
    """
    odd = np.abs(step - usual) > ODD_STEP_M
    rank = usable_rank(camera)
    after_odd = np.concatenate(([False], odd))[rank.clip(0)]
    later = np.flatnonzero(after_odd[log.frame[1:]] & (log.landmark[1:] == log.landmark[:-1])) + 1
    later = later[rank[log.frame[later]] - rank[log.frame[later - 1]] == 1]
    later = later[~log.lost[later] & ~log.lost[later - 1]]
    moved = log.position_acs[later, 1] - log.position_acs[later - 1, 1]
    common = _medians(rank[log.frame[later]] - 1, moved, len(step))
    explains = np.abs(step - common - usual) < np.abs(step - usual)
    return np.where(odd & explains, common, 0.0)


def _medians(group: IntArray, values: FloatArray, groups: int) -> FloatArray:
    """Lower median (groups,) of the values of each group; 0 for an empty one."""
    order = np.lexsort((values, group))
    count = np.bincount(group, minlength=groups)
    middle = np.cumsum(count) - count + (count - 1) // 2
    median = np.zeros(groups)
    filled = count > 0
    median[filled] = values[order][middle[filled]]
    return median


def _loss_variance(camera: CameraTrack, log: LandmarkLog, elapsed: FloatArray) -> FloatArray:
    """Variance (f - 1,) of the height gained in steps to frames at which tracking was lost, and out of a loss."""
    lost = _lost(camera, log)
    blind: BoolArray = lost[1:] | lost[:-1]
    edges = np.flatnonzero(np.diff(np.concatenate(([False], blind, [False]))))
    variance = np.zeros(len(elapsed))
    for start, stop in edges.reshape(-1, 2).tolist():
        lasting = elapsed[start:stop]
        variance[start:stop] = LOSS_M_PER_S**2 * lasting * lasting.sum()
    return variance


def _lost(camera: CameraTrack, log: LandmarkLog) -> BoolArray:
    """Mask (f,) of the usable frames without tracking: by the tracker's word, or all landmarks logged are lost."""
    if camera.state is not None:
        return np.asarray(~camera.state.tracking[camera.usable])
    rank, frames = usable_rank(camera), int(np.count_nonzero(camera.usable))
    logged = np.bincount(rank[log.frame], minlength=frames)
    gone = np.bincount(rank[log.frame[log.lost]], minlength=frames)
    return np.asarray((logged > 0) & (gone == logged))


def _speed(time_s: FloatArray, plane: FloatArray) -> FloatArray:
    """Horizontal speed (f,): the way between half a second before and after, jumps left out, m/s."""
    step = np.diff(plane, axis=0, prepend=plane[:1])
    step[np.linalg.norm(step, axis=1) > WALK_M + WALK_M_PER_S * np.diff(time_s, prepend=time_s[0])] = 0.0
    before, after, walk = time_s - 0.5, time_s + 0.5, np.cumsum(step, axis=0)
    way = [np.interp(after, time_s, walk[:, axis]) - np.interp(before, time_s, walk[:, axis]) for axis in (0, 1)]
    return np.asarray(np.hypot(*way))
