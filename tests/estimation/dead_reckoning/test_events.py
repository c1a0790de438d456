"""Standing, turns in place, stairs and lifts."""

from __future__ import annotations

import numpy as np

from tests.estimation.dead_reckoning.walks import START_NS, G
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import InertialLog
from vislam2tag.core.faults import EventKind
from vislam2tag.estimation.dead_reckoning.walk import Happening, SensedWalk, happenings
from vislam2tag.estimation.settings import DeadReckoningSettings

TIME_S = np.arange(0.0, 40.0, 0.02)


def found(
    walking: FloatArray, turn_rate: FloatArray | float = 0.0, rise_m: FloatArray | None = None
) -> list[Happening]:
    """Events of a walk with steps where ``walking`` (n,) is 1, turning at a rate (n,), rad/s, rising by ``rise_m``."""
    steps = walking * np.sin(2 * np.pi * 1.8 * TIME_S)
    force = np.column_stack((0.5 * steps, 0.5 * steps, G + 3 * steps))
    rate = np.column_stack((0 * TIME_S, 0 * TIME_S, turn_rate + 0 * TIME_S))
    time_ns = START_NS + (TIME_S * 1e9).astype(np.int64)
    none = np.empty(0, dtype=np.int64)
    walk = SensedWalk.of(InertialLog(time_ns, force, time_ns, rate, none, np.empty((0, 4))))
    assert walk is not None
    altitude = None if rise_m is None else np.interp(walk.features.time_s, TIME_S, rise_m)
    return happenings(walk, altitude, DeadReckoningSettings())


def between(start_s: float, end_s: float) -> FloatArray:
    return np.asarray(((start_s <= TIME_S) & (end_s > TIME_S)) * 1.0)


def test_a_walk_without_a_stop_has_no_event() -> None:
    assert found(np.ones_like(TIME_S)) == []


def test_standing_is_told_with_its_time() -> None:
    (standing,) = found(1 - between(10, 20))
    assert standing.kind is EventKind.STANDING
    assert abs(standing.start_s - 10) < 1.2
    assert abs(standing.end_s - 20) < 1.2


def test_a_turn_in_place_is_told_with_its_angle() -> None:
    (turn,) = found(1 - between(10, 16), turn_rate=between(12, 14) * np.pi / 2)
    assert turn.kind is EventKind.TURN
    assert abs(turn.turn_rad - np.pi) < 0.1


def test_air_pressure_tells_stairs_from_a_lift() -> None:
    rise = 4.0 * np.clip((TIME_S - 15) / 10, 0, 1)
    (stairs,) = found(np.ones_like(TIME_S), rise_m=rise)
    assert (stairs.kind, round(stairs.size_m)) == (EventKind.STAIRS, 4)
    kinds = {each.kind for each in found(1 - between(13, 27), rise_m=rise)}
    assert EventKind.LIFT in kinds
    assert EventKind.STAIRS not in kinds
