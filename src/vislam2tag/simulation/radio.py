"""Radio measurements along a true walk: Wi-Fi scans, ranges from the round-trip time of Wi-Fi frames, and BLE beacons.

Scans follow from path loss, walls, floors, correlated shadowing, the receiver and the timing of scans.
"""

from __future__ import annotations

import uuid
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.simulation.building import addresses, near_ways
from vislam2tag.simulation.model import (
    SimulatedBuilding,
    SmoothFields,
    TrueWalk,
    count_crossings,
    floor_at,
    make_fields,
    position_at,
)
from vislam2tag.simulation.settings import stream

_SHADOWING_REACH = 3.0
"""Shadowing above this many standard deviations is ignored beyond an access point's reach."""
_SMALLEST_RSS_DBM, _GREATEST_RSS_DBM = -110, -10


@dataclass(frozen=True)
class RadioSettings:
    """Propagation and scanning.

    The log-distance model with wall and floor attenuation (Seidel and Rappaport 1992), the spatially
    correlated shadowing of Gudmundson (1991).
    """

    path_loss_exponent: float = 2.0
    wall_loss_db: float = 2.0
    most_walls: int = 6
    """Walls beyond this number add no loss, because diffraction dominates."""
    floor_loss_db: float = 14.0
    shadowing_sigma_db: float = 4.0
    shadowing_length_m: float = 4.0
    fading_sigma_db: float = 2.0
    scan_interval_s: float = 3.5
    scan_jitter_s: float = 0.2
    """Standard deviation of the interval between scan starts, seconds."""
    sweep_s: float = 2.5
    """Seconds a scan takes to visit all channels, lowest frequency first."""
    miss_share: float = 0.05
    """Share of audible readings that a scan misses."""
    stale_share: float = 0.0
    """Share of access points that are no longer heard but keep their row of the previous scan."""


@dataclass(frozen=True)
class PhoneReceiver:
    """Differences between phones: a constant offset (dB) and the weakest reading that they report (dBm)."""

    offset_db: float = 0.0
    sensitivity_dbm: float = -92.0


@dataclass(frozen=True)
class RadioEnvironment:
    """A building's radio environment, the same for every device and walk."""

    building: SimulatedBuilding
    settings: RadioSettings
    shadowing: SmoothFields
    ap_position: FloatArray
    """(a, 3) with z above the building's zero."""


@dataclass(frozen=True)
class WifiLog:
    """Readings in file order: scan number, time (boot clock, microseconds), access-point index, RSSI; all (k,)."""

    scan: IntArray
    time_us: IntArray
    access_point: IntArray
    rss_dbm: IntArray

    @property
    def scan_end_us(self) -> IntArray:
        """(k,) time of the last reading of each row's scan."""
        _, number = np.unique(self.scan, return_inverse=True)
        last = np.zeros(int(number.max(initial=-1)) + 1, dtype=np.int64)
        np.maximum.at(last, number, self.time_us)
        return last[number]

    def rows(self, index: IntArray) -> WifiLog:
        """These rows (j,)."""
        return WifiLog(self.scan[index], self.time_us[index], self.access_point[index], self.rss_dbm[index])


def make_radio_environment(building: SimulatedBuilding, settings: RadioSettings, seed: int) -> RadioEnvironment:
    """Fix the shadowing of each access point by the seed and its BSSID."""
    draws = [stream(seed, "shadowing", bssid) for bssid in building.ap_bssid]
    shadowing = make_fields(draws, settings.shadowing_sigma_db, settings.shadowing_length_m)
    rise = np.array([building.floor(number).elevation_m for number in building.ap_floor.tolist()])
    position = building.ap_position + np.column_stack((np.zeros((len(rise), 2)), rise))
    return RadioEnvironment(building, settings, shadowing, position)


