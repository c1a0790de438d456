"""Bridges tracking losses, breaks and slips with inertial sensors (docs/explanation/smoother.md).

Inertial sensors give steps and turns up to a heading and a scale, which follow from the tracker's steps on both sides.
The error of such a bridge is measured on the same walk, over stretches of equal duration that the tracker saw. Slips
are detected where the paths of tracker and inertial sensors differ although the tracker reports no loss.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, runs_of
from vislam2tag.core.context import InertialLog
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.estimation.dead_reckoning.gait import WindowFeatures, speed_model
from vislam2tag.estimation.dead_reckoning.signals import RATE_HZ, WalkSignals, turned_about_up
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.odometry import Odometry, continuous_odometry, twist_between

WINDOW_S, HOP_S = 1.0, 0.25
"""Length of the windows in which paths are compared, and interval of their starts."""
NEIGHBOURS = 5
"""Number of windows on each side that give heading and scale of the inertial path."""
LEAST_WAY_M2 = 2.0
"""Smallest sum of their squared lengths; a shorter path has no heading."""
UNUSUAL = 6.0
"""A slip is larger than this many times the usual error of such windows in the same walk, per axis ..."""
LEAST_SLIP_M = 0.3
"""... and at least this far."""
CLEAREST = 0.8
"""Of successive windows those count that show nearly as much as the clearest one."""
MEDIAN_SIGMAS = 1.18
"""Median length of a normal error of two dimensions, in standard deviations per axis."""


def tracker_slips(
    time_s: FloatArray, tracker_path: ComplexArray, inertial_path: ComplexArray, sound: BoolArray
) -> list[tuple[slice, complex]]:
    """Steps at which a tracker's path (n,) slipped against the inertial one (n,), and the slips, complex metres.

    ``sound`` (n - 1,) are the steps that both show. Slips that last longer than a window are not detected.
    """
    start_s = np.arange(time_s[0], time_s[-1] - WINDOW_S, HOP_S)
    end_s = start_s + WINDOW_S
    if not len(start_s):
        return []
    unsound = np.concatenate(([0.0], np.cumsum(~sound)))
    moved, walked, broken = (
        np.interp(end_s, time_s, path) - np.interp(start_s, time_s, path)
        for path in (tracker_path, inertial_path, unsound)
    )
    whole = broken == 0
    alike = _sum_of_neighbours(np.where(whole, walked.conj() * moved, 0))
    way_m2 = _sum_of_neighbours(np.where(whole, np.abs(walked) ** 2, 0)).real
    known = whole & (way_m2 > LEAST_WAY_M2)
    off = np.where(known, moved - walked * alike / np.where(known, way_m2, 1), 0)
    usual_m = float(np.median(np.abs(off[known]))) / MEDIAN_SIGMAS if known.any() else 0.0
    found = []
    for first, after in runs_of(np.abs(off) > max(UNUSUAL * usual_m, LEAST_SLIP_M)):
        size = np.abs(off[first:after])
        clear = first + np.flatnonzero(size > CLEAREST * size.max())
        start, stop = np.searchsorted(time_s, (start_s[clear[0]], end_s[clear[-1]])).tolist()
        found.append((slice(start, stop), complex(off[first + int(size.argmax())])))
    return found


def _sum_of_neighbours(values: ComplexArray) -> ComplexArray:
    """Sums (m,) of values (m,) of the neighbours of each window that overlap neither it nor one another."""
    hops = round(WINDOW_S / HOP_S)
    padded = np.pad(values, NEIGHBOURS * hops)
    shifts = [NEIGHBOURS * hops + side * hops * number for number in range(1, NEIGHBOURS + 1) for side in (-1, 1)]
    return np.asarray(sum(padded[shift : shift + len(values)] for shift in shifts), dtype=np.complex128)


CHUNK_S, CHUNKS = 1.0, 5
"""Length and number of the chunks in which both paths are compared on each side of a bridge."""
LEAST_WAY_M = 1.5
"""A shorter path has no heading."""
FEWEST_TRIALS = 8
"""Number of trials on the same walk that a bridge needs."""
MOST_TRIALS, LEAST_APART_S = 200, 0.5
FOUND_M, FOUND_DOF = 0.5, 2.0
"""Usual error per axis of a tracker that resumes after a loss, with the degrees of freedom of Student's t, because it
may be in another map."""


@dataclass(frozen=True)
class WalkerMotion:
    """Inertial sensors at ``n`` frames: ``path`` (n,) complex metres, of unknown scale, in a frame that is fixed by the
    gyroscope; ``known`` (n - 1,) mask of the steps with readings.
    """

    path: ComplexArray
    known: BoolArray
    turned_rad: FloatArray
    """(n,) turn of the device about the vertical, counted from the start."""

    @classmethod
    def of(cls, log: InertialLog, time_ns: IntArray) -> WalkerMotion | None:
        """Compute it from a walk's readings, at increasing times (n,); None if the readings are insufficient."""
        signals = WalkSignals.of(log)
        if signals is None:
            return None
        up, turned_rad = turned_about_up(signals)
        at_s = (time_ns - signals.start_ns) * 1e-9
        speed_m_s = speed_model().speed_m_s(WindowFeatures.of(signals, up), signals.time_s)
        velocity = speed_m_s * np.exp(1j * turned_rad)
        path = np.concatenate(([0.0], np.cumsum(velocity[:-1]))) / RATE_HZ
        unknown = np.interp(at_s, signals.time_s, np.cumsum(~signals.known))
        within = (at_s >= 0) & (at_s <= signals.time_s[-1])
        known = (np.diff(unknown) == 0) & within[1:] & within[:-1]
        return cls(np.interp(at_s, signals.time_s, path), known, np.interp(at_s, signals.time_s, np.unwrap(turned_rad)))


