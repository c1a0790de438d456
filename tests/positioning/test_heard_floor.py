"""Scans of all walks of a floor, when they were taken and by which phones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.positioning.test_walk_ties import hall, heard, walked
from vislam2tag.positioning.heard_floor import HeardFloor, scan_weights
from vislam2tag.positioning.radio_scans import RadioScans
from vislam2tag.positioning.walk_traces import WalkTrace


def there_and_back(walks: int) -> tuple[list[WalkTrace | None], list[RadioScans]]:
    """Walks through one hall, every other the opposite way."""
    ways, traces, scans = hall(walks)
    rng = np.random.default_rng(11)
    for number in range(0, walks, 2):
        way = ways[number][::-1].copy()
        traces[number], scans[number] = walked(way, 0.1), heard(way, rng)
    return traces, scans


def lag_s(floor: HeardFloor, traces: list[WalkTrace | None]) -> float:
    """That of the one phone."""
    [lag] = floor.lags(traces).values()
    return lag.seconds


def test_scans_that_are_older_than_their_times_are_known_by_walks_that_meet() -> None:
    traces, scans = there_and_back(6)
    late = [replace(one, time_ns=one.time_ns + 3 * 10**9) for one in scans]
    assert abs(lag_s(HeardFloor.of(traces, scans), traces)) <= 0.5
    placed = HeardFloor.of(traces, late)
    assert abs(lag_s(placed, traces)) <= 0.5  # put right
    on_time = HeardFloor.of(traces, scans)
    rows = np.flatnonzero(placed.walk == 3)
    others = np.flatnonzero(on_time.walk == 3)[: len(rows)]
    assert np.linalg.norm(placed.place[rows] - on_time.place[others], axis=1).mean() < 0.6  # of 1.5 m


def test_each_phone_has_its_own_lag() -> None:
    traces, scans = there_and_back(8)
    phones = ["a", "a", "b", "b"] * 2  # either goes both ways
    scans = [replace(one, device=np.full(len(one), phone)) for one, phone in zip(scans, phones, strict=True)]
    late = [
        replace(one, time_ns=one.time_ns + 4 * 10**9 * (phone == "b")) for one, phone in zip(scans, phones, strict=True)
    ]
    lags = HeardFloor.as_logged(traces, late).lags(traces)
    assert abs(lags["a"].seconds) <= 0.5
    assert abs(lags["b"].seconds - 4) <= 0.5
    assert lags["b"].sigma_s < 1
    both = [replace(one, time_ns=one.time_ns + 4 * 10**9) for one in scans]
    assert all(abs(lag.seconds - 4) <= 0.5 for lag in HeardFloor.as_logged(traces, both).lags(traces).values())
    assert HeardFloor.as_logged(traces[:1], scans[:1]).lags(traces[:1]) == {}


def test_a_phone_is_levelled_by_other_phones_however_many_walks_it_has() -> None:
    _, traces, scans = hall(4)
    phones = ("a", "a", "b", "b")
    louder = [
        replace(one, rssi_dbm=one.rssi_dbm + 8.0 * (phone == "b"), device=np.full(len(one), phone))
        for one, phone in zip(scans, phones, strict=True)
    ]
    floor = HeardFloor.as_logged(traces, louder)
    taken = np.concatenate([one.rssi_dbm for one in louder]) - floor.scans.rssi_dbm
    phone = floor.scans.device[floor.scans.row]
    assert abs(np.median(taken[phone == "b"]) - np.median(taken[phone == "a"]) - 8) < 1
    alone = HeardFloor.as_logged(traces, [replace(one, device=np.full(len(one), "a")) for one in louder])
    np.testing.assert_array_equal(alone.scans.rssi_dbm, np.concatenate([one.rssi_dbm for one in louder]))


def test_scans_are_left_out_while_nobody_knows_where_the_walk_led() -> None:
    traces, scans = there_and_back(4)
    trace = traces[0]
    assert trace is not None
    whole = np.ones(len(trace.time_ns), dtype=np.bool_)
    whole[31:51] = False
    floor = HeardFloor.of([replace(trace, whole=whole), *traces[1:]], scans)
    time_s = floor.scans.time_ns[floor.walk == 0] * 1e-9
    assert not ((time_s > 31) & (time_s < 49)).any()
    assert len(scans[0]) - 12 <= len(time_s) <= len(scans[0]) - 9


def test_what_is_alike_counts_and_what_has_nothing_in_common_does_not() -> None:
    weight = scan_weights(np.array([[0.1, 0.2, 1.0], [1.0, 1.0, 1.0]]))
    np.testing.assert_allclose(weight[0], [16 / 17, 1 / 17, 0])
    assert not weight[1].any()
