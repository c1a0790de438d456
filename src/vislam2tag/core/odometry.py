"""The tracker's path made continuous: steps that are no motion are taken out and reported.

ARCore promises nothing about the frame in which it reports poses: it may be another one at each frame. A step that is
no motion shows itself: it does not fit the steps about it, or landmarks that nobody looks at move. Where camera and
landmarks move alike the step is measured relative to the landmarks, which loses nothing; otherwise the step is
replaced by what its neighbours predict, and is free to differ from it.

The **continuous frame** equals the ACS at the first usable frame; it is never rewritten, it only drifts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from vislam2tag.core.faults import EventKind, TrackerEvent
from vislam2tag.core.similarity import as_complex
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.visits import usable_rank

NEIGHBOURS = (-3, -2, -1, 1, 2, 3)
"""Steps whose median predicts a step."""
SUSPICIOUS = 5.0
"""A step that misses its prediction by more than this many standard deviations may be no motion in part."""
IMPOSSIBLE = 10.0
"""... and by more than this is none at all."""
LEAST_SPREAD_M = 0.003
"""Predictions of steps are not trusted better than this."""
MOVED_M = 1e-6
"""A landmark whose logged position changed by more than this was seen, or moved with the map."""
IN_VIEW_M = 4.0
"""A landmark that moved farther away than this from the camera was not seen: the tracker rewrote its map."""
FROZEN_S = 0.3
"""A camera pose that stays the same to the last bit for longer is no pose: tracking is lost."""
FASTEST_M_S = 3.0
"""Nobody walks faster: a longer jump over a loss is another map, not the way walked meanwhile."""
WALKING_M_S = 1.0
STANDING_M_S = 0.3
FOUND_SIGMA_M = 0.1
"""How far off a tracker may be that goes on through a loss."""
TURN_SIGMA_RAD = 0.03
"""How well the turn of a jump is known from the landmarks or the camera's orientation."""
UNKNOWN_TURN_RAD = 0.1
"""The turn of a jump where neither says anything."""
LEVER_M = 1.0
"""A sheet's logged heading counts as much as a landmark's position at this distance, for the turn of an update."""


@dataclass(frozen=True)
class Odometry:
    """The camera's path in the continuous frame, ``n`` usable frames.

    ``frame`` (n,) indices into the camera track; ``time_s`` (n,) from the first; ``path`` (n,) complex, metres;
    ``turn`` (n,) complex, unit: ``continuous_R_acs`` of each frame. For the n - 1 steps: ``walked_m``, ``turned_rad``
    (camera, about the vertical), ``jump_m2`` and ``jump_rad2``: variances per axis, beyond the usual drift, of
    steps that are not trusted.
    """

    frame: IntArray
    time_s: FloatArray
    path: ComplexArray
    turn: ComplexArray
    walked_m: FloatArray
    turned_rad: FloatArray
    jump_m2: FloatArray
    jump_rad2: FloatArray
    rewritten: BoolArray
    """(n,) frames at which the tracker rewrote its map: a landmark that moved then was not seen then."""
    jumped: BoolArray
    """(n - 1,) steps over which nothing connects: breaks, corrections, losses."""
    events: tuple[TrackerEvent, ...]


@dataclass(frozen=True)
class _MapMoves:
    """What the landmarks that are not looked at say about each of the n - 1 steps.

    ``moved``: some did; ``turn`` (complex, unit) and ``centre_before``, ``centre_after``: the rigid motion that fits
    best; ``misfit_m``: root mean square distance from it; ``known``: landmarks that tell.
    """

    moved: BoolArray
    turn: ComplexArray
    centre_before: ComplexArray
    centre_after: ComplexArray
    misfit_m: FloatArray
    known: IntArray

    def carry(self, points: ComplexArray) -> ComplexArray:
        """Move points (n - 1,) of before each step along with the map."""
        return np.asarray(self.centre_after + self.turn * (points - self.centre_before))


