"""The tracker's vertical axis made continuous: jumps and re-expressions taken out, and how far to trust the rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, runs_of
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.visits import usable_rank
from vislam2tag.estimation.odometry import Odometry
from vislam2tag.estimation.steps import implausible, predicted, prediction_sigma_m

ODD_STEP_M = 0.03
"""A step this far from the predicted one may be the tracker's; only then the landmarks are asked."""
FASTEST_M_PER_S = 1.5
"""Nobody changes height faster than this."""
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


def vertical_track(camera: CameraTrack, log: LandmarkLog, odometry: Odometry) -> VerticalTrack:
    """Take jumps and re-expressions out of the camera's ``ty``; ``odometry`` is that of the same walk."""
    frame, elapsed = odometry.frame, np.diff(odometry.time_s)
    logged = camera.position_acs[frame, 1]
    step = np.diff(logged)
    usual = predicted(step, elapsed)
    step = step - _common_steps(camera, log, step, usual)
    odd = np.abs(step - usual)
    jump = implausible(odd, prediction_sigma_m(odd, elapsed, dimensions=1), elapsed, FASTEST_M_PER_S)
    jump |= odometry.jumped & ~odometry.blind
    step[jump] = usual[jump]
    variance = DRIFT_M**2 * odometry.step_length_m + STAIRS_DRIFT_M**2 * np.abs(step) + REST_DRIFT_M**2 * elapsed
    variance += np.where(jump, np.minimum(odd, LARGEST_JUMP_M), 0.0) ** 2
    variance += _loss_variance(odometry.blind, elapsed)
    height = logged[0] + np.concatenate(([0.0], np.cumsum(step)))
    gained = np.concatenate(([0.0], np.cumsum(variance)))
    return VerticalTrack(frame, odometry.time_s, height, height - logged, gained, _speed(odometry))


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


def _loss_variance(blind: BoolArray, elapsed: FloatArray) -> FloatArray:
    """Variance (f - 1,) of the height gained in steps over which tracking was lost, m^2; ``elapsed`` (f - 1,) s."""
    variance = np.zeros(len(elapsed))
    for start, stop in runs_of(blind):
        lasting = elapsed[start:stop]
        variance[start:stop] = LOSS_M_PER_S**2 * lasting * lasting.sum()
    return variance


def _speed(odometry: Odometry) -> FloatArray:
    """Horizontal speed (f,): the way between half a second before and after, m/s."""
    time_s = odometry.time_s
    axes = (odometry.path.real, odometry.path.imag)
    moved = [np.interp(time_s + 0.5, time_s, part) - np.interp(time_s - 0.5, time_s, part) for part in axes]
    return np.asarray(np.hypot(*moved))
