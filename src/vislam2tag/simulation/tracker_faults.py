"""Faults of a tracker on one walk, planned from the session's rank among all.

Stairs and lifts add more faults.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.simulation.model import TrueWalk
from vislam2tag.simulation.settings import TrackerSettings
from vislam2tag.simulation.tracker_camera import RUNNING_M_S, CameraFrames

FAULTY_SHARE = 0.5
"""Share of the sessions with a fault at severity 1."""
REEXPRESSED = 0.5
"""From this level on the tracker re-expresses its whole map far away once (a quarter of the sessions)."""
COMES_BACK = 0.5
"""From this rank among the re-expressed sessions on the tracker later joins the new map to the old one."""
ONE_RUN_S = 15.0
"""Speeding up again within this time belongs to the same run."""
NOMINAL_S = 180.0
"""Duration for which numbers of faults are given; longer walks have more."""


@dataclass(frozen=True)
class CameraJump:
    """The camera jumps by ``jump`` (complex metres, BCS axes) and turns; it jumps back at frame ``back``."""

    frame: int
    jump: complex
    turn_rad: float
    back: int


@dataclass(frozen=True)
class MapUpdate:
    """Camera and landmarks are re-expressed together: turned and scaled about the camera, then shifted.

    ``factor`` and ``shift`` (metres, BCS axes) are complex. Frame ``until`` is again in the earlier frame; None if the
    update is permanent.
    """

    frame: int
    factor: complex
    shift: complex
    until: int | None = None


@dataclass(frozen=True)
class FaultPlan:
    """All planned faults of one walk."""

    lost: IntArray
    """(l, 2) runs of frames without tracking."""
    breaks: tuple[CameraJump, ...]
    updates: tuple[MapUpdate, ...]

    def lost_frames(self, count: int) -> BoolArray:
        """Mask (count,) of the frames without tracking."""
        frame = np.arange(count)[:, None]
        inside = (frame >= self.lost[:, 0]) & (frame < self.lost[:, 1])
        return np.asarray(inside.any(axis=1))

    def postponed(self, busy: BoolArray) -> FaultPlan:
        """Move jumps to the next frame that is not ``busy`` (f,); a break ends when the next busy stretch begins.

        Frames with a sheet in view are busy, because the sheet stabilises or relocalises the tracker.
        """
        count = len(busy)
        free, taken = np.flatnonzero(np.append(~busy, True)), np.flatnonzero(np.append(busy, True))

        def later(frame: int) -> int:
            return int(free[np.searchsorted(free, frame)])

        starts = [later(b.frame) for b in self.breaks]
        ends = [int(taken[np.searchsorted(taken, start)]) for start in starts]
        breaks = [
            replace(b, frame=start, back=min(start + b.back - b.frame, end))
            for b, start, end in zip(self.breaks, starts, ends, strict=True)
        ]
        updates = [replace(u, frame=later(u.frame), until=u.until and later(u.until)) for u in self.updates]
        return FaultPlan(
            self.lost,
            tuple(b for b in breaks if b.frame < count - 1),
            tuple(u for u in updates if u.frame < count - 1),
        )


def fault_level(quantile: float, severity: float) -> float:
    """Fault level of a session of this rank, 0 to 1; the better half has no faults at severity 1."""
    share = min(1.0, FAULTY_SHARE * severity)
    return 0.0 if share == 0 else max(0.0, 1 - (1 - quantile) / share)


def plan_faults(
    frames: CameraFrames, settings: TrackerSettings, quantile: float, rng: np.random.Generator
) -> FaultPlan:
    """Draw the faults of one walk; people in view and running determine when they occur."""
    badness = fault_level(quantile, settings.severity)
    count = len(frames.plane)
    longer = count / settings.frame_rate_hz / NOMINAL_S
    updates = _small_updates(count, settings, rng)
    if badness == 0:
        return FaultPlan(np.empty((0, 2), dtype=np.int64), (), tuple(updates))
    if badness > REEXPRESSED and settings.reexpression_m[1] > 0:
        updates.append(_reexpression(frames, (badness - REEXPRESSED) / (1 - REEXPRESSED), settings, rng))
    runs = _lost_runs(frames, max(1, round((1 + 1.5 * badness) * longer)), settings, rng)
    breaks = _breaks(frames, round((2.0 * badness + 15.0 * badness**8) * longer), badness, settings, rng)
    return FaultPlan(runs, breaks, tuple(sorted(updates, key=lambda update: update.frame)))


def _small_updates(count: int, settings: TrackerSettings, rng: np.random.Generator) -> list[MapUpdate]:
    """Frequent harmless re-expressions: centimetres, a degree or so."""
    minutes = count / settings.frame_rate_hz / 60
    number = int(rng.poisson(settings.map_updates_per_minute * minutes * min(settings.severity, 1.0)))
    at = np.sort(rng.integers(1, count, number)).tolist()
    turn = rng.normal(0, 0.003, number) * settings.severity
    shift = rng.normal(0, 0.05, (2, number)) * settings.severity
    scale = 1 + rng.normal(0, 0.002, number) * settings.severity
    factors = scale * np.exp(1j * turn)
    return [MapUpdate(at[i], complex(factors[i]), complex(*shift[:, i])) for i in range(number)]


def _reexpression(frames: CameraFrames, rank: float, settings: TrackerSettings, rng: np.random.Generator) -> MapUpdate:
    """Draw a new origin and heading, tens of metres away; higher ranks get larger distances.

    The tracker has begun a new map. In the upper half of ranks it later joins this map to the old one and returns.
    The landmarks' medians then stay in the old frame, and part of the walk is far from it.
    """
    count = len(frames.plane)
    distance = settings.severity * float(np.interp(rank**2, (0, 1), settings.reexpression_m))
    frame = int(count * rng.uniform(0.4, 0.5))
    # Away from the walk's middle, so that the size of the errors does not depend on the orientation of the building; a
    # small shift goes forward, because it cannot bring two landmarks together there.
    lasts = rank < COMES_BACK
    aside = _ahead(frames, frame) if lasts else frames.plane[frame] - frames.plane.mean()
    shift = distance * aside / max(abs(aside), 1e-3)
    away = np.exp(1j * rng.uniform(0.3, 0.9) * rng.choice((-1.0, 1.0)))
    joined = frame + int(count * rng.uniform(0.2, 0.22))
    return MapUpdate(frame, complex(away), complex(shift), None if lasts else joined)


def _lost_runs(frames: CameraFrames, number: int, settings: TrackerSettings, rng: np.random.Generator) -> IntArray:
    """Runs without tracking (l, 2), a few seconds each, at times when someone blocks the view, if possible."""
    start = _spread(len(frames.plane), number, rng)
    entries = np.flatnonzero(np.diff(frames.blocked.astype(np.int8)) == 1)[:number]
    start[: len(entries)] = entries + 1
    start = np.sort(start)
    length = rng.uniform(1.5, 4.0, len(start)) * min(settings.severity, 3.0) * settings.frame_rate_hz
    return np.column_stack((start, np.minimum(start + length.astype(np.int64), len(frames.plane) - 1)))


def _breaks(
    frames: CameraFrames, number: int, badness: float, settings: TrackerSettings, rng: np.random.Generator
) -> tuple[CameraJump, ...]:
    """Sideways jumps of the camera alone by some metres, and back after some seconds. Every run causes one."""
    running = frames.speed > RUNNING_M_S
    starts = np.flatnonzero(np.diff(running.astype(np.int8)) == 1)
    starts = starts[np.diff(starts, prepend=-np.inf) > ONE_RUN_S * settings.frame_rate_hz]
    count = len(running)
    others = _spread(count, max(number - len(starts), 0), rng)
    breaks = []
    for frame in np.sort(np.concatenate((starts + int(settings.frame_rate_hz), others)).clip(1, count - 2)).tolist():
        size = settings.severity * float(np.interp(badness, (0, 1), settings.break_m)) * rng.uniform(0.85, 1.15)
        ahead = _ahead(frames, frame)
        aside = np.exp(1j * (rng.choice((-1.0, 1.0)) * np.pi / 2 + rng.uniform(-0.6, 0.6)))
        back = frame + int(rng.uniform(3.0, 8.0) * settings.frame_rate_hz)
        jump = complex(size * ahead / abs(ahead) * aside)
        breaks.append(CameraJump(frame, jump, float(rng.normal(0, 0.1)), back))
    return tuple(breaks)


def _ahead(frames: CameraFrames, frame: int) -> complex:
    """Horizontal direction in which the camera looks (BCS axes, not of unit length)."""
    return complex(frames.looking[frame, 0], frames.looking[frame, 1])


def _spread(count: int, number: int, rng: np.random.Generator) -> IntArray:
    """Frames (number,) evenly spread over the middle of ``count``, in order."""
    share = (np.arange(number) + rng.uniform(0.1, 0.9, number)) / max(number, 1)
    return ((0.15 + 0.75 * share) * count).astype(np.int64)


LOST_SHARE = 0.7
"""Share of the rides after which tracking is lost when the doors open; the camera jumps after the others."""
AFTER_RIDE_S = (0.5, 3.0)
"""Duration of the tracking loss after a ride."""
JUMP_M = 3.0
"""Camera jump, per axis, if tracking is not lost; it is reversed after some seconds."""
JUMP_BACK_S = (3.0, 8.0)
CLIMBED_SIGMA = 0.02
"""Relative error of the height climbed on one walk."""
UPDATE_M, BREAK_M, FOUND_M = 0.08, 1.0, 0.1
"""Vertical steps at map updates (camera and landmarks together), breaks, and when tracking is found again."""


def with_rides(
    faults: FaultPlan, walk: TrueWalk, frames: CameraFrames, settings: TrackerSettings, rng: np.random.Generator
) -> FaultPlan:
    """Add faults at the end of lift rides: tracking is lost, or the camera jumps."""
    if settings.severity == 0:
        return faults
    lost, breaks, last = [faults.lost], list(faults.breaks), len(frames.plane) - 1
    for end_ns in walk.rides_ns[:, 1]:
        start = int(np.searchsorted(frames.exposure_ns, end_ns))
        if start >= last:
            continue
        if rng.random() < LOST_SHARE:
            stop = start + round(float(rng.uniform(*AFTER_RIDE_S)) * settings.frame_rate_hz)
            lost.append(np.array([[start, min(stop, last)]]))
        else:
            jump = complex(*rng.normal(0, settings.severity * JUMP_M, 2))
            back = start + int(rng.uniform(*JUMP_BACK_S) * settings.frame_rate_hz)
            breaks.append(CameraJump(start, jump, float(rng.normal(0, 0.1)), back))
    runs = np.vstack(lost)
    ordered = tuple(sorted(breaks, key=lambda fault: fault.frame))
    return replace(faults, lost=runs[np.argsort(runs[:, 0], kind="stable")], breaks=ordered)


def vertical_errors(
    faults: FaultPlan, frames: CameraFrames, settings: TrackerSettings, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Draw the vertical part of a walk's faults, and the error of the height climbed.

    Returns additions to heights at each frame (f,), metres: to the camera and what it sees then, and to everything.
    """
    count, severity = len(frames.plane), settings.severity
    seen = frames.height - frames.unseen
    camera = severity * CLIMBED_SIGMA * float(rng.standard_normal()) * (seen - seen[0])
    for fault in faults.breaks:
        camera[fault.frame : fault.back] += severity * BREAK_M * rng.standard_normal()
    for found in faults.lost[:, 1].tolist():
        camera[found:] += severity * FOUND_M * rng.standard_normal()
    together = np.zeros(count)
    for update in faults.updates:
        together[update.frame : update.until] += severity * UPDATE_M * rng.standard_normal()
    return camera, together