def continuous_odometry(camera: CameraTrack, log: LandmarkLog) -> Odometry:
    """Take the steps that are no motion out of a camera track with two or more usable frames."""
    frame = np.flatnonzero(camera.usable)
    time_s = (camera.time_ns[frame] - camera.time_ns[frame[0]]) * 1e-9
    raw = as_complex(camera.plane_acs[frame])
    lost, frozen = _lost(camera, log, frame), _frozen(camera, frame, time_s)
    step, dt = np.diff(raw), np.diff(time_s)
    twist = _twist(camera.orientation_acs[frame])
    expected, spread = _predicted(step, dt)
    moves = _map_moves(camera, log, np.abs(step - expected) > SUSPICIOUS * spread)
    with_map = raw[1:] - moves.carry(raw[:-1])
    miss, miss_with_map = np.abs(step - expected), np.abs(with_map - moves.turn * expected)
    idle = ~(frozen[1:] | frozen[:-1])  # a lost
    update = idle & moves.moved & (miss_with_map < np.minimum(miss, IMPOSSIBLE * spread))
    jump = idle & ~update & (miss > np.maximum(IMPOSSIBLE * spread, FASTEST_M_S * dt))
    doubtful = idle & ~update & ~jump
    told = moves.moved & (moves.known > 1)
    turned = np.where(update | (jump & told), np.angle(moves.turn), 0.0)
    turn = np.exp(-1j * np.concatenate(([0.0], np.cumsum(turned))))
    local = np.where(update, with_map * turn[1:], np.where(jump, expected * turn[:-1], step * turn[:-1]))
    excess = np.where(doubtful, np.maximum(miss - SUSPICIOUS * spread, 0.0), 0.0)
    camera_turn = twist - _predicted(twist + 0j, dt)[0].real
    uncertain_turn = np.where(told, TURN_SIGMA_RAD, np.hypot(UNKNOWN_TURN_RAD, camera_turn))
    jump_m2 = excess**2 + np.where(jump, (2 * spread) ** 2 + (0.1 * np.minimum(miss, 1.0)) ** 2, 0.0)
    jump_rad2 = np.where(
        jump, uncertain_turn**2, np.where(update, np.minimum(moves.misfit_m**2, TURN_SIGMA_RAD**2), 0.0)
    )
    events = _events(frame, update, jump, moves, step, with_map, expected, turned)
    losses = _bridge_losses(frame, lost, frozen, time_s, raw, turn, local, jump_m2, jump_rad2)
    return Odometry(
        frame=frame,
        time_s=time_s,
        path=raw[0] + np.concatenate(([0.0], np.cumsum(local))),
        turn=turn,
        walked_m=np.abs(local),
        turned_rad=np.abs(twist),
        jump_m2=jump_m2,
        jump_rad2=jump_rad2,
        rewritten=np.concatenate(([False], moves.moved)),
        jumped=jump | lost[1:] | frozen[1:],
        events=tuple(sorted((*events, *losses), key=lambda event: event.frame)),
    )