def mean_rss_dbm(
    environment: RadioEnvironment, floor: int, position: FloatArray, access_point: IntArray, faintest_dbm: float
) -> FloatArray:
    """Mean RSSI (k,) in dBm at BCS positions (k, 3), z above ``floor``, of access points (k,) by index.

    Pairs that cannot reach ``faintest_dbm`` are -inf; their walls are not counted.
    """
    settings = environment.settings
    here = environment.building.floor(floor)
    point = position + np.array((0.0, 0.0, here.elevation_m))
    rss = environment.building.ap_power_dbm[access_point] - _open_loss_db(environment, floor, point, access_point)
    near = rss + _SHADOWING_REACH * settings.shadowing_sigma_db > faintest_dbm
    chosen = access_point[near]
    walls = count_crossings(point[near, :2], environment.ap_position[chosen, :2], here.walls)
    rss[near] -= settings.wall_loss_db * np.minimum(walls, settings.most_walls)
    rss[near] += environment.shadowing.at(point[near], chosen)
    return np.asarray(np.where(near, rss, -np.inf))


def _open_loss_db(environment: RadioEnvironment, floor: int, point: FloatArray, access_point: IntArray) -> FloatArray:
    """Loss (k,) from distance and from the storeys between, without walls."""
    settings, building = environment.settings, environment.building
    distance = np.linalg.norm(point - environment.ap_position[access_point], axis=1)
    storeys = np.abs(_rank(building, building.ap_floor)[access_point] - _rank(building, np.array([floor])))
    path_loss = 10 * settings.path_loss_exponent * np.log10(np.maximum(distance, 1.0))
    return np.asarray(path_loss + settings.floor_loss_db * storeys)


def _rank(building: SimulatedBuilding, floors: IntArray) -> IntArray:
    """Rank by elevation of floor numbers (k,): neighbouring storeys differ by one."""
    by_height = [floor.number for floor in sorted(building.floors, key=lambda floor: floor.elevation_m)]
    return np.array([by_height.index(int(number)) for number in floors], dtype=np.int64)


def simulate_wifi(
    environment: RadioEnvironment, walk: TrueWalk, receiver: PhoneReceiver, rng: np.random.Generator
) -> WifiLog:
    """Scan the access points along the walk; each reading has the time its channel was visited."""
    time_us = _reading_times_us(environment, walk, rng)
    scans, points = time_us.shape
    access_point = np.tile(np.arange(points), scans)
    position = position_at(walk, time_us.ravel() * 1000)
    faintest = receiver.sensitivity_dbm - receiver.offset_db
    mean = mean_along_walk(environment, walk, time_us.ravel() * 1000, position, access_point, faintest - 5)
    mean = mean.reshape(scans, points)
    fading = rng.normal(0, environment.settings.fading_sigma_db, mean.shape)
    rss = np.clip(mean + receiver.offset_db + fading, _SMALLEST_RSS_DBM, _GREATEST_RSS_DBM).round().astype(np.int64)
    missed = rng.random(rss.shape) < environment.settings.miss_share
    heard = (rss >= receiver.sensitivity_dbm) & ~missed
    return _in_file_order(heard, time_us, rss, environment.settings.stale_share, rng)


def mean_along_walk(
    environment: RadioEnvironment,
    walk: TrueWalk,
    time_ns: IntArray,
    position: FloatArray,
    access_point: IntArray,
    faintest_dbm: float,
) -> FloatArray:
    """Mean RSSI (k,) at positions (k, 3), z above the walk's own floor, with the walls of the floor of each
    position."""
    own_m = environment.building.floor(walk.floor).elevation_m
    floors = floor_at(walk, time_ns)
    mean = np.empty(len(position))
    for floor in np.unique(floors).tolist():
        here = floors == floor
        place = position[here] + np.array((0.0, 0.0, own_m - environment.building.floor(floor).elevation_m))
        mean[here] = mean_rss_dbm(environment, floor, place, access_point[here], faintest_dbm)
    return mean


