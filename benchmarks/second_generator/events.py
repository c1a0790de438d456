"""What happens to the tracker, and when."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

import numpy as np

from second_generator.habits import Habits
from second_generator.odometry import Stretch


class Kind(Enum):
    """Kinds of events."""

    UPDATE = auto()
    CORRECTION = auto()
    BREAK = auto()
    KIDNAP = auto()
    RECOVERY = auto()
    """The end of a kidnap."""


@dataclass(frozen=True)
class Event:
    """Something that happens just before a frame."""

    frame: int
    kind: Kind


def draw_events(frames: int, lost: list[Stretch], habits: Habits, rng: np.random.Generator) -> list[Event]:
    """Draw the events of a walk in their order, anywhere but that some losses end in a break."""
    rates = {
        Kind.UPDATE: habits.updates.per_min,
        Kind.CORRECTION: habits.corrections.per_min,
        Kind.BREAK: habits.breaks_per_min,
    }
    events = [Event(frame, kind) for kind, per_min in rates.items() for frame in _frames(frames, per_min, habits, rng)]
    events += [Event(stop, Kind.BREAK) for _, stop in lost if rng.random() < habits.losses.ends_in_break]
    return sorted(events + _kidnaps(frames, habits, rng), key=lambda event: event.frame)


def _frames(frames: int, per_min: float, habits: Habits, rng: np.random.Generator) -> list[int]:
    minutes = frames / habits.gait.rate_hz / 60
    return sorted(rng.integers(2, max(frames - 2, 3), rng.poisson(per_min * minutes)).tolist())


def _kidnaps(frames: int, habits: Habits, rng: np.random.Generator) -> list[Event]:
    """Kidnaps; those that time ends do not overlap."""
    starts = _frames(frames, habits.kidnaps.per_min, habits, rng)
    if habits.kidnaps.end != "time":
        return [Event(start, Kind.KIDNAP) for start in starts]
    events: list[Event] = []
    for start in starts:
        if not events or start > events[-1].frame:
            end = start + int(rng.uniform(5, 25) * habits.gait.rate_hz)
            events += [Event(start, Kind.KIDNAP), Event(end, Kind.RECOVERY)]
    return [event for event in events if event.frame < frames]
