from __future__ import annotations

import numpy as np

from vislam2tag.simulation.beacons import BEACONS, HEARD_SHARE, INTERVAL_S, make_beacons, simulate_ble
from vislam2tag.simulation.model import position_at
from vislam2tag.simulation.radio import PhoneReceiver
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import stream
from vislam2tag.simulation.survey import walk_and_track

SCENARIO = regular_survey(3, "none", (0, 1), ("LG",), 1, 60.0)
WALK = walk_and_track(SCENARIO, SCENARIO.sessions[0])[0]
BEACON_SET = make_beacons(SCENARIO.building, 3)


def test_each_floor_has_beacons_with_an_identity_of_their_own() -> None:
    transmitters = BEACON_SET.environment.building
    assert len(set(transmitters.ap_bssid)) == 2 * BEACONS
    assert len(set(zip(BEACON_SET.major.tolist(), BEACON_SET.minor.tolist(), strict=True))) == 2 * BEACONS
    assert SCENARIO.building.ap_bssid != transmitters.ap_bssid


def test_near_beacons_are_loud_and_times_lie_within_the_walk() -> None:
    log = simulate_ble(BEACON_SET, WALK, PhoneReceiver(sensitivity_dbm=-94.0), stream(3, "ble"))
    assert np.all(np.diff(log.time_ns) >= 0)
    assert log.time_ns[0] >= WALK.time_ns[0]
    assert log.time_ns[-1] < WALK.time_ns[-1]
    place = position_at(WALK, log.time_ns)[:, :2]
    distance = np.linalg.norm(place - BEACON_SET.environment.building.ap_position[log.beacon, :2], axis=1)
    own_floor = BEACON_SET.environment.building.ap_floor[log.beacon] == 0
    near, far = own_floor & (distance < 4), own_floor & (distance > 12)
    assert near.sum() > 10
    assert log.rss_dbm[near].mean() > log.rss_dbm[far].mean() + 8
    assert log.rss_dbm.min() >= -94


def test_a_beacon_beside_the_phone_is_caught_as_often_as_said() -> None:
    log = simulate_ble(BEACON_SET, WALK, PhoneReceiver(sensitivity_dbm=-200.0), stream(3, "ble"))
    expected = 60.0 / (INTERVAL_S + 0.005) * HEARD_SHARE
    counts = np.bincount(log.beacon, minlength=2 * BEACONS)
    loudest = counts.max()
    assert 0.85 * expected < loudest < 1.15 * expected
