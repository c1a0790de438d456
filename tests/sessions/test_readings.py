"""Readings of sensors, Wi-Fi and Bluetooth."""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path

import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.sessions.raw import START_NS, clean_files, count_lines, frame_ns, kinds, read_files, to_bytes, wifi_line
from vislam2tag.common.findings import Finding
from vislam2tag.intake.readings import admitted
from vislam2tag.sessions.corrected import corrected_session
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.readings import (
    BEACON,
    BLE_LINES,
    SENSOR_SCHEMA,
    WIFI_LINES,
    ble_findings,
    mark_repeated,
    mark_wifi,
    median_scan_interval_s,
    repeated_scans,
    scan_numbers,
    sensor_table,
    wifi_findings,
    with_sensor_units,
)
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import LineTable, RawTable
from vislam2tag.site.corrections.file import Corrections, ShiftClock


def table_of(readings: list[tuple[int, str]], first_value: float = 0.5) -> tuple[pl.DataFrame, dict[str, Finding]]:
    rows = [(i + 1, t, name, first_value, 0.0, 0.0, 0.0, 0.0, 0.0) for i, (t, name) in enumerate(readings)]
    frame = pl.DataFrame(rows, schema={"row": pl.Int64, **SENSOR_SCHEMA}, orient="row")
    table, findings = sensor_table(frame, "sensors.csv")
    return table, {finding.kind: finding for finding in findings}


def test_accelerations_in_g_and_turn_rates_in_degrees_are_converted() -> None:
    values = {"ACC": (0.0, 1.0, 0.0), "GYRO_UN": (0.0, 0.0, 90.0), "MAG": (1.0, 0.0, 0.0)}
    rows = [(i, i, name, *values[name], 0.0, 0.0, 0.0) for i, name in enumerate(list(values) * 100)]
    frame = pl.DataFrame(rows, schema={"row": pl.Int64, **SENSOR_SCHEMA}, orient="row")
    table, findings = with_sensor_units(frame, "sensors.csv")
    assert table.row(0)[3:6] == pytest.approx((0.0, 9.80665, 0.0))
    assert table.row(1)[3:6] == pytest.approx((0.0, 0.0, math.pi / 2))
    assert table.row(2)[3:6] == (1.0, 0.0, 0.0)
    assert [(one.kind, one.count) for one in findings] == [("sensor_unit", 100)] * 2
    assert with_sensor_units(table, "sensors.csv")[1] == []


def test_columns_are_in_the_order_of_the_contract() -> None:
    table, findings = table_of([(10, "ACC"), (10, "GYRO")])
    assert table.columns == ["row", "time_ns", "repeated", "sensor", "v1", "v2", "v3", "v4", "v5", "v6"]
    assert not table["repeated"].any()
    assert not findings


def test_sensors_may_interleave_out_of_order() -> None:
    _, findings = table_of([(10, "ACC"), (8, "GYRO"), (20, "ACC"), (18, "GYRO")])
    assert not findings


def test_repeated_and_backward_readings_of_one_sensor_are_reported_and_kept() -> None:
    table, findings = table_of([(10, "ACC"), (10, "ACC"), (20, "ACC"), (15, "ACC"), (10, "ACC"), (10, "GYRO")])
    assert table["repeated"].to_list() == [False, True, False, False, True, False]
    assert findings["repeated_rows"].lines == (2, 5)
    assert findings["backward_times"].lines == (4,)


def test_values_that_are_not_finite_are_kept_and_reported() -> None:
    table, findings = table_of([(10, "ACC"), (20, "ACC")], math.inf)
    assert table["v1"].to_list() == [math.inf, math.inf]
    assert findings["non_finite_values"].lines == (1, 2)


@given(st.lists(st.tuples(st.integers(0, 12), st.sampled_from(("ACC", "GYRO"))), max_size=40))
def test_repeated_agrees_with_a_plain_reading(readings: list[tuple[int, str]]) -> None:
    table, _ = table_of(readings)
    assert table["repeated"].to_list() == [reading in readings[:i] for i, reading in enumerate(readings)]


