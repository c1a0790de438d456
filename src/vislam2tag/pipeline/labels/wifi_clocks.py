"""Clock offsets of Wi-Fi scans: one common to all walks of a phone, and one of each walk.

Walks with the same delay agree if they go in the same direction, so only walks in opposite directions show a common
delay.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vislam2tag.positioning.heard_floor import HeardFloor, ScanLag
from vislam2tag.positioning.radio_scans import scans_of_walk
from vislam2tag.positioning.walk_traces import HOLE_S, WalkTrace
from vislam2tag.quality.diagnosis.evidence import Evidence
from vislam2tag.quality.diagnosis.wifi_clock import (
    FEWEST_WALKS,
    SURE_SIGMAS,
    ClockOffset,
    HeardOnWalk,
    heard_on_floors,
    wifi_clock_offsets,
)
from vislam2tag.site.model import SessionKey

LEAST_LAG_S = 1.5
"""A scan takes less time than this."""
WAY_SIGMA_M = 0.2
"""Sigma of a path mapped by landmarks; the value hardly matters, because it is the same for all."""


def wifi_clocks(evidence: Evidence, heard: Mapping[SessionKey, HeardOnWalk]) -> dict[SessionKey, ClockOffset]:
    """Correction of the scan times of each walk, without walks with an unknown offset."""
    floors = heard_on_floors(evidence, heard)
    lags = {
        (floor, device): lag
        for floor, walks in floors.items()
        for device, lag in common_lags(walks).items()
        if abs(lag.seconds) > max(LEAST_LAG_S, SURE_SIGMAS * lag.sigma_s)
    }
    late = {key: lags[key.floor, key.device] for key in heard if (key.floor, key.device) in lags}
    on_time = {
        floor: {
            key: replace(one, time_s=one.time_s - late[key].seconds) if key in late else one
            for key, one in walks.items()
        }
        for floor, walks in floors.items()
    }
    return {
        key: _after(offset, late[key]) if key in late else offset for key, offset in wifi_clock_offsets(on_time).items()
    }


def common_lags(walks: Mapping[SessionKey, HeardOnWalk]) -> dict[str, ScanLag]:
    """Delay of the scans of each phone's walks of a floor."""
    if len(walks) < FEWEST_WALKS:
        return {}
    traces = [_trace(walk) for walk in walks.values()]
    scans = [
        scans_of_walk(walk.scan, walk.bssid, walk.dbm, np.rint(walk.time_s * 1e9).astype(np.int64), key.device)
        for key, walk in walks.items()
    ]
    return HeardFloor.as_logged(traces, scans).lags(traces)


def _after(offset: ClockOffset, lag: ScanLag) -> ClockOffset:
    """The offset of scans, combined with the earlier estimate by their uncertainties."""
    own_s = offset.offset_s if offset.sure else 0.0
    return ClockOffset(own_s - lag.seconds, float(np.hypot(offset.sigma_s * offset.sure, lag.sigma_s)))


def _trace(walk: HeardOnWalk) -> WalkTrace | None:
    """The part of the path on the plan; None if it is too short."""
    rows = np.flatnonzero(np.isfinite(walk.way))
    if len(rows) < 2:
        return None
    place = walk.way[rows]
    time_ns = np.rint(walk.way_s[rows] * 1e9).astype(np.int64)
    return WalkTrace(
        time_ns=time_ns,
        position_bcs=np.column_stack((place.real, place.imag)),
        covariance_bcs=np.tile(WAY_SIGMA_M**2 * np.eye(2), (len(rows), 1, 1)),
        way_m=np.concatenate(([0.0], np.cumsum(np.abs(np.diff(place))))),
        whole=np.diff(time_ns, prepend=time_ns[0]) <= HOLE_S * 1e9,
    )
