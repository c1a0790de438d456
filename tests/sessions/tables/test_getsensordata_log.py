"""GetSensorData logs: two clocks, two variants of Wi-Fi rows."""

from __future__ import annotations

import datetime as dt

import polars as pl
import pytest

from tests.sessions.getsensordata import BOOT_S, HEAD_LINES, MAC, OTHER, acce, posi, text, wifi
from vislam2tag.sessions.tables.getsensordata_lines import looks_like_a_log
from vislam2tag.sessions.tables.getsensordata_log import GetSensorDataLog, parse_log, parse_taps


def parsed(*rows: str) -> GetSensorDataLog:
    return parse_log(text(*rows), "log.txt")


def kinds(log: GetSensorDataLog) -> dict[str, tuple[int, ...]]:
    return {finding.kind: tuple(line - HEAD_LINES for line in finding.lines) for finding in log.findings}


def ns(seconds: float) -> int:
    return round(seconds * 1e9)


def test_a_wifi_result_has_the_time_when_it_was_received_on_the_phones_clock() -> None:
    log = parsed(acce(1), acce(2), posi(3, 0, 0), wifi(4, BOOT_S + 2.5), acce(5))
    assert log.tables["wifi"]["time_ns"].to_list() == [ns(BOOT_S + 2.5)]
    assert log.taps.time_ns.tolist() == [pytest.approx(ns(BOOT_S + 3 - 0.005), abs=2)]
    assert log.tables["sensors"]["time_ns"].to_list() == pytest.approx(
        [ns(BOOT_S + t - 0.005) for t in (1, 2, 5)], abs=2
    )
    assert not log.findings


@pytest.mark.parametrize("new", [True, False])
def test_both_variants_of_wifi_rows(new: bool) -> None:
    row = parsed(wifi(4, 3.5, new=new), wifi(4, 3.6, mac=OTHER, new=not new)).tables["wifi"].rows(named=True)
    assert [(each["rssi_dbm"], each["ssid"]) for each in row] == [(-71.0, "eduroam")] * 2
    assert [each["frequency_mhz"] for each in row] == ([2412.0, None] if new else [None, 2412.0])


@pytest.mark.parametrize("ssid", ["", "a;b", "x;00:00:00:00:00:01;5180", "  ", 'q"q', "% no comment"])
def test_names_of_networks_hold_anything(ssid: str) -> None:
    row = parsed(wifi(4, 3.5, ssid=ssid)).tables["wifi"].row(0, named=True)
    assert (row["ssid"], row["bssid"], row["frequency_mhz"]) == (ssid, MAC, 2412.0)


def test_a_scan_is_what_was_written_at_one_time_and_old_results_count_once() -> None:
    table = parsed(acce(1), wifi(4, BOOT_S + 2), wifi(4, BOOT_S + 3, mac=OTHER), wifi(8, BOOT_S + 2)).tables["wifi"]
    assert table["scan"].to_list() == [1, 1, 2]
    assert table["repeated"].to_list() == [False, False, True]


@pytest.mark.parametrize("seen_s", [0.0, 12.0, BOOT_S + 9, float("nan")])
def test_a_sensor_time_on_another_clock_is_a_finding(seen_s: float) -> None:
    log = parsed(acce(1), wifi(4, seen_s), acce(5))
    assert log.tables["wifi"]["time_ns"].to_list() == pytest.approx([ns(BOOT_S + 4 - 0.005)], abs=2)
    assert kinds(log) == {"unusable_sensor_time": (2,)}


def test_a_sensor_that_counts_from_elsewhere_is_shifted() -> None:
    log = parsed(acce(1), acce(2), acce(1, boot_s=77, kind="MAGN"), acce(2, boot_s=77, kind="MAGN"))
    magnetic = log.tables["sensors"].filter(pl.col("sensor") == "MAG")
    assert magnetic["time_ns"].to_list() == pytest.approx([ns(BOOT_S + t - 0.005) for t in (1, 2)], abs=2)


def test_a_log_without_sensors_takes_the_clock_of_the_freshest_wifi_result() -> None:
    log = parsed(posi(0, 0, 0), wifi(4, BOOT_S + 3.9), wifi(4, BOOT_S + 2, mac=OTHER))
    assert log.taps.time_ns.tolist() == [ns(BOOT_S - 0.1)]
    assert parsed(posi(7, 0, 0)).taps.time_ns.tolist() == [ns(7)]


