"""Scans and ranges to access points on a simulated walk."""

from __future__ import annotations

import numpy as np
import pytest

from tests.simulation.hand_made import make_floor, make_test_building, make_test_walk
from vislam2tag.simulation.model import SimulatedBuilding, position_at
from vislam2tag.simulation.radio import (
    BEACON_HEARD_SHARE,
    BEACON_INTERVAL_S,
    BEACONS,
    MOST_ASKED,
    ORDINARY_BIAS_M,
    PhoneReceiver,
    RadioSettings,
    WifiLog,
    make_beacons,
    make_radio_environment,
    mean_rss_dbm,
    simulate_ble,
    simulate_ranges,
    simulate_wifi,
)
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
    expected = 60.0 / (BEACON_INTERVAL_S + 0.005) * BEACON_HEARD_SHARE
    counts = np.bincount(log.beacon, minlength=2 * BEACONS)
    loudest = counts.max()
    assert 0.85 * expected < loudest < 1.15 * expected


PLAIN = RadioSettings(shadowing_sigma_db=0.0, fading_sigma_db=0.0, miss_share=0.0)
WALL = np.array([[[10.0, 0.0], [10.0, 20.0]]])
FAINT = -200.0


def one_access_point(walls: np.ndarray | None = None) -> SimulatedBuilding:
    return make_test_building(make_floor(walls=walls), positions=np.array([[0.0, 5.0, 1.4]]), ap_floor=[0])


def many_access_points() -> SimulatedBuilding:
    places = np.random.default_rng(1).uniform((0, 0, 2), (40, 20, 3), (30, 3))
    return make_test_building(make_floor(), make_floor(1, elevation_m=3.5), positions=places, ap_floor=[0, 1] * 15)


def mean_along_x(building: SimulatedBuilding, settings: RadioSettings, x: list[float], floor: int = 0) -> np.ndarray:
    place = np.column_stack((x, np.full(len(x), 5.0), np.full(len(x), 1.4)))
    return mean_rss_dbm(
        make_radio_environment(building, settings, 1), floor, place, np.zeros(len(x), dtype=np.int64), FAINT
    )


def test_log_distance_law() -> None:
    rss = mean_along_x(one_access_point(), PLAIN, [1.0, 10.0, 20.0, 40.0])
    assert rss[0] == pytest.approx(-40)
    assert rss[1] == pytest.approx(-40 - 10 * PLAIN.path_loss_exponent)
    assert (np.diff(rss) < 0).all()


def test_a_wall_costs_its_loss_and_only_behind_it() -> None:
    places = [5.0, 9.0, 11.0, 30.0]
    loss = mean_along_x(one_access_point(), PLAIN, places) - mean_along_x(one_access_point(WALL), PLAIN, places)
    assert loss.tolist() == pytest.approx([0, 0, PLAIN.wall_loss_db, PLAIN.wall_loss_db])


def test_walls_beyond_the_most_cost_nothing_more() -> None:
    many = np.stack([WALL[0] + [0.1 * i, 0] for i in range(20)])
    loss = mean_along_x(one_access_point(), PLAIN, [30.0]) - mean_along_x(one_access_point(many), PLAIN, [30.0])
    assert loss == pytest.approx(PLAIN.wall_loss_db * PLAIN.most_walls)


def test_a_floor_costs_its_loss() -> None:
    floors = make_floor(-1, elevation_m=-3.0), make_floor(), make_floor(7, elevation_m=3.0)
    building = make_test_building(*floors, positions=np.array([[0.0, 5.0, 1.4]]), ap_floor=[-1])
    below, middle, above = (mean_along_x(building, PLAIN, [30.0], floor)[0] for floor in (-1, 0, 7))
    assert below - middle == pytest.approx(PLAIN.floor_loss_db, abs=0.2)
    assert middle - above == pytest.approx(PLAIN.floor_loss_db, abs=0.3)


def test_out_of_reach_is_not_computed() -> None:
    environment = make_radio_environment(one_access_point(), PLAIN, 1)
    place = np.array([[2.0, 5.0, 1.4], [40.0, 5.0, 1.4]])
    rss = mean_rss_dbm(environment, 0, place, np.zeros(2, dtype=np.int64), -60.0)
    assert np.isfinite(rss).tolist() == [True, False]


