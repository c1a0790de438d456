from __future__ import annotations

from itertools import product

import polars as pl
import pytest

from tests.sessions.raw import START_NS, to_bytes, wifi_line
from vislam2tag.intake.readings import admitted
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tables.raw_table import RawTable
from vislam2tag.sessions.tables.wifi_table import mark_repeated, median_scan_interval_s, parse_wifi, wifi_findings


def parse(*lines: str) -> RawTable:
    return parse_wifi(to_bytes(list(lines)), "wifi.csv")


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
        table = parse_wifi(f"{line}{newline}".encode(), "wifi.csv")
        assert table.rows["ssid"].to_list() == [ssid]
        assert table.rows["bssid"].to_list() == ["aa:bb:cc:dd:ee:00"]
        assert not table.findings


def test_separators_without_blank() -> None:
    assert parse("1;5;WLAN;net;aa:bb;-50").rows.select("time_ns", "ssid", "bssid", "rssi_dbm").row(0) == (
        5000,
        "net",
        "aa:bb",
        -50.0,
    )


@pytest.mark.parametrize(
    "line",
    [
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
    ],
)
def test_lines_that_are_no_reading(line: str) -> None:
    table = parse(wifi_line(1, 0), line, wifi_line(1, 1))
    assert table.unreadable == (2,)
    assert table.rows["row"].to_list() == [1, 3]


def test_levels_that_no_radio_measures_are_null_and_reported() -> None:
    levels = ("-60", "NaN", "Infinity", "-inf", "1e60", "-1e39", "-1001", "-127,5", "0")
    table = parse(*(f"1; {i}; WLAN; n; aa; {level}" for i, level in enumerate(levels)))
    rows, findings = admitted(table.rows, "bssid", "wifi.csv")
    assert rows["rssi_dbm"].to_list() == [-60.0, None, None, None, None, None, None, None, None]
    assert rows.schema["rssi_dbm"] == pl.Float32
    assert [(finding.kind, finding.count, finding.lines) for finding in findings] == [
        ("absurd_levels", 8, (2, 3, 4, 5, 6))
    ]
    assert not table.unreadable
    assert not table.findings


def test_undecodable_bytes_are_replaced_and_reported() -> None:
    lines = [wifi_line(1, 0), wifi_line(1, 1, "caf??"), wifi_line(1, 2, "\ufffd")]
    table = parse_wifi(to_bytes(lines).replace(b"caf??", b"caf\xe9\xff"), "wifi.csv")
    assert table.rows["ssid"].to_list() == ["eduroam", "caf\ufffd\ufffd", "\ufffd"]
    assert [(finding.kind, finding.lines) for finding in table.findings] == [("undecodable_text", (2,))]


def test_stale_rows_are_marked_across_scans_and_reported() -> None:
    fresh = [wifi_line(1, reading) for reading in range(3)]
    stale = ["2" + line[1:] for line in fresh[:2]]
    rows = mark_repeated(parse(*fresh, *stale, wifi_line(2, 0)).rows)
    assert rows["repeated"].to_list() == [False, False, False, True, True, False]
    findings = wifi_findings(rows, "wifi.csv", FindingSettings())
    assert [(finding.kind, finding.lines) for finding in findings] == [("stale_wifi_rows", (4, 5))]


def test_one_access_point_at_two_times_and_two_at_one_time_are_not_stale() -> None:
    lines = ("1; 5; WLAN; n; aa; -50", "1; 5; WLAN; n; bb; -50", "1; 6; WLAN; n; aa; -50")
    assert not mark_repeated(parse(*lines).rows)["repeated"].any()


def scans_every(interval_s: float, count: int = 5) -> pl.DataFrame:
    time_us = [START_NS // 1000 + round(scan * interval_s * 1e6) for scan in range(count)]
    lines = [f"{scan}; {t + late}; WLAN; n; {late:02x}; -50" for scan, t in enumerate(time_us) for late in (700, 0)]
    return mark_repeated(parse(*lines).rows)


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
