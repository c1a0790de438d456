"""What happened on a walk: standing, turns in place, stairs and rides in lifts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray, runs_of
from vislam2tag.core.faults import EventKind
from vislam2tag.estimation.dead_reckoning.settings import DeadReckoningSettings
from vislam2tag.estimation.dead_reckoning.walk import SensedWalk

TURN_RAD = np.pi / 3
"""Who turns by more without a step turns in place."""
CLIMB_M_S = 0.15
CLIMB_M = 1.5
"""Air pressure must tell of this much rise at once; less may be doors and ventilation."""
CLIMB_WINDOW_S = 4.0


@dataclass(frozen=True)
class Happening:
    """Something that lasted from ``start_s`` to ``end_s`` of a walk; ``size_m`` is the rise, ``turn_rad`` the turn."""

    kind: EventKind
    start_s: float
    end_s: float
    size_m: float
    turn_rad: float


def happenings(walk: SensedWalk, altitude_m: FloatArray | None, settings: DeadReckoningSettings) -> list[Happening]:
    """List what happened on a walk, in order of time; ``altitude_m`` (m,) is that at its windows, by air pressure."""
    time_s, standing = walk.features.time_s, walk.features.moving < 0.5
    turned = np.interp(time_s, walk.signals.time_s, walk.headings.turned_rad)
    found = []
    climbing = np.zeros(len(time_s), dtype=bool)
    if altitude_m is not None:
        ends = [np.interp(time_s + side * CLIMB_WINDOW_S / 2, time_s, altitude_m) for side in (-1, 1)]
        climbing = np.abs(ends[1] - ends[0]) > CLIMB_M_S * CLIMB_WINDOW_S
        for first, stop in runs_of(climbing):
            last = stop - 1
            rise = float(altitude_m[last] - altitude_m[first])
            if abs(rise) >= CLIMB_M:
                kind = EventKind.LIFT if standing[first:stop].mean() > 0.5 else EventKind.STAIRS
                found.append(Happening(kind, float(time_s[first]), float(time_s[last]), abs(rise), float("nan")))
    for first, stop in runs_of(standing & ~climbing):
        last = stop - 1
        lasted, turn = float(time_s[last] - time_s[first]), float(turned[last] - turned[first])
        if abs(turn) > TURN_RAD:
            found.append(Happening(EventKind.TURN, float(time_s[first]), float(time_s[last]), 0.0, turn))
        elif lasted >= settings.standing_s:
            found.append(Happening(EventKind.STANDING, float(time_s[first]), float(time_s[last]), 0.0, turn))
    return sorted(found, key=lambda each: each.start_s)