def test_shadowing_belongs_to_seed_and_access_point() -> None:
    settings = RadioSettings()
    places = np.linspace(1, 39, 50).tolist()
    first = mean_along_x(one_access_point(), settings, places)
    assert (first == mean_along_x(one_access_point(), settings, places)).all()
    place = np.column_stack((places, np.full(50, 5.0), np.full(50, 1.4)))
    other = mean_rss_dbm(
        make_radio_environment(one_access_point(), settings, 2), 0, place, np.zeros(50, dtype=np.int64), FAINT
    )
    assert np.abs(first - other).max() > 1


def scans(
    settings: RadioSettings, receiver: PhoneReceiver | None = None, duration_s: float = 60.0, seed: int = 0
) -> WifiLog:
    environment = make_radio_environment(many_access_points(), settings, 1)
    walk = make_test_walk(duration_s, speed=0.5)
    return simulate_wifi(environment, walk, receiver or PhoneReceiver(), np.random.default_rng(seed))


def test_scan_timing() -> None:
    settings = RadioSettings()
    wifi = scans(settings)
    walk = make_test_walk(60.0)
    numbers, rows = np.unique(wifi.scan, return_counts=True)
    assert (np.diff(numbers) == 1).all()
    assert 14 <= len(numbers) <= 18
    assert rows.min() >= 5
    assert wifi.time_us.min() * 1000 > walk.time_ns[0]
    assert wifi.time_us.max() * 1000 < walk.time_ns[-1]
    starts = np.array([wifi.time_us[wifi.scan == number].min() for number in numbers])
    spans = np.array([np.ptp(wifi.time_us[wifi.scan == number]) for number in numbers])
    assert np.median(np.diff(starts)) / 1e6 == pytest.approx(settings.scan_interval_s, abs=0.3)
    assert settings.sweep_s - 0.5 < spans.max() / 1e6 < settings.sweep_s + 0.2
    first = wifi.time_us[wifi.scan == numbers[0]]
    assert (np.diff(first) < 0).any()
    assert len({int(scans(settings, seed=seed).scan[0]) for seed in range(4)}) > 1


def test_an_offset_moves_every_reading_and_weak_ones_are_missing() -> None:
    plain = scans(PLAIN, PhoneReceiver(0.0, -150.0))
    louder = scans(PLAIN, PhoneReceiver(6.0, -150.0))
    assert (louder.rss_dbm - plain.rss_dbm == 6).all()
    deaf = scans(PLAIN, PhoneReceiver(0.0, -60.0))
    assert deaf.rss_dbm.min() >= -60
    assert 0 < len(deaf.scan) == (plain.rss_dbm >= -60).sum()


def test_readings_are_missed() -> None:
    every = len(scans(RadioSettings(miss_share=0.0)).scan)
    some = len(scans(RadioSettings(miss_share=0.3)).scan)
    assert some / every == pytest.approx(0.7, abs=0.06)


def test_stale_rows_repeat_the_scan_before() -> None:
    def repeats(wifi: WifiLog) -> list[tuple[int, int]]:
        rows: dict[tuple[int, int], list[int]] = {}
        for row, key in enumerate(zip(wifi.access_point.tolist(), wifi.time_us.tolist(), strict=True)):
            rows.setdefault(key, []).append(row)
        return [(pair[0], pair[1]) for pair in rows.values() if len(pair) == 2]

    assert repeats(scans(RadioSettings())) == []
    wifi = scans(RadioSettings(stale_share=1.0))
    pairs = repeats(wifi)
    assert len(pairs) > 20
    for first, again in pairs:
        assert wifi.scan[again] == wifi.scan[first] + 1
        assert wifi.rss_dbm[again] == wifi.rss_dbm[first]


def test_no_scan_fits_a_short_walk() -> None:
    assert len(scans(RadioSettings(), duration_s=2.0).scan) == 0


BUILDING = SCENARIO.building
ENVIRONMENT = make_radio_environment(BUILDING, RadioSettings(), 3)
HEARD = simulate_wifi(ENVIRONMENT, WALK, PhoneReceiver(), stream(3, "wifi"))


def test_the_loudest_of_each_scan_are_asked() -> None:
    log = simulate_ranges(ENVIRONMENT, WALK, HEARD, stream(3, "rtt"))
    bursts, counts = np.unique(log.time_ms, return_counts=True)
    scans = np.unique(HEARD.scan)
    assert len(bursts) == len(scans)
    assert counts.max() <= MOST_ASKED
    assert (np.diff(log.time_ms) >= 0).all()
    of_first = HEARD.scan == scans[0]
    assert log.rss_dbm[log.time_ms == bursts[0]].min() >= np.sort(HEARD.rss_dbm[of_first])[::-1][:MOST_ASKED].min()


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
