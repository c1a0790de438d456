"""From inertial readings and a few fixes to a path: made walks, however the phone is carried.

Standing, turns in place, stairs and lifts.

Fixes that cannot be right together contradict each other; true ones never do, however few.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from training import swung, train

from tests.estimation.dead_reckoning.walks import START_NS, G, corners, simulated, true_fixes, walked
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import FixLog, InertialLog
from vislam2tag.core.status import EventKind
from vislam2tag.estimation.dead_reckoning.gait import SpeedModel, speed_model
from vislam2tag.estimation.dead_reckoning.walk import (
    Happening,
    LeftOut,
    ReckonedWalk,
    SensedWalk,
    contradictions_m,
    happenings,
)
from vislam2tag.estimation.settings import DeadReckoningSettings

SETTINGS = DeadReckoningSettings()
WAY = corners((20, 0), (0, 15), (-10, 0), (0, -15), (5, 0), (0, 10))
FLAT = Rotation.identity()
UPRIGHT = Rotation.from_euler("x", 80, degrees=True)
POCKET = Rotation.from_euler("zx", (90, 70), degrees=True)


def sensed(log: InertialLog) -> SensedWalk:
    found = SensedWalk.of(log)
    assert found is not None
    return found


def some(fixes: FixLog, *wanted: int) -> FixLog:
    rows = list(wanted)
    return FixLog(fixes.time_ns[rows], fixes.position_bcs[rows], tuple(fixes.name[row] for row in rows))


def path(log: InertialLog, fixes: FixLog, *wanted: int) -> ReckonedWalk:
    return sensed(log).path(some(fixes, *wanted), speed_model(), SETTINGS)


def errors_m(walk: ReckonedWalk, fixes: FixLog) -> FloatArray:
    at_s = np.asarray((fixes.time_ns - walk.sensed.signals.start_ns) * 1e-9, dtype=np.float64)
    return np.asarray(np.linalg.norm(walk.at(at_s)[0] - fixes.position_bcs, axis=1))


@pytest.mark.parametrize("rate_hz", [20.0, 50.0, 200.0])
@pytest.mark.parametrize("hold", [FLAT, UPRIGHT, POCKET], ids=["flat", "upright", "pocket"])
def test_two_fixes_find_the_way_at_any_rate_and_carried_in_any_way(rate_hz: float, hold: Rotation) -> None:
    log, fixes = walked(WAY, rate_hz=rate_hz, hold=hold, noise=0.05)
    walk = path(log, fixes, 0, 6)
    assert walk.path.unreached_m == 0
    assert errors_m(walk, fixes).max() < 1.6


def test_without_a_heading_of_its_own_the_fixes_turn_the_path() -> None:
    log, fixes = walked(WAY)
    none = replace(log, orientation_ns=log.orientation_ns[:0], orientation=log.orientation[:0])
    assert errors_m(path(none, fixes, 0, 6), fixes).max() < 1.6


def test_a_walk_that_ends_where_it_began_is_turned_by_the_phones_own_heading() -> None:
    way = corners((20, 0), (0, 15), (-20, 0), (0, -15))
    log, fixes = walked(way)
    assert errors_m(path(log, fixes, 0, 4), fixes).max() < 1.6


@pytest.mark.slow
@given(turn=st.floats(-3, 3), x=st.floats(-500, 500), y=st.floats(-500, 500))
def test_a_building_turned_and_moved_gives_the_same_walk_turned_and_moved(turn: float, x: float, y: float) -> None:
    log, fixes = walked(WAY)
    log = replace(log, orientation_ns=log.orientation_ns[:0], orientation=log.orientation[:0])
    rotation = np.array(((np.cos(turn), -np.sin(turn)), (np.sin(turn), np.cos(turn))))
    moved = replace(fixes, position_bcs=fixes.position_bcs @ rotation.T + (x, y))
    before, after = path(log, fixes, 0, 2, 6), path(log, moved, 0, 2, 6)
    assert after.positions == pytest.approx(before.positions @ rotation.T + (x, y), abs=0.02)
    spread = rotation @ before.path.covariance[:, :2, :2] @ rotation.T
    assert after.path.covariance[:, :2, :2] == pytest.approx(spread, rel=0.02, abs=1e-3)


def test_sigma_grows_away_from_fixes_and_in_gaps() -> None:
    log, fixes = walked(WAY)
    walk = path(log, fixes, 0, 2, 6)
    at_fix, between = walk.at(np.array((walk.nodes.time_s[walk.fixes.node[1]], 50.0)))[1]
    assert np.trace(between) > 2 * np.trace(at_fix)
    at_s = (log.force_ns - log.force_ns[0]) * 1e-9
    heard = (at_s < 48) | (at_s > 52)
    holed = replace(log, force_ns=log.force_ns[heard], force=log.force[heard])
    in_gap = path(holed, fixes, 0, 2, 6).at(np.array((50.0,)))[1][0]
    assert np.trace(in_gap) > np.trace(between)


def test_a_walk_knows_when_its_phone_swings() -> None:
    log, fixes = walked(WAY)
    held, swinging = (path(each, fixes, 0, 2, 6).nodes.swinging for each in (log, swung(log)))
    assert held.mean() < 0.4
    assert swinging.mean() > 0.8


def test_a_fix_in_the_wrong_place_is_found_and_hardly_followed() -> None:
    way = corners((8, 0), (0, 8), (8, 0), (0, 8), (8, 0), (0, 8), (8, 0))
    log, fixes = walked(way)
    wrong = fixes.position_bcs.copy()
    wrong[3] += (-9.0, 4.0)
    walk = path(log, replace(fixes, position_bcs=wrong), *range(8))
    left_out = LeftOut.of(walk)
    assert np.flatnonzero(left_out.doubtful).tolist() == [3]
    assert np.linalg.norm(left_out.error_m[3]) == pytest.approx(np.hypot(9, 4), rel=0.2)
    assert np.delete(errors_m(walk, fixes), 3).max() < 0.8
    assert not LeftOut.of(path(log, fixes, *range(8))).doubtful.any()


def test_speed_is_learned_from_walks_with_taps() -> None:
    ways = [(speed, walked(WAY, speed_m_s=speed, noise=0.05, seed=seed)) for seed, speed in enumerate((1.5, 1.5, 1.5))]
    model = train([(sensed(log), fixes) for _, (log, fixes) in ways], SETTINGS)
    walk = sensed(ways[0][1][0])
    assert np.median(model.speed_m_s(walk.features, walk.signals.time_s)) == pytest.approx(1.5, abs=0.1)
    assert isinstance(model, SpeedModel)


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
    return happenings(walk, altitude)


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


def contradicting_m(log: InertialLog, fixes: FixLog) -> float:
    sensed = SensedWalk.of(log)
    assert sensed is not None
    return float(contradictions_m(sensed.path(fixes, speed_model(), DeadReckoningSettings())).max())


@pytest.mark.parametrize("count", [2, 3, 5, 9])
@pytest.mark.parametrize("seed", range(3))
def test_true_fixes_agree(seed: int, count: int) -> None:
    log, time_ns, place = simulated(seed, 120.0)
    assert contradicting_m(log, true_fixes(time_ns, place, count)) == 0


def test_fixes_in_the_wrong_order_contradict_each_other() -> None:
    log, time_ns, place = simulated(1, 120.0)
    fixes = true_fixes(time_ns, place, 7)
    assert contradicting_m(log, replace(fixes, position_bcs=fixes.position_bcs[[3, 0, 5, 1, 6, 2, 4]])) > 5


def test_two_fixes_farther_apart_than_the_steps_lead_contradict_each_other() -> None:
    log, time_ns, place = simulated(1, 120.0)
    fixes = true_fixes(time_ns, place, 2)
    far = fixes.position_bcs + np.array(((0.0, 0.0), (400.0, 0.0)))
    assert contradicting_m(log, replace(fixes, position_bcs=far)) > 50