def _reading_times_us(environment: RadioEnvironment, walk: TrueWalk, rng: np.random.Generator) -> IntArray:
    """(scans, access points) times in microseconds; whole scans within the walk only."""
    settings = environment.settings
    duration_s = (walk.time_ns[-1] - walk.time_ns[0]) / 1e9
    most = int(duration_s / settings.scan_interval_s) + 1
    shortest = 0.5 * settings.scan_interval_s
    intervals = np.maximum(rng.normal(settings.scan_interval_s, settings.scan_jitter_s, most), shortest)
    starts = rng.uniform(0.1, 1.0) + np.cumsum(intervals) - intervals[0]
    starts = starts[starts + settings.sweep_s + 0.1 < duration_s]
    channels, rank = np.unique(environment.building.ap_frequency_mhz, return_inverse=True)
    share = rank / max(len(channels) - 1, 1)
    beacon_s = rng.uniform(0, 0.08, (len(starts), len(rank)))
    seconds = starts[:, None] + settings.sweep_s * share + beacon_s
    return np.asarray(walk.time_ns[0] // 1000 + (seconds * 1e6).astype(np.int64))


def _in_file_order(
    heard: BoolArray, time_us: IntArray, rss: IntArray, stale_share: float, rng: np.random.Generator
) -> WifiLog:
    """Number the scans and mix the rows of each, repeated rows of the scan before among them; all (scans, access
    points).
    """
    scan, point = np.nonzero(heard)
    gone = heard[:-1] & ~heard[1:] & (rng.random(heard[1:].shape) < stale_share)
    stale_source, stale_point = np.nonzero(gone)
    in_scan = np.concatenate((scan, stale_source + 1))
    source = np.concatenate((scan, stale_source))
    access_point = np.concatenate((point, stale_point))
    order = np.lexsort((rng.random(len(in_scan)), in_scan))
    source, access_point = source[order], access_point[order]
    first_number = int(rng.integers(0, 40))
    return WifiLog(
        in_scan[order] + first_number, time_us[source, access_point], access_point, rss[source, access_point]
    )


MOST_ASKED = 10
"""Number of access points that a phone ranges at once."""
ASKED_AFTER_US = 200_000
"""Delay after the last reading of a scan."""
EVERY_NTH_ANSWERS = 3
"""Every third access point supports ranging (IEEE 802.11mc); for others the time of an ordinary response is used."""
RANGE_SIGMA_M = 0.6
ORDINARY_SIGMA_M = 2.5
ORDINARY_BIAS_M = 1.5
BURST = 8
"""Frames in a burst."""


@dataclass(frozen=True)
class RangeLog:
    """Ranges in order of time, all (k,): boot-clock ms, index of the access point, whether it supports ranging, range
    and its spread in whole mm, level in dBm, number of answered frames.
    """

    time_ms: IntArray
    access_point: IntArray
    responder: BoolArray
    range_mm: IntArray
    sigma_mm: IntArray
    rss_dbm: IntArray
    successful: IntArray


def simulate_ranges(environment: RadioEnvironment, walk: TrueWalk, wifi: WifiLog, rng: np.random.Generator) -> RangeLog:
    """After each scan range to the strongest access points. Walls add no delay."""
    order = np.lexsort((-wifi.rss_dbm, wifi.scan))
    scan, first = np.unique(wifi.scan[order], return_index=True)
    rank = np.arange(len(order)) - first[np.searchsorted(scan, wifi.scan[order])]
    chosen = order[rank < MOST_ASKED]
    time_ms = (wifi.scan_end_us[chosen] + ASKED_AFTER_US) // 1000
    point = wifi.access_point[chosen]
    responder = point % EVERY_NTH_ANSWERS == 0
    sigma_m = np.where(responder, RANGE_SIGMA_M, ORDINARY_SIGMA_M)
    measured = _distance_m(environment, walk, time_ms * 1_000_000, point) + rng.normal(0, sigma_m)
    measured += np.where(responder, 0.0, ORDINARY_BIAS_M)
    return RangeLog(
        time_ms,
        point,
        responder,
        np.rint(1000 * measured).astype(np.int64),
        np.rint(1000 * sigma_m * rng.uniform(0.5, 1.5, len(point))).astype(np.int64),
        wifi.rss_dbm[chosen],
        rng.integers(BURST // 2, BURST + 1, len(point)),
    )


def _distance_m(environment: RadioEnvironment, walk: TrueWalk, time_ns: IntArray, point: IntArray) -> FloatArray:
    """Distances (k,) at boot-clock times (k,) to access points (k,)."""
    here = environment.building.floor(walk.floor)
    phone = position_at(walk, time_ns) + np.array((0.0, 0.0, here.elevation_m))
    return np.asarray(np.linalg.norm(phone - environment.ap_position[point], axis=1))


BEACONS = 10
"""Beacons on each floor."""
BEACON_HEIGHT_M = 2.2
BEACON_MHZ = 2426.0
POWER_AT_1_M_DBM = -59.0
BEACON_POWER_SIGMA_DB = 2.0
BEACON_INTERVAL_S = 0.35
"""Time between advertisements; the radio adds up to 10 ms to each (Bluetooth Core, advDelay)."""
BEACON_DELAY_S = 0.01
BEACON_HEARD_SHARE = 0.6
"""Part of the audible advertisements that a phone's scan window catches."""
BEACON_FADING_SIGMA_DB = 4.0
"""One of three channels, without averaging, so more than for a Wi-Fi reading."""
NAMELESS_SHARE = 0.3


@dataclass(frozen=True)
class Beacons:
    """The beacons of a building as transmitters in it, and their iBeacon identities."""

    environment: RadioEnvironment
    uuid: str
    major: IntArray
    minor: IntArray


@dataclass(frozen=True)
class BleLog:
    """Advertisements in order of time: boot-clock ns, index of the beacon, level; all (k,)."""

    time_ns: IntArray
    beacon: IntArray
    rss_dbm: IntArray
    beacons: Beacons


def make_beacons(building: SimulatedBuilding, seed: int) -> Beacons:
    """Hang beacons along the walkable ways of each floor; each floor has its own random numbers."""
    floors, positions, names, bssid = [], [], [], list[str]()
    for floor in building.floors:
        rng = stream(seed, "beacons", floor.number)
        positions.append(np.column_stack((near_ways(BEACONS, floor, rng), np.full(BEACONS, BEACON_HEIGHT_M))))
        floors.append(np.full(BEACONS, floor.number, dtype=np.int64))
        bssid += addresses("c2", BEACONS, rng)
        nameless = rng.random(BEACONS) < NAMELESS_SHARE
        names += ["" if quiet else f"beacon-{floor.number}-{i}" for i, quiet in enumerate(nameless.tolist(), start=1)]
    rng = stream(seed, "beacons")
    transmitters = replace(
        building,
        ap_floor=np.concatenate(floors),
        ap_position=np.vstack(positions),
        ap_bssid=tuple(bssid),
        ap_ssid=tuple(names),
        ap_frequency_mhz=np.full(len(bssid), BEACON_MHZ),
        ap_power_dbm=rng.normal(POWER_AT_1_M_DBM, BEACON_POWER_SIGMA_DB, len(bssid)),
    )
    settings = RadioSettings(fading_sigma_db=BEACON_FADING_SIGMA_DB)
    return Beacons(
        make_radio_environment(transmitters, settings, seed),
        str(uuid.UUID(bytes=rng.bytes(16), version=4)),
        transmitters.ap_floor,
        np.tile(np.arange(1, BEACONS + 1), len(building.floors)),
    )


def simulate_ble(beacons: Beacons, walk: TrueWalk, receiver: PhoneReceiver, rng: np.random.Generator) -> BleLog:
    """Let every beacon advertise along the walk; the phone catches some of the signals that are strong enough."""
    count = len(beacons.major)
    duration_s = float(walk.time_ns[-1] - walk.time_ns[0]) / 1e9
    steps = int(duration_s / BEACON_INTERVAL_S)
    delays = BEACON_INTERVAL_S + rng.uniform(0, BEACON_DELAY_S, (steps, count))
    seconds = rng.uniform(0, BEACON_INTERVAL_S, count) + np.cumsum(delays, axis=0) - delays[0]
    beacon = np.tile(np.arange(count), steps)
    time_ns = walk.time_ns[0] + (seconds.ravel() * 1e9).astype(np.int64)
    caught = (rng.random(len(time_ns)) < BEACON_HEARD_SHARE) & (time_ns < walk.time_ns[-1])
    time_ns, beacon = time_ns[caught], beacon[caught]
    faintest_dbm = receiver.sensitivity_dbm - receiver.offset_db
    mean_dbm = mean_along_walk(
        beacons.environment, walk, time_ns, position_at(walk, time_ns), beacon, faintest_dbm - 10
    )
    fading_db = rng.normal(0, beacons.environment.settings.fading_sigma_db, len(time_ns))
    rss_dbm = np.clip(mean_dbm + receiver.offset_db + fading_db, -120, 0).round()
    heard = np.flatnonzero(rss_dbm >= receiver.sensitivity_dbm)
    order = heard[np.argsort(time_ns[heard], kind="stable")]
    return BleLog(time_ns[order], beacon[order], rss_dbm[order].astype(np.int64), beacons)
