"""The tracker's path made continuous: steps that are not motion are removed and reported.

ARCore does not guarantee the frame in which it reports poses: it may change at each frame. A step that is not motion
can be detected: it does not fit the steps around it, or landmarks move that are out of view. If camera and landmarks
move alike, the step is measured relative to the landmarks without loss. Otherwise the step is replaced by the
prediction of its neighbours, with a variance.

The **continuous frame** equals the ACS at the first usable frame; it is never rewritten and only drifts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray, runs_of
from vislam2tag.core.status import EventKind, TrackerEvent
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.transforms import as_complex, wrapped
from vislam2tag.estimation.map_moves import MapMoves, map_moves
from vislam2tag.estimation.steps import (
    AFTER,
    BEFORE,
    FASTEST_M_S,
    IMPOSSIBLE,
    find_excursions,
    frozen_frames,
    implausible,
    loss_turn_rad,
    lost_frames,
    predicted,
    predicted_in_plane,
    prediction_sigma_m,
    returned,
    steps_over_loss,
    walkable_m,
)

SUSPICIOUS = 5.0
"""A step that misses its prediction by more standard deviations than this may have slipped by the excess."""
JUMP_SHARE = 0.1
"""Uncertainty of a jump's target, as a share of its size, of at most a metre."""
TURN_SIGMA_RAD = 0.03
"""Standard deviation of the turn of a jump from landmarks."""
UNKNOWN_TURN_RAD = 0.1
"""Standard deviation of the turn of a jump without landmarks."""
CAMERA_TURN_SIGMA_RAD = 0.05
"""The same, if it is taken from the camera's own turn."""
HOLE_S = 2.0
"""A longer time without any frame counts as a loss, because tracking may have stopped."""
UNDONE = 0.3
"""A jump that brings the camera back to within this share of an earlier one undoes it."""
LEAST_UPDATE_M = 0.005
"""Smaller map updates are not reported."""


@dataclass(frozen=True)
class Odometry:
    """The camera's path in the continuous frame, ``n`` usable frames.

    ``frame`` (n,) are indices into the camera track; ``time_s`` (n,) is from the first; ``path`` (n,) complex, metres;
    ``turn`` (n,) complex, unit, is ``continuous_R_acs`` of each frame. For the n - 1 steps: ``step_length_m``,
    ``turned_rad`` (camera, about the vertical), and ``jump_m2`` and ``jump_rad2``, the variances per axis beyond the
    usual drift, of unreliable steps. ``doubt`` (n - 1,) complex, metres, continuous frame, is the excess of steps over
    plausible ones; they may have slipped along it.
    """

    frame: IntArray
    time_s: FloatArray
    path: ComplexArray
    turn: ComplexArray
    step_length_m: FloatArray
    turned_rad: FloatArray
    jump_m2: FloatArray
    jump_rad2: FloatArray
    doubt: ComplexArray
    rewritten: BoolArray
    """(n,) frames at which the tracker rewrote its map; a landmark that moved then was not seen."""
    aside_m2: FloatArray
    """(n,) additional variances per axis of the camera's place during an excursion."""
    jumped: BoolArray
    """(n - 1,) unconnected steps: breaks, corrections, losses."""
    blind: BoolArray
    """(n - 1,) steps into, in and out of a tracking loss, and long ones without any frame."""
    events: tuple[TrackerEvent, ...]


@dataclass(frozen=True)
class _Steps:
    """The n - 1 steps as logged: ``moved`` complex metres in the ACS plane, ``dt`` s, ``twist`` of the camera, rad."""

    moved: ComplexArray
    dt: FloatArray
    twist: FloatArray
    expected: ComplexArray
    """Prediction of the neighbours; ``expected_before`` and ``expected_after`` are from one side only."""
    expected_before: ComplexArray
    expected_after: ComplexArray
    spread_m: FloatArray
    """Usual distance from it."""

    @property
    def miss_m(self) -> FloatArray:
        """Distance (n - 1,) of each step from its prediction, metres."""
        return np.abs(self.moved - self.expected)

    @property
    def camera_turn(self) -> FloatArray:
        """Turn (n - 1,) of the camera beyond the prediction of its neighbours, rad."""
        return wrapped(self.twist - predicted(self.twist, self.dt))

    @property
    def excess(self) -> ComplexArray:
        """Excess (n - 1,) of each step over its prediction beyond the usual one, complex metres in the ACS plane."""
        share = 1 - SUSPICIOUS * self.spread_m / np.maximum(self.miss_m, SUSPICIOUS * self.spread_m)
        return np.asarray((self.moved - self.expected) * share)