def test_angles_become_the_rotation_vector() -> None:
    log = parsed("AHRS;1.000;5001.250;10;20;30;0.1;0.2;0.3;3")
    assert log.tables["sensors"].select("sensor", "v1", "v2", "v3", "v4").rows() == [("ROT", 0.1, 0.2, 0.3, 0.0)]


def test_beacons() -> None:
    uuid = "74278bda-b644-4520-8f0c-720eaf059935"
    log = parsed(
        f"BLE4;1.000;iBeacon;{MAC};-80;-59;7;8;{uuid}",
        f"BLE4;2.000;iBeacon;{MAC};-81;7;8;",
        f"BLE4;3.000;Eddystone;{MAC};-82;00112233;3000;21;5;6",
    )
    assert log.tables["ble"].select("bssid", "rssi_dbm").rows() == [(f"{uuid}-7-8", -80), (MAC, -81), (MAC, -82)]
    assert not log.findings


def test_lines_that_do_not_parse_are_counted_and_rows_of_other_sensors_are_not() -> None:
    log = parsed("PRES;1;2;950.2;0", "", "WIFI;1;2;net;nomac;-70", "ACCE;1;2;3;4", "nonsense", "% comment", "SOUN;1;x")
    assert kinds(log) == {"malformed_lines": (3, 4, 5)}
    cut = parse_log(text(acce(1))[:-12], "log.txt")
    assert kinds(cut) == {"partial_last_line": (1,)}


def test_windows_lines_and_bytes_that_are_no_text() -> None:
    data = text(wifi(4, 3.5, ssid="net")).replace(b"\n", b"\r\n").replace(b"net", b"n\xfft")
    assert parse_log(data, "log.txt").tables["wifi"]["ssid"].to_list() == ["n\ufffdt"]


def test_taps_that_name_no_place_are_findings() -> None:
    rows = (posi(1, 5, 5), "POSI;2.0;2;0.00000000;0.00000000;0;0", posi(3, 5, 5, floor=1.5), "POSI;4;1;95;3;0;0")
    log = parsed(*rows)
    assert log.taps.app_s.tolist() == [1.0]
    assert kinds(log) == {"unplaced_taps": (2, 3, 4)}
    assert parse_taps(text(*rows)).app_s.tolist() == [1.0]


def test_what_follows_a_reset_of_the_apps_clock_is_left_out() -> None:
    log = parsed(posi(1, 0, 0), posi(9, 5, 5), wifi(8.9, 1), wifi(0.1, 1), posi(2, 0, 0))
    assert log.taps.app_s.tolist() == [1.0, 9.0]
    assert kinds(log)["clock_reset"] == (4, 5)


def test_a_single_row_whose_time_is_ahead_costs_only_itself() -> None:
    log = parsed(posi(1, 0, 0), acce(99_999), acce(2), posi(9, 5, 5), acce(8.9995), acce(10))
    assert kinds(log) == {"odd_times": (2,)}
    assert log.taps.app_s.tolist() == [1.0, 9.0]
    assert log.tables["sensors"].height == 3


def test_header() -> None:
    log = parsed(acce(1))
    assert log.device == "samsung SM-A310F"
    assert log.started == dt.datetime(2016, 7, 7, 12, 31, 3)
    old = parse_log(
        b"% The model of device:  GT-I9505\n% The Manufacturer:     samsung\n" + acce(1).encode(), "log.txt"
    )
    assert (old.device, old.started) == ("samsung GT-I9505", None)
    odd = b"% Date of creation: Thu Jul 99999999999 12:31:03 CEST 2016\n" + acce(1).encode()
    assert parse_log(odd, "log.txt").started is None


@pytest.mark.parametrize("data", [b"", b"\n\n", b"% only a comment\n", b"\xff\xfe\x00"])
def test_nothing_breaks_it(data: bytes) -> None:
    log = parse_log(data, "log.txt")
    assert all(table.is_empty() for table in log.tables.values())
    assert not looks_like_a_log(data)