def bridged_observations(
    camera: CameraTrack,
    log: LandmarkLog,
    range_m: float,
    *,
    slips: bool = False,
    surveyed: Collection[str] = (),
    turned_as_camera: bool = False,
) -> WalkObservations:
    """Reduce a session with two or more usable frames for the smoother, with bridged losses.

    With ``slips`` possible slips of the tracker are also detected. If there are more landmarks than can be solved for,
    ``surveyed`` ones have priority. ``turned_as_camera`` is explained at
    :func:`~vislam2tag.estimation.odometry.continuous_odometry`.
    """
    odometry = continuous_odometry(camera, log, turned_as_camera=turned_as_camera)
    asked = slips or (odometry.jump_m2 > 0).any() or (odometry.jump_rad2 > 0).any()
    if camera.inertial is not None and asked:
        exposed_ns = camera.time_ns[odometry.frame] - round((camera.pose_lag_s or 0.0) * 1e9)
        motion = WalkerMotion.of(camera.inertial, exposed_ns)
        if motion is not None:
            if turned_as_camera:
                odometry = turned_as_device(odometry, camera, motion)
            odometry = bridged(with_slips(odometry, motion) if slips else odometry, motion)
    return WalkObservations.of(camera, log, range_m, odometry, surveyed)


def with_slips(odometry: Odometry, motion: WalkerMotion) -> Odometry:
    """Mark the steps of n frames' odometry over which the tracker may have slipped; landmarks decide whether it did."""
    sound = motion.known & (odometry.jump_m2 == 0) & (odometry.jump_rad2 == 0)
    doubt = odometry.doubt.copy()
    for steps, off in tracker_slips(odometry.time_s, odometry.path, motion.path, sound):
        doubt[steps] = 0
        doubt[(steps.start + steps.stop) // 2] = off
    return replace(odometry, doubt=doubt)


GYROSCOPE_SIGMA_RAD, GYROSCOPE_DRIFT_RAD_S = 0.02, 0.005
"""Error of the turn of a device over a stretch: a constant, and what grows with its duration."""
BESIDE_S = 0.1
"""Turns are compared from this long before a stretch to this long after it, because frames beside a jump may be
smoothed."""


def turned_as_device(odometry: Odometry, camera: CameraTrack, motion: WalkerMotion) -> Odometry:
    """Turn n frames' odometry after each stretch that the tracker does not show, so that the camera turned as much as
    the device by its gyroscope: they are one body.
    """
    time_s, frames = odometry.time_s, odometry.frame
    unseen = (odometry.jump_m2 > 0) | (odometry.jump_rad2 > 0)
    unknown = np.concatenate(([0], np.cumsum(~motion.known)))
    turn, jump_rad2 = np.ones(len(unseen), dtype=np.complex128), odometry.jump_rad2.copy()
    for start, stop in runs_of(unseen):
        first, last = np.searchsorted(time_s, (time_s[start] - BESIDE_S, time_s[stop] + BESIDE_S)).tolist()
        first, last = max(first, 0), min(last, len(time_s) - 1)
        if unknown[last] != unknown[first]:
            continue
        camera_rad = twist_between(*camera.orientation_acs[frames[[first, last]]])
        camera_rad += float(np.angle(odometry.turn[last] * odometry.turn[first].conjugate()))
        missing = camera_rad - float(motion.turned_rad[last] - motion.turned_rad[first])
        turn[stop:] *= np.exp(-1j * missing)
        duration_s = time_s[stop] - time_s[start]
        sigma2 = GYROSCOPE_SIGMA_RAD**2 + (GYROSCOPE_DRIFT_RAD_S * duration_s) ** 2
        jump_rad2[start:stop] = np.minimum(sigma2 / (stop - start), np.maximum(jump_rad2[start:stop], sigma2))
    step = np.diff(odometry.path) * turn
    return replace(
        odometry,
        path=odometry.path[0] + np.concatenate(([0.0], np.cumsum(step))),
        turn=odometry.turn * np.concatenate(([1.0], turn)),
        jump_rad2=jump_rad2,
        doubt=odometry.doubt * turn,
    )


def bridged(odometry: Odometry, motion: WalkerMotion) -> Odometry:
    """Put the inertial path into the stretches of n frames' odometry that the tracker does not show.

    Tracker and bridge are combined by their variances; odometry without such stretches is unchanged.
    """
    walk = _TwoPaths(odometry, motion)
    step, inertial_step, dt = np.diff(odometry.path), np.diff(motion.path), np.diff(odometry.time_s)
    turn = np.ones(len(step), dtype=np.complex128)
    jump_m2, jump_rad2 = odometry.jump_m2.copy(), odometry.jump_rad2.copy()
    for start, stop in runs_of(walk.unseen):
        stretch = slice(start, stop)
        before, after = (complex(side[0]) for side in walk.factors(np.array([start]), np.array([stop])))
        errors = walk.errors(float(odometry.time_s[stop] - odometry.time_s[start]))
        if np.isnan(before) or errors is None:
            continue
        place_m2, turn_rad2 = errors
        inertial_turn_rad = float(np.angle(after * before.conjugate()))
        turned_rad, jump_rad2[stretch] = _bridge_turn(inertial_turn_rad, turn_rad2, jump_rad2[stretch])
        turn[stop:] *= np.exp(-1j * turned_rad)
        inertial = inertial_step[stretch] * (before + after * np.exp(-1j * turned_rad)) / 2
        step_variance = float(jump_m2[stretch].sum())
        if odometry.blind[stretch].any():
            step_variance = min(step_variance, _found_again_m2(step[stretch], inertial))
        share = dt[stretch] / dt[stretch].sum()
        step[stretch], variance = _bridge_steps(step[stretch], step_variance, inertial, place_m2, share)
        jump_m2[stretch] = variance * share
    return replace(
        odometry,
        path=odometry.path[0] + np.concatenate(([0.0], np.cumsum(step * turn))),
        turn=odometry.turn * np.concatenate(([1.0], turn)),
        step_length_m=np.abs(step),
        jump_m2=jump_m2,
        jump_rad2=jump_rad2,
        doubt=odometry.doubt * turn,
    )


def _bridge_turn(inertial_rad: float, inertial_variance: float, jump_rad2: FloatArray) -> tuple[float, FloatArray]:
    """Turn of the tracker's map over a stretch, rad, and the variances (k,) that remain of ``jump_rad2`` (k,).

    The inertial sensors measure the turn with a variance; the tracker allows any turn within its own variance.
    """
    turn_variance = float(jump_rad2.sum())
    gain = _gain(turn_variance, inertial_variance)
    return gain * inertial_rad, jump_rad2 * (1 - gain)


def _found_again_m2(tracker: ComplexArray, inertial: ComplexArray) -> float:
    """Variance of a tracker's path, steps (k,), over a loss after which it resumes; inertial steps (k,)."""
    apart_m2 = abs(complex(tracker.sum()) - inertial.sum()) ** 2
    return float((apart_m2 + FOUND_DOF * FOUND_M**2) / (FOUND_DOF + 2))


def _bridge_steps(
    tracker: ComplexArray, step_variance: float, inertial: ComplexArray, inertial_variance: float, share: FloatArray
) -> tuple[ComplexArray, float]:
    """Steps (k,) over a stretch by those of tracker and inertial sensors (k,), and the variance of their sum.

    Both sums are combined by their variances; the correction of the inertial sum is spread over the steps by ``share``.
    """
    gain = _gain(step_variance, inertial_variance)
    missing = (complex(tracker.sum()) - inertial.sum()) * (1 - gain)
    return inertial + missing * share, gain * inertial_variance


def _gain(variance: float, bridge_variance: float) -> float:
    """The share of a bridge in the mean, by their variances, of tracker and bridge; 0 if the tracker is certain."""
    return variance / (variance + bridge_variance) if variance > 0 else 0.0


class _TwoPaths:
    """A tracker's path and the inertial one, both of n frames."""

    def __init__(self, odometry: Odometry, motion: WalkerMotion) -> None:
        self._time_s, self._tracker_path, self._inertial_path = odometry.time_s, odometry.path, motion.path
        self.unseen: BoolArray = (odometry.jump_m2 > 0) | (odometry.jump_rad2 > 0)
        """(n - 1,) steps that the tracker does not show."""
        self._unseen_until = np.concatenate(([0], np.cumsum(self.unseen)))
        self._unknown_until = np.concatenate(([0], np.cumsum(~motion.known)))
        self._errors: dict[int, tuple[float, float] | None] = {}

    def errors(self, duration_s: float) -> tuple[float, float] | None:
        """Mean squares of the errors of bridges of one duration, per axis, and of their turns, on stretches that the
        tracker saw; None if no trial is possible.

        If there are too few trials, those of half the duration are scaled: the error from a drifting heading grows with
        the power 3 / 2 of the time, and the drift with its root.
        """
        tenths = max(round(10 * duration_s), 1)
        if tenths not in self._errors:
            tried = self._tried(tenths / 10)
            if tried is None and tenths > 1:
                shorter = self.errors(tenths / 20)
                tried = None if shorter is None else (8 * shorter[0], 2 * shorter[1])
            self._errors[tenths] = tried
        return self._errors[tenths]

    def _tried(self, duration_s: float) -> tuple[float, float] | None:
        end_s = float(self._time_s[-1]) - duration_s
        apart_s = max(LEAST_APART_S, end_s / MOST_TRIALS)
        starts = np.unique(np.searchsorted(self._time_s, np.arange(0, end_s, apart_s)))
        stops = np.searchsorted(self._time_s, self._time_s[starts] + duration_s)
        within = stops < len(self._time_s)
        starts, stops = starts[within], stops[within]
        seen = self._unseen_until[stops] == self._unseen_until[starts]
        starts, stops = starts[seen], stops[seen]
        before, after = self.factors(starts, stops)
        walked = (self._inertial_path[stops] - self._inertial_path[starts]) * (before + after) / 2
        place_m2 = np.abs(walked - (self._tracker_path[stops] - self._tracker_path[starts])) ** 2 / 2
        turn_rad2 = np.angle(after * before.conj()) ** 2
        tried = ~np.isnan(before)
        if tried.sum() < FEWEST_TRIALS:
            return None
        return float(place_m2[tried].mean()), float(turn_rad2[tried].mean())

    def factors(self, starts: IntArray, stops: IntArray) -> tuple[ComplexArray, ComplexArray]:
        """Factors (k,) from the inertial path to the tracker's before and after stretches (k,); NaN if unknown.

        A side without a factor gets that of the other side.
        """
        known = self._unknown_until[stops] == self._unknown_until[starts]
        before, after = (np.where(known, self._side(*at), np.nan) for at in ((starts, -1), (stops, 1)))
        return np.where(np.isnan(before), after, before), np.where(np.isnan(after), before, after)

    def _side(self, frames: IntArray, side: int) -> ComplexArray:
        """Factors (k,) from the inertial path to the tracker's on a side (-1, 1) of frames (k,); NaN if unknown."""
        edges_s = self._time_s[frames, None] + side * CHUNK_S * np.arange(CHUNKS + 1)
        edges = np.searchsorted(self._time_s, edges_s).clip(0, len(self._time_s) - 1)
        kept = (edges_s >= 0) & (edges_s <= self._time_s[-1])
        for until in (self._unseen_until, self._unknown_until):
            kept &= until[edges] == until[frames, None]
        inertial, tracker = (
            np.where(kept[:, 1:], np.diff(path[edges]), 0) for path in (self._inertial_path, self._tracker_path)
        )
        enough = np.minimum(np.abs(inertial).sum(axis=1), np.abs(tracker).sum(axis=1)) >= LEAST_WAY_M
        power = (inertial.conj() * inertial).real.sum(axis=1)
        return np.where(enough, (inertial.conj() * tracker).sum(axis=1) / np.where(enough, power, 1), np.nan)