@dataclass(frozen=True)
class _Outages:
    """Outages: frames (n,) that are ``lost`` or ``frozen``, and steps (n - 1,) without any frame."""

    lost: BoolArray
    frozen: BoolArray
    hole: BoolArray

    @property
    def blind(self) -> BoolArray:
        """Steps (n - 1,) into, in and out of lost frames, and holes."""
        return np.asarray(self.lost[1:] | self.lost[:-1] | self.hole)

    @property
    def still(self) -> BoolArray:
        """Steps (n - 1,) into, in and out of frozen frames, and holes."""
        return np.asarray(self.frozen[1:] | self.frozen[:-1] | self.hole)

    @property
    def spans(self) -> list[tuple[int, int]]:
        """Steps from the frame before each run of lost or frozen frames to the one after it; each gap on its own."""
        steps = len(self.hole)
        ends = [(max(first - 1, 0), min(after, steps)) for first, after in runs_of(self.lost | self.frozen)]
        rest = [(start + a, start + b) for start, stop in ends for a, b in runs_of(~self.hole[start:stop])]
        return sorted(rest + [(step, step + 1) for step in np.flatnonzero(self.hole).tolist()])


@dataclass(frozen=True)
class _Verdict:
    """Kind of each step (n - 1,), none for those of a frozen camera; ``turned`` rad is the map's turn.

    ``with_map`` is the step relative to the landmarks, complex metres in the ACS plane after it.
    """

    update: BoolArray
    jump: BoolArray
    motion: BoolArray
    turned: FloatArray
    with_map: ComplexArray

    def alone(self, moves: MapMoves) -> BoolArray:
        """Jumps (n - 1,) whose turn no landmarks show."""
        return np.asarray(self.jump & ~_turn_observed(moves))

    @property
    def frame_turn(self) -> ComplexArray:
        """``continuous_R_acs`` (n,) of each frame."""
        return np.exp(-1j * np.concatenate(([0.0], np.cumsum(self.turned))))


@dataclass(frozen=True)
class _Way:
    """The steps (n - 1,) in the continuous frame, complex metres, with variances as in :class:`Odometry`."""

    step: ComplexArray
    jump_m2: FloatArray
    jump_rad2: FloatArray
    aside_m2: FloatArray

    def copy(self) -> _Way:
        """Return a copy for changes."""
        return _Way(self.step.copy(), self.jump_m2.copy(), self.jump_rad2.copy(), self.aside_m2.copy())


def continuous_odometry(camera: CameraTrack, log: LandmarkLog, *, turned_as_camera: bool = False) -> Odometry:
    """Remove the steps that are not motion from a camera track with two or more usable frames.

    With ``turned_as_camera`` a jump turned the map by as much as the camera's own turn jumped. Landmarks show this
    better; without any it is the only evidence.
    """
    frame = np.flatnonzero(camera.usable)
    time_s = (camera.time_ns[frame] - camera.time_ns[frame[0]]) * 1e-9
    raw = as_complex(camera.plane_acs[frame])
    steps = _steps(raw, time_s, _twist(camera.orientation_acs[frame]))
    outages = _Outages(lost_frames(camera, log, frame), frozen_frames(camera, frame, time_s), _holes(camera, frame))
    moves = map_moves(camera, log, steps.miss_m > SUSPICIOUS * steps.spread_m)
    verdict = _judge(steps, moves, raw[1:] - moves.carry(raw[:-1]), outages.still)
    if turned_as_camera:
        verdict = replace(verdict, turned=np.where(verdict.alone(moves), steps.camera_turn, verdict.turned))
    way = _without_jumps(steps, moves, verdict, turned_as_camera=turned_as_camera)
    way = _with_excursions_undone(way, steps, verdict, verdict.jump & ~moves.moved, outages)
    way = _with_losses_walked(way, steps.dt, outages.spans)
    return Odometry(
        frame=frame,
        time_s=time_s,
        path=raw[0] + np.concatenate(([0.0], np.cumsum(way.step))),
        turn=verdict.frame_turn,
        step_length_m=np.abs(way.step),
        turned_rad=np.abs(steps.twist),
        jump_m2=way.jump_m2,
        jump_rad2=way.jump_rad2,
        doubt=np.where(verdict.motion, steps.excess, 0) * verdict.frame_turn[:-1],
        rewritten=np.concatenate(([False], moves.moved)),
        aside_m2=way.aside_m2,
        jumped=verdict.jump | outages.lost[1:] | outages.frozen[1:] | outages.hole,
        blind=outages.blind,
        events=_events(frame, steps, moves, verdict, _loss_events(camera, frame, outages.spans, raw)),
    )


