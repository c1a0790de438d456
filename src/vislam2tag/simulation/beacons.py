"""BLE beacons in a generated building, and what a phone hears of them along a true walk."""

from __future__ import annotations

import uuid
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.core.arrays import IntArray
from vislam2tag.simulation.building import addresses, near_ways
from vislam2tag.simulation.model import SimulatedBuilding, TrueWalk, position_at
from vislam2tag.simulation.radio import (
    PhoneReceiver,
    RadioEnvironment,
    RadioSettings,
    make_radio_environment,
    mean_along_walk,
)
from vislam2tag.simulation.settings import stream

BEACONS = 10
"""Beacons on each floor."""
HEIGHT_M = 2.2
CHANNEL_MHZ = 2426.0
POWER_AT_1_M_DBM = -59.0
POWER_SIGMA_DB = 2.0
INTERVAL_S = 0.35
"""Time between advertisements; the radio adds up to 10 ms to each (Bluetooth Core, advDelay)."""
DELAY_S = 0.01
HEARD_SHARE = 0.6
"""Part of the audible advertisements that a phone's scan window catches."""
FADING_SIGMA_DB = 4.0
"""One of three channels, without averaging: more than a Wi-Fi reading's."""
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
        positions.append(np.column_stack((near_ways(BEACONS, floor, rng), np.full(BEACONS, HEIGHT_M))))
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
        ap_frequency_mhz=np.full(len(bssid), CHANNEL_MHZ),
        ap_power_dbm=rng.normal(POWER_AT_1_M_DBM, POWER_SIGMA_DB, len(bssid)),
    )
    settings = RadioSettings(fading_sigma_db=FADING_SIGMA_DB)
    return Beacons(
        make_radio_environment(transmitters, settings, seed),
        str(uuid.UUID(bytes=rng.bytes(16), version=4)),
        transmitters.ap_floor,
        np.tile(np.arange(1, BEACONS + 1), len(building.floors)),
    )


def simulate_ble(beacons: Beacons, walk: TrueWalk, receiver: PhoneReceiver, rng: np.random.Generator) -> BleLog:
    """Let every beacon advertise along the walk; the phone catches a part of what is loud enough."""
    count = len(beacons.major)
    duration_s = float(walk.time_ns[-1] - walk.time_ns[0]) / 1e9
    steps = int(duration_s / INTERVAL_S)
    delays = INTERVAL_S + rng.uniform(0, DELAY_S, (steps, count))
    seconds = rng.uniform(0, INTERVAL_S, count) + np.cumsum(delays, axis=0) - delays[0]
    beacon = np.tile(np.arange(count), steps)
    time_ns = walk.time_ns[0] + (seconds.ravel() * 1e9).astype(np.int64)
    caught = (rng.random(len(time_ns)) < HEARD_SHARE) & (time_ns < walk.time_ns[-1])
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
