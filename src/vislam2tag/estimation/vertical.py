"""The tracker's vertical axis made continuous: without jumps, and with the rides that the tracker does not see.

Air pressure shows lift rides, and changes during tracking losses. Without it a ride shows as a stretch without
horizontal motion, and the landmarks before and after show its height, if they are on different floors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray, runs_of
from vislam2tag.core.context import PressureLog
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.visits import usable_rank
from vislam2tag.estimation.odometry import Odometry
from vislam2tag.estimation.steps import implausible, predicted, prediction_sigma_m

ODD_STEP_M = 0.03
"""A step with a larger misfit may be from the tracker; only then landmarks are checked."""
FASTEST_M_PER_S = 1.5
"""Largest vertical speed of a person."""
LARGEST_JUMP_M = 2.0
"""A jump adds its own size to the uncertainty of the height, up to this limit (standard deviation, metres)."""
DRIFT_M = 0.015
"""Vertical drift per square root of a metre walked."""
STAIRS_DRIFT_M = 0.05
"""Additional drift per square root of a metre climbed."""
REST_DRIFT_M = 0.003
"""Drift per square root of a second, walking or not."""
LOSS_M_PER_S = 0.2
"""Vertical speed during tracking losses (standard deviation)."""


@dataclass(frozen=True)
class VerticalTrack:
    """The camera's height, up to a wandering offset, at the ``f`` usable frames of a walk.

    ``frame`` (f,) is the index into the camera track; ``time_s`` (f,) is from the first usable frame. ``height_m`` (f,)
    is the continuous height, and ``shift_m`` (f,) the correction of the tracker's vertical axis. ``variance_m2`` (f,)
    is the variance of the offset since the start, non-decreasing; ``speed_m_s`` (f,) the horizontal speed over about a
    second.
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
    """Remove jumps and re-expressions from the camera's ``ty``; ``odometry`` is that of the same walk."""
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
    """Part (f - 1,) of each step that all landmarks also made, because the tracker re-expressed its frame.

    Only if it explains an odd step of the camera; landmarks that move alone are corrections of the tracker.
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
    """Horizontal speed (f,): distance between half a second before and after, m/s."""
    time_s = odometry.time_s
    return np.hypot(*(change_around(time_s, part, 1.0) for part in (odometry.path.real, odometry.path.imag)))


def change_around(time_s: FloatArray, values: FloatArray, window_s: float) -> FloatArray:
    """Change (f,) of values (f,) from half a window before each time (f,) to half a window after."""
    after, before = (np.interp(time_s + side * window_s / 2, time_s, values) for side in (1, -1))
    return np.asarray(after - before)


STILL_M_PER_S = 0.25
SHORTEST_S = 2.0
"""Shortest duration of a lift ride."""
PRESSURE_WINDOW_S = 1.0
RIDE_WINDOW_S = 10.0
PRESSURE_RIDE_M = 1.5
"""Smallest difference between the rise by air pressure and by the tracker within the window; less may be from doors."""
PRESSURE_SIGMA_M = 0.4
UNSEEN_SHARE = 0.5
"""If the tracker saw less than this share of the rise between landmarks on different floors, the rest is a ride."""
RIDE_SIGMA_M = 1.0
LIFT_M_PER_S = 0.8
"""Usual mean speed of a lift."""


def altitude_m(pressure: PressureLog, time_ns: IntArray) -> FloatArray:
    """Height (k,) in the standard atmosphere at boot-clock times (k,), averaged over about a second, metres."""
    height = 44330.77 * (1.0 - (pressure.pressure_hpa / 1013.25) ** 0.190263)
    rate_hz = 1e9 / max(float(np.median(np.diff(pressure.time_ns))), 1.0) if len(height) > 1 else 1.0
    smooth = _running_mean(height, max(1, round(PRESSURE_WINDOW_S * rate_hz)))
    start = pressure.time_ns[0]
    return np.asarray(np.interp((time_ns - start) * 1e-9, (pressure.time_ns - start) * 1e-9, smooth))


def _running_mean(values: FloatArray, size: int) -> FloatArray:
    """Mean (n,) of the ``size`` entries around each of the values (n,), which are constant beyond the ends."""
    around = np.pad(values - values[0], (size // 2, (size - 1) // 2), mode="edge")
    upto = np.concatenate(([0.0], np.cumsum(around)))
    return np.asarray(values[0] + (upto[size:] - upto[:-size]) / size)


def with_rides_by_pressure(track: VerticalTrack, time_ns: IntArray, pressure: PressureLog) -> VerticalTrack:
    """Use the height by air pressure if it shows a rise that the tracker does not see.

    ``time_ns`` (f,) are the boot-clock times of the track's frames.
    """
    unseen = altitude_m(pressure, time_ns) - track.height_m
    riding = np.abs(change_around(track.time_s, unseen, RIDE_WINDOW_S)) > PRESSURE_RIDE_M
    step = np.where(riding, np.diff(unseen, prepend=unseen[0]), 0.0)
    # The variance of a ride is added once, spread over its frames.
    ride = np.cumsum(np.diff(riding, prepend=False) & riding)
    frames = np.bincount(ride[riding], minlength=ride.max() + 1)
    variance = np.where(riding, PRESSURE_SIGMA_M**2 / np.maximum(frames[ride], 1), 0.0)
    return track.raised(step, variance)


def with_rides_by_landmarks(
    track: VerticalTrack, sighted: IntArray, rise_m: FloatArray, seen_m: FloatArray
) -> VerticalTrack:
    """Put the rise that the tracker did not see between landmarks on different floors into the stillest stretch.

    That is the longest still stretch between them (its middle, for the duration of a lift ride), or the whole path
    between. ``sighted`` (t, 2) are usable ranks of frames that sighted two such landmarks in succession. ``rise_m``
    (t,) is the height of the second landmark above the first by the survey, ``seen_m`` (t,) by the tracker.
    """
    step, variance = np.zeros(len(track.frame)), np.zeros(len(track.frame))
    still = still_stretches(track)
    for ranks, rise, seen in zip(sighted, rise_m.tolist(), seen_m.tolist(), strict=True):
        if seen * np.sign(rise) >= UNSEEN_SHARE * abs(rise):
            continue
        start_s, stop_s = track.time_s[_stillest(still, track.time_s, ranks)]
        missing = rise - seen
        spare_s = max(0.0, stop_s - start_s - abs(missing) / LIFT_M_PER_S)
        share = ((track.time_s - start_s - spare_s / 2) / (stop_s - start_s - spare_s)).clip(0, 1)
        step += missing * np.diff(share, prepend=0.0)
        lasting = ((track.time_s - start_s) / (stop_s - start_s)).clip(0, 1)
        variance += RIDE_SIGMA_M**2 * np.diff(lasting, prepend=0.0)
    return track.raised(step, variance)


def still_stretches(track: VerticalTrack) -> IntArray:
    """Runs (r, 2) of ranks, first and last frame, in which the camera does not move horizontally for a while."""
    still = np.concatenate(([False], track.speed_m_s < STILL_M_PER_S, [False]))
    edges = np.flatnonzero(np.diff(still)).reshape(-1, 2) - (0, 1)
    long = track.time_s[edges[:, 1]] - track.time_s[edges[:, 0]] >= SHORTEST_S
    return np.asarray(edges[long], dtype=np.int64)


def _stillest(still: IntArray, time_s: FloatArray, sighted: IntArray) -> IntArray:
    """First and last rank (2,) of the longest still stretch (r, 2) between two sightings, or of these."""
    between = still.clip(*sighted)
    lasting = time_s[between[:, 1]] - time_s[between[:, 0]]
    if not len(lasting) or lasting.max() < SHORTEST_S:
        return sighted
    return np.asarray(between[int(np.argmax(lasting))])