def session_with(tmp_path: Path, readings: list[tuple[int, str]]) -> Session:
    files = clean_files()
    rows = [f"{START_NS + at}; PRESSURE; {value}; 0.0; 0.0; 0.0; 0.0; 0.0" for at, value in readings]
    files["sensors.csv"] += rows
    return read_files(tmp_path / "LG" / "walk", files)


def test_pressure_rows_are_the_cameras_barometer_in_time_order(tmp_path: Path) -> None:
    odd = [(40, "NaN"), (50, "0.0"), (30, "1001.75")]
    session = session_with(tmp_path, [(20, "1001.5"), (10, "1001.25"), *odd, (30, "999.0")])
    pressure = session.camera.pressure
    assert pressure is not None
    assert (pressure.time_ns - START_NS).tolist() == [10, 20, 30]
    assert pressure.pressure_hpa.tolist() == [1001.25, 1001.5, 1001.75]
    assert (session.tables["sensors"]["sensor"] == "PRESSURE").sum() == 6


@pytest.mark.parametrize("readings", [[], [(10, "1001.5")], [(10, "1001.5"), (20, "7.0")]])
def test_fewer_than_two_readings_are_none(tmp_path: Path, readings: list[tuple[int, str]]) -> None:
    assert session_with(tmp_path, readings).camera.pressure is None


def test_a_shifted_clock_shifts_the_barometer(tmp_path: Path) -> None:
    session = session_with(tmp_path, [(10, "1001.5"), (20, "1001.6")])
    shift = Corrections(shift_clock=(ShiftClock(table="sensors", offset_s=-1.0),))
    pressure = corrected_session(session, shift)[0].camera.pressure
    assert pressure is not None
    assert (pressure.time_ns - START_NS).tolist() == [10 - 10**9, 20 - 10**9]


def parse(*lines: str) -> RawTable:
    return WIFI_LINES.read(to_bytes(list(lines)), "wifi.csv")


def test_columns_units_and_types() -> None:
    table = parse("3; 41001830793; WLAN; eduroam; f5:81:c1:90:2d:83; -73")
    assert table.rows.row(0, named=True) == {
        "row": 1,
        "time_ns": 41_001_830_793_000,
        "scan": 3,
        "bssid": "f5:81:c1:90:2d:83",
        "ssid": "eduroam",
        "rssi_dbm": -73.0,
        "frequency_mhz": None,
    }
    assert table.rows.schema == {
        "row": pl.Int64,
        "time_ns": pl.Int64,
        "scan": pl.Int32,
        "bssid": pl.String,
        "ssid": pl.String,
        "rssi_dbm": pl.Float32,
        "frequency_mhz": pl.Float32,
    }


@pytest.mark.parametrize(
    "ssid",
    ["", " ", "a;b", ";", "; ; ;", "1; 2; WLAN; x; 00:11; -50", "A, B", 'say "hi"', "Bücher 📚", "#x", "\t", "\ufffd"],
)
def test_an_ssid_may_be_anything(ssid: str) -> None:
    for separator, newline in product(("; ", ";"), ("\n", "\r\n")):
        line = wifi_line(1, 0, "SSID").replace("; ", separator).replace("SSID", ssid)
        table = WIFI_LINES.read(f"{line}{newline}".encode(), "wifi.csv")
        assert table.rows["ssid"].to_list() == [ssid]
        assert table.rows["bssid"].to_list() == ["aa:bb:cc:dd:ee:00"]
        assert not table.findings