def _steps(raw: ComplexArray, time_s: FloatArray, twist: FloatArray) -> _Steps:
    """The steps between positions (n,), complex metres in the ACS plane, at times (n,), s; ``twist`` (n - 1,) rad."""
    moved, dt = np.diff(raw), np.diff(time_s)
    expected, before, after = (predicted_in_plane(moved, dt, those) for those in (BEFORE + AFTER, BEFORE, AFTER))
    spread = prediction_sigma_m(np.abs(moved - expected), dt, dimensions=2)
    return _Steps(moved, dt, twist, expected, before, after, spread)


def _twist(orientation_acs: FloatArray) -> FloatArray:
    """Turn (n - 1,) of the camera about the vertical between neighbouring frames, rad."""
    ax, ay, az, aw = orientation_acs[:-1].T
    bx, by, bz, bw = orientation_acs[1:].T
    y = -bw * ay + by * aw + bx * az - bz * ax
    w = bw * aw + bx * ax + by * ay + bz * az
    return wrapped(2 * np.arctan2(y, w))


def twist_between(before_acs: FloatArray, after_acs: FloatArray) -> float:
    """Turn of a camera about the vertical between two orientations (4,), rad."""
    return float(_twist(np.stack((before_acs, after_acs)))[0])


def _judge(steps: _Steps, moves: MapMoves, with_map: ComplexArray, frozen: BoolArray) -> _Verdict:
    """Separate map updates and jumps (n - 1,) from motion; steps of a frozen camera are never motion."""
    miss = np.where(frozen, np.abs(steps.moved), steps.miss_m)
    # A map that turned has also turned the steps after it.
    likely = np.stack((moves.turn * steps.expected, moves.turn * steps.expected_before, steps.expected_after))
    miss_with_map = np.abs(with_map - np.where(frozen, 0, likely)).min(axis=0)
    limit = np.where(frozen, walkable_m(frozen, steps.dt), IMPOSSIBLE * steps.spread_m)
    update = moves.moved & (miss_with_map < np.minimum(miss, limit))
    jump = ~update & ~frozen & implausible(miss, steps.spread_m, steps.dt, FASTEST_M_S)
    turned = np.where(update | (jump & _turn_observed(moves)), np.angle(moves.turn), 0.0)
    return _Verdict(update, jump, ~update & ~jump & ~frozen, turned, with_map)


def _turn_observed(moves: MapMoves) -> BoolArray:
    """Steps (n - 1,) with a turn that two or more landmarks show."""
    return np.asarray(moves.moved & (moves.points > 1))


def _without_jumps(steps: _Steps, moves: MapMoves, verdict: _Verdict, *, turned_as_camera: bool) -> _Way:
    """Replace jumps by the prediction of their neighbours, and measure map updates relative to the landmarks."""
    turn, expected = verdict.frame_turn, steps.expected
    if turned_as_camera:  # the steps after the jump are turned, too
        expected = (steps.expected_before + steps.expected_after * np.exp(-1j * verdict.turned)) / 2
    step = np.where(verdict.jump, expected, steps.moved) * turn[:-1]
    led = (2 * steps.spread_m) ** 2 + (JUMP_SHARE * np.minimum(steps.miss_m, 1.0)) ** 2
    # A camera that turned instantly may have been turned with its map, or not.
    unseen = CAMERA_TURN_SIGMA_RAD if turned_as_camera else np.hypot(UNKNOWN_TURN_RAD, steps.camera_turn)
    jump_turn = np.where(_turn_observed(moves), TURN_SIGMA_RAD, unseen)
    uneven = np.minimum(moves.misfit_m / 1.0, TURN_SIGMA_RAD)
    return _Way(
        step=np.where(verdict.update, verdict.with_map * turn[1:], step),
        jump_m2=np.where(verdict.jump, led, 0.0),
        jump_rad2=np.where(verdict.jump, jump_turn, np.where(verdict.update, uneven, 0.0)) ** 2,
        aside_m2=np.zeros(len(turn)),
    )