def _predicted(step: ComplexArray, dt: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Median rate of the neighbours times the time of each step, and the usual distance from it (robust)."""
    rate = step / dt
    reach = max(NEIGHBOURS)
    padded = np.pad(rate, reach, mode="edge")
    around = np.stack([padded[reach + k : reach + k + len(rate)] for k in NEIGHBOURS])
    expected = (np.median(around.real, axis=0) + 1j * np.median(around.imag, axis=0)) * dt
    miss = np.abs(step - expected)
    moving = miss[miss > 0]
    usual = 1.2 * float(np.median(moving)) / np.sqrt(2) if moving.size else 0.0
    return np.asarray(expected), np.maximum(usual, LEAST_SPREAD_M) * np.maximum(dt / np.median(dt), 1.0)


def _twist(orientation_acs: FloatArray) -> FloatArray:
    """Turn (n - 1,) of the camera about the vertical between neighbouring frames, rad."""
    ax, ay, az, aw = orientation_acs[:-1].T
    bx, by, bz, bw = orientation_acs[1:].T
    y = -bw * ay + by * aw + bx * az - bz * ax
    w = bw * aw + bx * ax + by * ay + bz * az
    return np.asarray((2 * np.arctan2(y, w) + np.pi) % (2 * np.pi) - np.pi)


def _lost(camera: CameraTrack, log: LandmarkLog, frame: IntArray) -> BoolArray:
    """Mask (n,) of the usable frames in which the landmarks are at the camera."""
    at_camera = np.zeros(len(camera.time_ns), dtype=bool)
    at_camera[log.frame[log.lost]] = True
    silent = np.ones(len(camera.time_ns), dtype=bool)
    silent[log.frame] = False
    silent[: log.frame.min(initial=len(silent))] = False
    return at_camera[frame] | silent[frame]


def _frozen(camera: CameraTrack, frame: IntArray, time_s: FloatArray) -> BoolArray:
    """Mask (n,) of the usable frames in which the camera's position stays the same for long: nothing is tracked."""
    position = camera.position_acs[frame]
    same = np.concatenate(([False], np.all(position[1:] == position[:-1], axis=1), [False]))
    frozen = np.zeros(len(frame), dtype=bool)
    for first, after in _runs(same[1:]):
        start, stop = first, min(after, len(frame) - 1)
        if time_s[stop] - time_s[start] > FROZEN_S:
            frozen[start : stop + 1] = True
    return frozen


def _map_moves(camera: CameraTrack, log: LandmarkLog, suspicious: BoolArray) -> _MapMoves:
    """See which landmarks moved in each step, and fit the rigid motion that they made together."""
    rank = usable_rank(camera)
    count = max(int(camera.usable.sum()) - 1, 0)
    held = np.flatnonzero(~log.lost)
    plane = as_complex(log.plane_acs)
    heading = sheet_heading(log.orientation_acs)
    pair = held[1:][(log.landmark[held[1:]] == log.landmark[held[:-1]])]
    before = held[:-1][(log.landmark[held[1:]] == log.landmark[held[:-1]])]
    step = rank[log.frame[pair]] - 1
    shift = np.abs(plane[pair] - plane[before])
    eye = as_complex(camera.plane_acs)
    away = np.minimum(np.abs(eye[log.frame[pair]] - plane[pair]), np.abs(eye[log.frame[before]] - plane[before]))
    changed = shift > MOVED_M
    known, all_changed, far_changed = (
        np.bincount(step, which, count) for which in (np.ones(len(step)), changed, changed & (away > IN_VIEW_M))
    )
    several = (far_changed >= 2) & (2 * far_changed >= known)
    moved = np.asarray(several | (suspicious & (known > 0) & (all_changed == known)))
    tells = moved[step] & changed
    step, pair, before = step[tells], pair[tells], before[tells]
    number = np.bincount(step, minlength=count)
    share = np.maximum(number, 1)
    centre_before, centre_after = (_sum(step, plane[rows], count) / share for rows in (before, pair))
    arms = (plane[pair] - centre_after[step]) * (plane[before] - centre_before[step]).conj()
    sheets = LEVER_M**2 * heading[pair] * heading[before].conj()
    turn = _unit(_sum(step, arms + sheets, count))
    miss = plane[pair] - centre_after[step] - turn[step] * (plane[before] - centre_before[step])
    misfit = np.sqrt(np.bincount(step, np.abs(miss) ** 2, count) / share)
    return _MapMoves(moved, turn, centre_before, centre_after, misfit, number)


def sheet_heading(orientation_acs: FloatArray) -> ComplexArray:
    """Horizontal direction (k,) of the logged sheets' X axis in the ACS plane, complex and as long as it is level."""
    x, y, z, w = orientation_acs.T
    return np.asarray(1 - 2 * (y * y + z * z) - 2j * (x * z - y * w))


def _sum(step: IntArray, values: ComplexArray, count: int) -> ComplexArray:
    return np.asarray(np.bincount(step, values.real, count) + 1j * np.bincount(step, values.imag, count))


def _unit(values: ComplexArray) -> ComplexArray:
    length = np.abs(values)
    return np.asarray(np.where(length > 0, values / np.maximum(length, 1e-300), 1.0))


def _events(
    frame: IntArray,
    update: BoolArray,
    jump: BoolArray,
    moves: _MapMoves,
    step: ComplexArray,
    with_map: ComplexArray,
    expected: ComplexArray,
    turned: FloatArray,
) -> list[TrackerEvent]:
    found = []
    for i in np.flatnonzero(update | jump).tolist():
        kind = EventKind.MAP_UPDATE if update[i] else EventKind.CORRECTION if moves.moved[i] else EventKind.BREAK
        size = abs(step[i] - with_map[i]) if update[i] else abs(step[i] - expected[i])
        found.append(TrackerEvent(kind, int(frame[i + 1]), float(size), float(turned[i])))
    return found


def _bridge_losses(
    frame: IntArray,
    lost: BoolArray,
    frozen: BoolArray,
    time_s: FloatArray,
    raw: ComplexArray,
    turn: ComplexArray,
    local: ComplexArray,
    jump_m2: FloatArray,
    jump_rad2: FloatArray,
) -> list[TrackerEvent]:
    """Free the way through each loss; a frozen camera's is spread evenly, as far as the tracker says that it moved."""
    events = []
    for first, after in _runs(lost | frozen):
        start, stop = max(first - 1, 0), min(after, len(lost) - 1)
        if stop == start:
            continue
        span = slice(start, stop)
        dt = np.diff(time_s[start : stop + 1])
        duration = float(dt.sum())
        claimed = complex(raw[stop] - raw[start])
        freedom = FOUND_SIGMA_M**2
        if np.abs(np.diff(raw[start:after])).sum() < STANDING_M_S * duration:
            kept = claimed if abs(claimed) < FASTEST_M_S * (duration + 1) else 0j
            local[span] = kept * turn[start] * dt / duration
            freedom = (0.5 * WALKING_M_S * duration) ** 2
        jump_m2[span] += freedom * dt / duration
        jump_rad2[span] += TURN_SIGMA_RAD**2 * dt / duration
        events.append(TrackerEvent(EventKind.LOSS, int(frame[first]), abs(claimed)))
    return events


def _runs(mask: BoolArray) -> list[tuple[int, int]]:
    """Start (included) and stop (excluded) of each run of true entries."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], mask, [False])).astype(np.int8))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))