def test_levels_that_no_radio_measures_are_null_and_reported() -> None:
    levels = ("-60,5", "NaN", "Infinity", "-inf", "1e60", "-1e39", "-1001", "-127,5", "0")
    table = parse(*(f"1; {i}; WLAN; n; aa; {level}" for i, level in enumerate(levels)))
    rows, findings = admitted(table.rows, "bssid", "wifi.csv")
    assert rows["rssi_dbm"].to_list() == [-60.5, None, None, None, None, None, None, None, None]
    assert rows.schema["rssi_dbm"] == pl.Float32
    assert [(finding.kind, finding.count, finding.lines) for finding in findings] == [
        ("absurd_levels", 8, (2, 3, 4, 5, 6))
    ]
    assert not table.unreadable
    assert not table.findings


def test_undecodable_bytes_are_replaced_and_reported() -> None:
    lines = [wifi_line(1, 0), wifi_line(1, 1, "caf??"), wifi_line(1, 2, "\ufffd")]
    table = WIFI_LINES.read(to_bytes(lines).replace(b"caf??", b"caf\xe9\xff"), "wifi.csv")
    assert table.rows["ssid"].to_list() == ["eduroam", "caf\ufffd\ufffd", "\ufffd"]
    assert [(finding.kind, finding.lines) for finding in table.findings] == [("undecodable_text", (2,))]


def test_stale_rows_are_marked_across_scans_and_reported() -> None:
    fresh = [wifi_line(1, reading) for reading in range(3)]
    stale = ["2" + line[1:] for line in fresh[:2]]
    rows = mark_repeated(parse(*fresh, *stale, wifi_line(2, 0)).rows, "bssid")
    assert rows["repeated"].to_list() == [False, False, False, True, True, False]
    findings = wifi_findings(rows, "wifi.csv", FindingSettings())
    assert [(finding.kind, finding.lines) for finding in findings] == [("stale_wifi_rows", (4, 5))]


def test_one_access_point_at_two_times_and_two_at_one_time_are_not_stale() -> None:
    lines = ("1; 5; WLAN; n; aa; -50", "1; 5; WLAN; n; bb; -50", "1; 6; WLAN; n; aa; -50")
    assert not mark_repeated(parse(*lines).rows, "bssid")["repeated"].any()


