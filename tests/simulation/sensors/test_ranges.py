"""Ranges to access points on a simulated walk."""

from __future__ import annotations

import numpy as np

from tests.simulation.sensors.test_beacons import SCENARIO, WALK
from vislam2tag.simulation.sensors.radio import PhoneReceiver, RadioSettings, make_radio_environment, simulate_wifi
from vislam2tag.simulation.sensors.ranges import MOST, ORDINARY_BIAS_M, simulate_ranges
from vislam2tag.simulation.settings import stream
from vislam2tag.simulation.walking.sampling import position_at

BUILDING = SCENARIO.building
ENVIRONMENT = make_radio_environment(BUILDING, RadioSettings(), 3)
HEARD = simulate_wifi(ENVIRONMENT, WALK, PhoneReceiver(), stream(3, "wifi"))


def test_the_loudest_of_each_scan_are_asked() -> None:
    log = simulate_ranges(ENVIRONMENT, WALK, HEARD, stream(3, "rtt"))
    bursts, counts = np.unique(log.time_ms, return_counts=True)
    scans = np.unique(HEARD.scan)
    assert len(bursts) == len(scans)
    assert counts.max() <= MOST
    assert (np.diff(log.time_ms) >= 0).all()
    of_first = HEARD.scan == scans[0]
    assert log.rss_dbm[log.time_ms == bursts[0]].min() >= np.sort(HEARD.rss_dbm[of_first])[::-1][:MOST].min()


def test_ranges_are_the_distances_with_their_errors() -> None:
    log = simulate_ranges(ENVIRONMENT, WALK, HEARD, stream(3, "rtt"))
    place = position_at(WALK, log.time_ms * 1_000_000)
    floor = next(floor for floor in BUILDING.floors if floor.number == WALK.floor)
    away = np.linalg.norm(
        place + np.array((0.0, 0.0, floor.elevation_m)) - ENVIRONMENT.ap_position[log.access_point], axis=1
    )
    error = log.range_mm / 1000 - away
    assert abs(error[log.responder].mean()) < 0.3
    assert abs(error[~log.responder].mean() - ORDINARY_BIAS_M) < 1.0
    assert error[log.responder].std() < error[~log.responder].std()
