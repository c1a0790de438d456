"""Radio tables take one form, and the mean position of readings weighs how sure each is."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from typing import Any

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.datasets.labelled_rows import START_NS, S, labelled, trajectory, wifi
from vislam2tag.datasets.fingerprints import (
    LEAST_SIGMA_M,
    SessionFingerprints,
    SessionWalk,
    fingerprints_of,
    mean_position,
    radio_rows,
)
from vislam2tag.datasets.phone_motion import PhoneMotion
from vislam2tag.datasets.schema import FINGERPRINTS, READINGS, SCHEMAS
from vislam2tag.datasets.settings import DatasetSettings
from vislam2tag.labeling.tables import SCHEMAS as LABELLED


def test_beacons_are_known_by_their_identity_others_by_their_address() -> None:
    rows = [
        {"address": "c2:01", "name": "desk", "uuid": "32ff", "major": 1, "minor": 7, "rssi_dbm": -60.0},
        {"address": "c2:02", "name": "", "rssi_dbm": -70.0},
    ]
    table = radio_rows(labelled("ble", rows), "ble")
    assert table["bssid"].to_list() == ["32ff-1-7", "c2:02"]
    assert table["ssid"].to_list() == ["desk", ""]
    assert set(table.columns) == set(LABELLED["wifi"])
    assert all(table.schema[name] == kind for name, kind in LABELLED["wifi"].items())


def test_wifi_stays_as_it_is() -> None:
    table = labelled("wifi", [{"scan": 1, "bssid": "a", "ssid": "", "rssi_dbm": -60.0}])
    assert radio_rows(table, "wifi") is table


Reading = tuple[float, float, float | None, bool, int]
METRES = st.floats(-1e3, 1e3)
SIGMA = st.none() | st.floats(0.0, 5.0)
DRAWN = st.lists(st.tuples(METRES, METRES, SIGMA, st.booleans(), st.integers(0, 2)), min_size=1, max_size=8)
SCHEMA = {
    "x": pl.Float64(),
    "y": pl.Float64(),
    "z": pl.Float64(),
    "sigma": pl.Float64(),
    "floor": pl.Int32(),
    "placed": pl.Boolean(),
}


def mean_of(rows: Sequence[tuple[object, ...]]) -> dict[str, Any]:
    table = pl.DataFrame(rows, schema=SCHEMA, orient="row")
    return table.group_by(pl.lit(0)).agg(**mean_position(pl.col("placed"))).drop("literal").row(0, named=True)


@given(DRAWN)
def test_the_mean_weighs_by_certainty_and_shares_its_error(
    readings: list[tuple[float, float, float | None, bool, int]],
) -> None:
    found = mean_of([(x, y, 1.5, sigma, floor, placed) for x, y, sigma, placed, floor in readings])
    used = [(x, y, sigma, floor) for x, y, sigma, placed, floor in readings if placed]
    if not used:
        assert found == dict.fromkeys(found)
        return
    stated = [max(sigma, LEAST_SIGMA_M) for _, _, sigma, _ in used if sigma is not None]
    sigma = np.array([max(s, LEAST_SIGMA_M) if s is not None else max(stated, default=1.0) for _, _, s, _ in used])
    weight = sigma**-2.0
    assert found["x"] == pytest.approx(np.average([x for x, *_ in used], weights=weight), abs=1e-6)
    assert found["y"] == pytest.approx(np.average([y for _, y, *_ in used], weights=weight), abs=1e-6)
    floors = [floor for *_, floor in used]
    assert found["floor"] == min(set(floors), key=lambda floor: (-floors.count(floor), floor))
    if not stated:
        assert found["sigma"] is None
        return
    assert found["sigma"] == pytest.approx(np.average(sigma, weights=weight))
    assert sigma.min() - 1e-9 <= found["sigma"] <= sigma.max() + 1e-9


def test_a_height_needs_all_readings() -> None:
    both = [(0.0, 0.0, 1.0, 0.1, 1, True), (0.0, 0.0, 3.0, 0.1, 1, True)]
    assert mean_of(both)["z"] == pytest.approx(2.0)
    assert mean_of([both[0], (0.0, 0.0, None, 0.1, 1, True)])["z"] is None
    assert mean_of([both[0], (0.0, 0.0, None, 0.1, 1, False)])["z"] == 1.0


FRAMES = trajectory([(0.1 * number, 0.0) for number in range(600)])
WALK = SessionWalk("floor_1.LG.walk", "main", "LG", "2022-01-14T163530", PhoneMotion.of(FRAMES))


def made(*rows: dict[str, Any], settings: DatasetSettings | None = None, limit_m: float = 0.5) -> SessionFingerprints:
    return fingerprints_of({"wifi": wifi(*rows)}, "wifi", WALK, settings or DatasetSettings(), limit_m)


def only(part: SessionFingerprints) -> dict[str, Any]:
    assert len(part.fingerprints) == 1
    return part.fingerprints.row(0, named=True)


def at(x: float, y: float = 0.0, sigma: float | None = 0.1, **more: Any) -> dict[str, Any]:
    return {"x": x, "y": y, "z": 1.3, "sigma": sigma} | more


def counts(part: SessionFingerprints) -> dict[str, int]:
    return {finding.kind: finding.count for finding in part.findings}


def test_one_scan() -> None:
    part = made(at(1.0, 4.0), at(2.0, 4.0), at(6.0, 4.0))
    row = only(part)
    expected = {
        "scan_id": "floor_1.LG.walk/wifi/000007",
        "technology": "wifi",
        "building": "main",
        "floor": 1,
        "x": pytest.approx(3.0),
        "y": pytest.approx(4.0),
        "z": pytest.approx(1.3),
        "sigma": pytest.approx(0.1),
        "x_median": 2.0,
        "y_median": 4.0,
        "spread": pytest.approx(np.sqrt(14 / 3)),
        "readings": 3,
        "labelled": 3,
        "labelled_share": 1.0,
        "status": "ok",
        "heading_deg": None,
        "speed_m_s": pytest.approx(1.0),
        "device": "LG",
        "user": None,
        "session": "floor_1.LG.walk",
        "start_ns": START_NS,
        "end_ns": START_NS + S // 5,
        "date": dt.date(2022, 1, 14),
    }
    assert row == expected
    assert list(part.fingerprints.schema.items()) == list(SCHEMAS[FINGERPRINTS].items())
    assert list(part.readings.schema.items()) == list(SCHEMAS[READINGS].items())
    assert part.readings["bssid"].to_list() == ["a", "b", "c"]
    assert part.findings == ()


def test_the_papers_rule_where_no_sigma_is_stated() -> None:
    row = only(made(at(1.0, 2.0, None), at(4.0, 0.0, None), at(7.0, 1.0, None)))
    assert (row["x"], row["y"], row["sigma"], row["status"]) == (4.0, 1.0, None, "ok")


def test_certain_readings_weigh_more() -> None:
    row = only(made(at(0.0, sigma=0.1), at(10.0, sigma=0.3)))
    assert row["x"] == pytest.approx(1.0)
    assert row["sigma"] == pytest.approx(0.12)


def test_partly_labelled_scans_keep_all_readings() -> None:
    part = made(at(2.0), {"status": "gap"}, {"status": "break"}, {"status": "gap"}, at(4.0))
    row = only(part)
    assert (row["x"], row["readings"], row["labelled"], row["labelled_share"], row["status"]) == (3.0, 5, 2, 0.4, "ok")
    assert part.readings["x"].to_list() == [2.0, None, None, None, 4.0]
    assert part.readings["floor"].to_list() == [1, None, None, None, 1]


@pytest.mark.parametrize(
    ("causes", "expected"),
    [(("gap", "break", "gap"), "gap"), (("gap", "break"), "break"), (("no_mapping",), "no_mapping")],
)
def test_a_scan_without_label_says_why(causes: tuple[str, ...], expected: str) -> None:
    part = made(*({"status": cause} for cause in causes))
    row = only(part)
    unknown = ("floor", "x", "y", "z", "sigma", "x_median", "y_median", "spread")
    assert {row[name] for name in unknown} == {None}
    assert (row["status"], row["labelled"], row["labelled_share"]) == (expected, 0, 0.0)
    assert counts(part) == {"unlabelled_fingerprints": 1}


def test_repeated_readings_and_those_without_level_are_left_out_and_counted() -> None:
    part = made(at(1.0), {"status": "duplicate"}, at(3.0, rssi_dbm=None), {"status": "duplicate"}, at(5.0))
    assert part.readings["bssid"].to_list() == ["a", "e"]
    assert only(part)["readings"] == 2
    assert counts(part) == {"repeated_readings": 2, "readings_without_level": 1}


def test_a_cached_result_keeps_its_place_and_does_not_pull() -> None:
    old = at(-50.0, time_ns=START_NS - 20 * S)
    part = made(old, at(1.0), at(3.0))
    row = only(part)
    assert (row["x"], row["readings"], row["labelled"]) == (2.0, 3, 3)
    assert row["spread"] == pytest.approx(1.0)
    assert row["start_ns"] == START_NS + S // 10
    assert part.readings["x"].to_list() == [-50.0, 1.0, 3.0]
    assert counts(part) == {"cached_readings": 1}
    long_scan = made(old, at(1.0), at(3.0), settings=DatasetSettings(scan_length_s=30.0))
    assert only(long_scan)["x"] == pytest.approx(-46 / 3)
    assert counts(long_scan) == {}


def test_uncertain_fingerprints_keep_their_position() -> None:
    rows = (at(1.0, sigma=0.8, status="uncertain"), at(3.0, sigma=0.8, status="uncertain"))
    assert [only(made(*rows))[name] for name in ("x", "status")] == [2.0, "uncertain"]
    assert only(made(*rows, limit_m=1.0))["status"] == "ok"
    assert only(made(*rows, limit_m=float("inf")))["status"] == "ok"


def test_scans_are_in_order_of_time_and_their_readings_too() -> None:
    rows = [at(1.0, scan=9), at(2.0, scan=-3), at(3.0, scan=9, time_ns=START_NS - 1), at(4.0, scan=1_234_567)]
    part = made(*rows)
    ids = [f"floor_1.LG.walk/wifi/{number}" for number in ("000009", "-00003", "1234567")]
    assert part.fingerprints["scan_id"].to_list() == ids
    assert part.readings["scan_id"].to_list() == [ids[0], *ids]
    assert part.readings["bssid"].to_list() == ["c", "a", "b", "d"]


def test_windows_of_time_instead_of_scans() -> None:
    rows = [at(float(number), scan=number // 7, time_ns=START_NS + number * S // 4) for number in range(12)]
    part = made(*rows, settings=DatasetSettings(wifi_window_s=1.0))
    assert part.fingerprints["scan_id"].str.tail(6).to_list() == ["000000", "000001", "000002"]
    assert part.fingerprints["x"].to_list() == pytest.approx([1.5, 5.5, 9.5])
    gap = made(at(0.0), at(1.0, time_ns=START_NS + 10 * S), settings=DatasetSettings(wifi_window_s=2.0))
    assert gap.fingerprints["scan_id"].str.tail(6).to_list() == ["000000", "000005"]


def test_names_are_counted_and_a_session_may_be_empty() -> None:
    part = made(at(1.0), at(2.0, bssid="a"), at(3.0, bssid="a", ssid="other"))
    assert part.names.rows() == [("a", "wifi", "net", 2), ("a", "wifi", "other", 1)]
    for settings in (DatasetSettings(), DatasetSettings(wifi_window_s=1.0)):
        empty = made(settings=settings)
        assert len(empty.fingerprints) == len(empty.readings) == len(empty.names) == 0
        assert list(empty.fingerprints.schema.items()) == list(SCHEMAS[FINGERPRINTS].items())
        assert empty.names.schema["count"] == pl.Int64


def test_a_session_of_another_name_has_no_date() -> None:
    walk = SessionWalk("floor_1.LG.walk", "", "LG", "first walk", WALK.motion)
    part = fingerprints_of({"wifi": wifi(at(1.0))}, "wifi", walk, DatasetSettings(), 0.5)
    assert part.fingerprints["date"].to_list() == [None]
