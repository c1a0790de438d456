"""Ranges by the round-trip time of Wi-Fi frames, to the access points that a phone hears loudest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.simulation.model import TrueWalk
from vislam2tag.simulation.sensors.radio import RadioEnvironment, WifiLog
from vislam2tag.simulation.walking.sampling import position_at

MOST = 10
"""Access points that a phone asks at once."""
ASKED_AFTER_US = 200_000
"""After the last reading of a scan."""
EVERY_NTH_ANSWERS = 3
"""Of the access points these answer ranging (IEEE 802.11mc); of the others the time of an ordinary answer is taken."""
SIGMA_M = 0.6
ORDINARY_SIGMA_M = 2.5
ORDINARY_BIAS_M = 1.5
BURST = 8
"""Frames of a burst."""


@dataclass(frozen=True)
class RangeLog:
    """Ranges in order of time, all (k,): boot-clock ms, index of the access point, whether it answers ranging, range
    and its spread in whole mm, level in dBm, frames that were answered.
    """

    time_ms: IntArray
    access_point: IntArray
    responder: BoolArray
    range_mm: IntArray
    sigma_mm: IntArray
    rss_dbm: IntArray
    successful: IntArray


def simulate_ranges(environment: RadioEnvironment, walk: TrueWalk, wifi: WifiLog, rng: np.random.Generator) -> RangeLog:
    """After each scan ask the access points that it heard loudest; straight through walls, which costs no time."""
    order = np.lexsort((-wifi.rss_dbm, wifi.scan))
    scan, first = np.unique(wifi.scan[order], return_index=True)
    rank = np.arange(len(order)) - first[np.searchsorted(scan, wifi.scan[order])]
    chosen = order[rank < MOST]
    last_us = np.zeros(len(scan), dtype=np.int64)
    number = np.searchsorted(scan, wifi.scan)
    np.maximum.at(last_us, number, wifi.time_us)
    time_ms = (last_us[number[chosen]] + ASKED_AFTER_US) // 1000
    point = wifi.access_point[chosen]
    responder = point % EVERY_NTH_ANSWERS == 0
    sigma_m = np.where(responder, SIGMA_M, ORDINARY_SIGMA_M)
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
    here = next(floor for floor in environment.building.floors if floor.number == walk.floor)
    phone = position_at(walk, time_ns) + np.array((0.0, 0.0, here.elevation_m))
    distance: FloatArray = np.linalg.norm(phone - environment.ap_position[point], axis=1)
    return distance