def _with_excursions_undone(way: _Way, steps: _Steps, verdict: _Verdict, alone: BoolArray, outages: _Outages) -> _Way:
    """Continue at the place of the later log while the camera jumps ``alone`` (n - 1,) away and back."""
    beyond = (steps.moved - steps.expected) * verdict.frame_turn[:-1]
    undone = way.copy()
    for away, back, missing in find_excursions(beyond, alone, outages.blind | outages.still, np.abs(way.step)):
        span = slice(away, back + 1)
        undone.step[span], undone.aside_m2[away + 1 : back + 2] = returned(missing, undone.step[span])
        undone.jump_m2[span] = np.where(alone[span], steps.spread_m[span] ** 2, undone.jump_m2[span])
        undone.jump_rad2[span] = np.where(alone[span], 0, undone.jump_rad2[span])
    return undone


def _with_losses_walked(way: _Way, dt: FloatArray, losses: list[tuple[int, int]]) -> _Way:
    """Free the steps over each loss, and spread them evenly if the camera was frozen; ``dt`` (n - 1,) s."""
    walked = way.copy()
    for start, stop in losses:
        step, lasting = walked.step[start:stop], dt[start:stop]
        walked.jump_rad2[start:stop] += loss_turn_rad(step, lasting) ** 2 * lasting / lasting.sum()
        walked.step[start:stop], freedom = steps_over_loss(step, lasting)
        walked.jump_m2[start:stop] += freedom
    return walked


def _holes(camera: CameraTrack, frame: IntArray) -> BoolArray:
    """Steps (n - 1,) without any logged frame, even an unusable one, for :data:`HOLE_S`."""
    logged_ns = np.maximum.accumulate(camera.time_ns)
    before = np.flatnonzero(np.diff(logged_ns) > HOLE_S * 1e9)
    step = np.searchsorted(frame, before, side="right") - 1
    hole = np.zeros(len(frame) - 1, dtype=bool)
    hole[step[(step >= 0) & (step < len(hole))]] = True
    return hole


def _loss_events(
    camera: CameraTrack, frame: IntArray, losses: list[tuple[int, int]], raw: ComplexArray
) -> list[TrackerEvent]:
    """Report each loss at its first frame, with its cause and the logged movement (n,) over it, complex metres."""
    found = []
    for start, stop in losses:
        first, last = int(frame[start + 1]), int(frame[stop])
        reason = "" if camera.state is None else camera.state.reason(int(frame[start]), last + 1)
        found.append(TrackerEvent(EventKind.LOSS, first, float(abs(raw[stop] - raw[start])), reason=reason))
    return found


def _events(
    frame: IntArray,
    steps: _Steps,
    moves: MapMoves,
    verdict: _Verdict,
    losses: list[TrackerEvent],
) -> tuple[TrackerEvent, ...]:
    """Report updates, jumps and losses, by frame (n,)."""
    found = [*losses]
    open_jumps: list[complex] = []
    for i in np.flatnonzero(verdict.update | verdict.jump).tolist():
        if verdict.update[i]:
            kind, size = EventKind.MAP_UPDATE, abs(steps.moved[i] - verdict.with_map[i])
        else:
            jump = complex(steps.moved[i] - steps.expected[i])
            kind, size = _kind_of_jump(jump, open_jumps, moves, i), abs(jump)
        if kind is not EventKind.MAP_UPDATE or size >= LEAST_UPDATE_M:
            found.append(TrackerEvent(kind, int(frame[i + 1]), float(size), float(verdict.turned[i])))
    return tuple(sorted(found, key=lambda event: event.frame))


def _kind_of_jump(jump: complex, open_jumps: list[complex], moves: MapMoves, step: int) -> EventKind:
    """Name a jump of the camera; ``open_jumps`` are the breaks that have not been undone."""
    if moves.moved[step]:
        return EventKind.CORRECTION
    undone = next((i for i, other in enumerate(open_jumps) if abs(jump + other) < UNDONE * abs(other)), None)
    if undone is not None:
        del open_jumps[undone]
        return EventKind.RELOCALISATION
    if moves.sighted[step]:
        return EventKind.RELOCALISATION
    open_jumps.append(jump)
    return EventKind.BREAK