def scans_every(interval_s: float, count: int = 5) -> pl.DataFrame:
    time_us = [START_NS // 1000 + round(scan * interval_s * 1e6) for scan in range(count)]
    lines = [f"{scan}; {t + late}; WLAN; n; {late:02x}; -50" for scan, t in enumerate(time_us) for late in (700, 0)]
    return mark_repeated(parse(*lines).rows, "bssid")


def test_throttled_scanning_is_reported_with_its_interval() -> None:
    assert median_scan_interval_s(scans_every(30.0)) == pytest.approx(30.0)
    (finding,) = wifi_findings(scans_every(30.0), "wifi.csv", FindingSettings())
    assert finding.kind == "scan_throttling"
    assert finding.count == 5
    assert "30.0 s" in finding.message
    assert not wifi_findings(scans_every(4.0), "wifi.csv", FindingSettings())


def test_one_scan_has_no_interval() -> None:
    assert median_scan_interval_s(scans_every(30.0, count=1)) is None
    assert median_scan_interval_s(scans_every(30.0, count=0)) is None


UUID = "32ff6e37-9a5b-457c-a5f3-bf91dfa4426e"
SENDER = "c2:ca:b5:46:df:bb"


def parsed_ble(*lines: str) -> RawTable:
    return BLE_LINES.read(to_bytes(list(lines)), "ble.csv")


def test_columns_units_and_types_of_bluetooth() -> None:
    table = parsed_ble(f"41001830793000; {SENDER}; desk 3; -73; {UUID.upper()}; 1; 65535")
    assert table.rows.row(0, named=True) == {
        "row": 1,
        "time_ns": 41_001_830_793_000,
        "address": SENDER,
        "name": "desk 3",
        "uuid": UUID,
        "major": 1,
        "minor": 65535,
        "rssi_dbm": -73.0,
    }
    assert table.rows.schema["rssi_dbm"] == pl.Float32
    assert table.rows.schema["major"] == pl.Int32
    assert not table.findings


def test_a_name_may_be_anything() -> None:
    names = ["", " ", "a;b", ";", "x; -70", "5; aa; y; -60", "Bücher 📚", "\ufffd", "A, B"]
    for name, identity, separator in product(names, ["", f"; {UUID}; 3; 4", "; ; ; "], ["; ", ";"]):
        line = f"7; {SENDER}; NAME; -60{identity}".replace("; ", separator).replace("NAME", name)
        for newline in ("\n", "\r\n"):
            table = BLE_LINES.read(f"{line}{newline}".encode(), "ble.csv")
            minor = 4 if UUID in identity else None
            assert table.rows.select("name", "rssi_dbm", "minor").rows() == [(name, -60.0, minor)], line
            assert not table.findings


WIFI_FAULTS = (
    "",
    "1; 5; WLAN; aa:bb; -50",
    "1; 5; WLAN; net; aa:bb",
    "1; 5; WLAN; net; aa:bb; ",
    "1; 5; GSM; net; aa:bb; -50",
    "x; 5; WLAN; net; aa:bb; -50",
    "1; -5; WLAN; net; aa:bb; -50",
    "1; 5.5; WLAN; net; aa:bb; -50",
    "1; 9223372036854776; WLAN; net; aa:bb; -50",
    "99999999999; 5; WLAN; net; aa:bb; -50",
    "1; 5; WLAN; net; aa:bb; loud",
    "1, 5, WLAN, net, aa:bb, -50",
)
BLE_FAULTS = (
    "",
    "7",
    f"7; {SENDER}; name",
    f"-7; {SENDER}; name; -60",
    f"7.5; {SENDER}; name; -60",
    f"7; {SENDER}; name; loud",
    f"7; {SENDER}; name; -60; {UUID}; 3; ",
    f"7; {SENDER}; name; -60; {UUID}; 3; 65536",
    f"{2**63}; {SENDER}; name; -60",
)


@pytest.mark.parametrize(
    ("table", "good", "line"),
    [(WIFI_LINES, wifi_line(1, 0), line) for line in WIFI_FAULTS]
    + [(BLE_LINES, f"1; {SENDER}; a; -50", line) for line in BLE_FAULTS],
)
def test_lines_that_are_no_reading_are_counted_and_left_out(table: LineTable, good: str, line: str) -> None:
    found = table.read(to_bytes([good, line, good]), "file.csv")
    assert found.rows["row"].to_list() == [1, 3]
    assert [(finding.kind, finding.lines) for finding in found.findings] == [("malformed_lines", (2,))]
    assert (found.lines, found.unreadable) == (3, (2,))


def test_undecodable_names_and_cut_lines() -> None:
    data = f"1; {SENDER}; ".encode() + b"\xff; -50\n" + f"2; {SENDER}; a; -5".encode()[:-4]
    table = BLE_LINES.read(data, "ble.csv")
    assert table.rows["name"].to_list() == ["\ufffd"]
    assert {finding.kind for finding in table.findings} == {"undecodable_text", "partial_last_line"}
    assert table.lines == count_lines(data)


def test_an_advertisement_counts_once() -> None:
    rows = mark_repeated(
        parsed_ble(
            f"1; {SENDER}; a; -50",
            f"1; {SENDER}; a; -52",
            f"2; {SENDER}; a; -50",
            f"1; {SENDER}; a; -50; {UUID}; 1; 1",
            "1; aa; a; -50",
        ).rows,
        *BEACON,
    )
    assert rows["repeated"].to_list() == [False, True, False, False, False]
    assert [(finding.kind, finding.lines) for finding in ble_findings(rows, "ble.csv")] == [("repeated_rows", (2,))]
    assert ble_findings(rows.filter(~pl.col("repeated")), "ble.csv") == []


@pytest.mark.parametrize("name", ["ble.csv", "Ble.csv"])
def test_a_session_has_the_table_only_where_it_was_logged(tmp_path: Path, name: str) -> None:
    lines = [f"{frame_ns(frame)}; {SENDER}; a; -50" for frame in range(5)]
    logged = read_files(tmp_path / "LG" / "with", clean_files() | {name: lines})
    assert len(logged.tables["ble"]) == 5
    assert [(record.name, record.role, record.rows) for record in logged.files if record.role == "ble"] == [
        (name, "ble", 5)
    ]
    assert "ble" not in read_files(tmp_path / "LG" / "without", clean_files()).tables


def test_problems_of_the_file_are_told(tmp_path: Path) -> None:
    other_clock = read_files(tmp_path / "LG" / "a", clean_files() | {"ble.csv": [f"5; {SENDER}; a; -50"]})
    assert kinds(other_clock)["clock_mismatch", "ble.csv"] == 1
    empty = read_files(tmp_path / "LG" / "b", clean_files() | {"ble.csv": []})
    assert kinds(empty)["empty_file", "ble.csv"] == 1
    assert empty.tables["ble"].height == 0


def scans(*levels: list[float]) -> pl.DataFrame:
    """One scan for each list of levels, of access points a, b, ..., 4 s apart; rows out of order."""
    rows = [
        {"scan": number, "time_ns": number * 4_000_000_000 + i, "bssid": "abcdefgh"[i], "rssi_dbm": level}
        for number, of in enumerate(levels)
        for i, level in enumerate(of)
    ]
    return pl.DataFrame(rows).with_columns(repeated=False).reverse()


def test_scans_with_the_levels_of_the_scan_before() -> None:
    one, other = [-50.0, -60.0, -70.0, -80.0], [-50.0, -60.0, -70.0, -81.0]
    assert repeated_scans(scans(one, one, other, one, one, one)) == [1, 4, 5]


def test_stale_scans_are_not_used_whatever_their_times() -> None:
    one, other = [-50.0, -60.0, -70.0, -80.0], [-50.0, -60.0, -70.0, -81.0]
    marked = mark_wifi(scans(one, one, other, other, one).with_row_index("row", offset=1))
    assert marked.filter("repeated")["scan"].unique().sort().to_list() == [1, 3]
    assert mark_wifi(marked).equals(marked)
    findings = wifi_findings(marked, "wifi.csv", FindingSettings())
    assert [(finding.kind, finding.count, finding.lines) for finding in findings] == [("stale_scans", 2, (5, 13))]
    assert median_scan_interval_s(marked) == 8.0


def test_a_few_access_points_may_be_alike_by_chance() -> None:
    assert repeated_scans(scans([-50.0, -60.0], [-50.0, -60.0])) == []


SECOND = 10**9


def numbered(times: list[float], points: str, said: list[str] | None = None) -> list[int]:
    time_ns = pl.Series([round(time * SECOND) for time in times], dtype=pl.Int64)
    return scan_numbers(time_ns, pl.Series(list(points)), None if said is None else pl.Series(said)).to_list()


def test_scans_are_numbered_by_their_column_also_if_it_starts_again() -> None:
    assert numbered([0, 0.5, 4, 4.2], "abab", ["7", "7", "8", "8"]) == [1, 1, 2, 2]
    assert numbered([4, 0, 4.2, 0.5], "aabb", ["b", "x", "b", "x"]) == [2, 1, 2, 1], "names in the order of time"
    again = numbered([0, 0.5, 4, 100, 100.5, 104], "abaaba", ["1", "1", "2", "1", "1", "2"])
    assert len(set(again)) == 4
    assert again[0] == again[1] < again[2] < again[3] == again[4] < again[5]


def test_scans_without_a_column_are_of_one_time_or_end_with_a_gap() -> None:
    assert numbered([0, 0, 4, 4], "abab") == [1, 1, 2, 2]
    assert numbered([0, 0.2, 0.4, 4, 4.3], "abcab") == [1, 1, 1, 2, 2]
    stream = numbered([0.1 * number for number in range(40)], "ab" * 20)
    assert stream == [1 + number // 2 for number in range(40)], "no access point is twice in a scan"
