"""What goes wrong with a tracker on one walk, and how badly: planned from the session's rank among all."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import BoolArray, IntArray
from vislam2tag.simulation.odometry import RUNNING_M_S, Frames
from vislam2tag.simulation.settings import TrackerSettings

FAULTY_SHARE = 0.5
"""Share of the sessions with a fault at severity 1."""
REEXPRESSED = 0.5
"""From this badness on the tracker re-expresses its whole map far away once (a quarter of the sessions)."""
COMES_BACK = 0.5
"""From this rank among the re-expressed sessions on the tracker later joins the new map to the old one."""
ONE_RUN_S = 15.0
"""Speeding up again within this time belongs to the same run."""
NOMINAL_S = 180.0
"""Numbers of faults are for a walk of this duration; longer walks see more."""


@dataclass(frozen=True)
class Break:
    """The camera jumps by ``jump`` (complex metres, BCS axes) and turns; it may jump back at frame ``back``."""

    frame: int
    jump: complex
    turn_rad: float
    back: int | None


@dataclass(frozen=True)
class MapUpdate:
    """Camera and landmarks are re-expressed together: turned and scaled about the camera, then shifted (complex).

    Frame ``until`` is again in the frame of before; None where the update lasts.
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
    breaks: tuple[Break, ...]
    updates: tuple[MapUpdate, ...]

    def lost_frames(self, count: int) -> BoolArray:
        """Mask (count,) of the frames without tracking."""
        frame = np.arange(count)[:, None]
        inside = (frame >= self.lost[:, 0]) & (frame < self.lost[:, 1])
        return np.asarray(inside.any(axis=1))

    def postponed(self, busy: BoolArray) -> FaultPlan:
        """Put off jumps to the next frame that is not ``busy`` (f,): what is in view then holds the tracker."""
        free = np.flatnonzero(np.append(~busy, True))

        def later(frame: int) -> int:
            return int(free[np.searchsorted(free, frame)])

        count = len(busy)
        breaks = [replace(b, frame=later(b.frame), back=None if b.back is None else later(b.back)) for b in self.breaks]
        updates = [replace(u, frame=later(u.frame), until=u.until and later(u.until)) for u in self.updates]
        return FaultPlan(
            self.lost,
            tuple(b for b in breaks if b.frame < count - 1),
            tuple(u for u in updates if u.frame < count - 1),
        )


def badness_of(quantile: float, severity: float) -> float:
    """How badly a session of this rank is tracked, 0 to 1: nothing happens to the better half at severity 1."""
    share = min(1.0, FAULTY_SHARE * severity)
    return 0.0 if share == 0 else max(0.0, 1 - (1 - quantile) / share)


def plan_faults(frames: Frames, settings: TrackerSettings, quantile: float, rng: np.random.Generator) -> FaultPlan:
    """Draw the faults of one walk; people in the view and running say where they happen."""
    badness = badness_of(quantile, settings.severity)
    count = len(frames.plane)
    longer = count / settings.frame_rate_hz / NOMINAL_S
    updates = _small_updates(count, settings, rng)
    if badness == 0:
        return FaultPlan(np.empty((0, 2), dtype=np.int64), (), tuple(updates))
    if badness > REEXPRESSED and settings.reexpression_m[1] > 0:
        updates.append(_reexpression(count, (badness - REEXPRESSED) / (1 - REEXPRESSED), settings, rng))
    runs = _lost_runs(frames, max(1, round((1 + 1.5 * badness) * longer)), settings, rng)
    breaks = _breaks(frames, round((2.0 * badness + 10.0 * badness**8) * longer), badness, settings, rng)
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


def _reexpression(count: int, rank: float, settings: TrackerSettings, rng: np.random.Generator) -> MapUpdate:
    """A new origin and heading, tens of metres away; the higher the rank, the farther.

    The tracker has begun a new map. In the upper half of ranks it joins it to the old one later and comes back, so
    that the landmarks' medians stay in the old frame and a part of the walk lies far off it.
    """
    distance = settings.severity * float(np.interp(rank**2, (0, 1), settings.reexpression_m))
    away = np.exp(1j * rng.uniform(0.3, 1.2) * rng.choice((-1.0, 1.0)))
    shift = distance * np.exp(1j * rng.uniform(-np.pi, np.pi))
    frame = int(count * rng.uniform(0.4, 0.5))
    joined = frame + int(count * rng.uniform(0.2, 0.24))
    return MapUpdate(frame, complex(away), complex(shift), joined if rank >= COMES_BACK else None)


def _lost_runs(frames: Frames, number: int, settings: TrackerSettings, rng: np.random.Generator) -> IntArray:
    """Runs without tracking (l, 2), a few seconds each, where somebody blocks the view if anybody does."""
    start = _spread(len(frames.plane), number, rng)
    entries = np.flatnonzero(np.diff(frames.blocked.astype(np.int8)) == 1)[:number]
    start[: len(entries)] = entries + 1
    start = np.sort(start)
    length = rng.uniform(1.5, 4.0, len(start)) * min(settings.severity, 3.0) * settings.frame_rate_hz
    return np.column_stack((start, np.minimum(start + length.astype(np.int64), len(frames.plane) - 1)))


def _breaks(
    frames: Frames, number: int, badness: float, settings: TrackerSettings, rng: np.random.Generator
) -> tuple[Break, ...]:
    """Jumps of the camera alone, metres away to a side; most are taken back. Every run causes one."""
    running = frames.speed > RUNNING_M_S
    starts = np.flatnonzero(np.diff(running.astype(np.int8)) == 1)
    starts = starts[np.diff(starts, prepend=-np.inf) > ONE_RUN_S * settings.frame_rate_hz]
    count = len(running)
    others = _spread(count, max(number - len(starts), 0), rng)
    breaks = []
    for frame in np.sort(np.concatenate((starts + int(settings.frame_rate_hz), others)).clip(1, count - 2)).tolist():
        size = settings.severity * float(np.interp(badness, (0, 1), settings.break_m)) * rng.uniform(0.85, 1.15)
        ahead = frames.looking[frame, 0] + 1j * frames.looking[frame, 1]
        aside = np.exp(1j * (rng.choice((-1.0, 1.0)) * np.pi / 2 + rng.uniform(-0.6, 0.6)))
        back = frame + int(rng.uniform(3.0, 9.0) * settings.frame_rate_hz)
        returns = rng.random() < 0.85 and back < count - 1
        jump = complex(size * ahead / abs(ahead) * aside)
        breaks.append(Break(frame, jump, float(rng.normal(0, 0.1)), back if returns else None))
    return tuple(breaks)


def _spread(count: int, number: int, rng: np.random.Generator) -> IntArray:
    """Frames (number,) evenly spread over the middle of ``count``, in order."""
    share = (np.arange(number) + rng.uniform(0.1, 0.9, number)) / max(number, 1)
    return ((0.15 + 0.75 * share) * count).astype(np.int64)
