"""Logs of GetSensorData."""

from __future__ import annotations

import datetime as dt
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.estimation.dead_reckoning.walks import START_NS, corners, walked
from tests.sessions.getsensordata import BOOT_S, HEAD, HEAD_LINES, MAC, ORIGIN, OTHER, acce, posi, text, wifi
from vislam2tag.common.errors import SessionError
from vislam2tag.core.status import EventKind
from vislam2tag.estimation.settings import WITHOUT_TRACKER, MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.pipeline.labels.process import process
from vislam2tag.sessions.formats.getsensordata import GetSensorDataLog, looks_like_a_log, parse_log, parse_taps
from vislam2tag.sessions.prepared import SessionTask, prepared_session
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.site.corrections.file import Corrections


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


AHEAD_S = 400.0
WAY = np.add(corners((20, 0), (0, 15), (-10, 0)), (5.0, 5.0))
SITE = f"""[georeference]
latitude_deg = {ORIGIN.latitude_deg}
longitude_deg = {ORIGIN.longitude_deg}
bearing_deg = 0.0

[[floors]]
number = 1
"""


def log_text() -> str:
    """A log of a walk along :data:`WAY`, a mark at each corner, and one on another floor."""
    log, fixes = walked(WAY, noise=0.05)
    at_s = (log.rate_ns - START_NS) * 1e-9
    rows = [
        (at, f"{kind};{at:.3f};{at + AHEAD_S:.3f};{angles}{x:.6f};{y:.6f};{z:.6f};3")
        for kind, angles, values in (
            ("ACCE", "", log.force),
            ("GYRO", "", log.rate),
            ("AHRS", "0;0;0;", log.orientation * np.where(log.orientation[:, 3:] < 0, -1, 1)),
        )
        for at, (x, y, z) in zip(at_s.tolist(), values[:, :3].tolist(), strict=True)
    ]
    marks = zip(((fixes.time_ns - START_NS) * 1e-9).tolist(), fixes.position_bcs.tolist(), strict=True)
    rows += [(at, posi(at, x, y)) for at, (x, y) in marks]
    rows += [(9.0, posi(9.0, 300.0, 300.0, floor=2)), (7.0, f"WIFI;7.000;{AHEAD_S + 5:.3f};net;{MAC};2412;-60")]
    return HEAD + "\n".join(row for _, row in sorted(rows)) + "\n"


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    """A survey of one such log, with a georeference."""
    folder = tmp_path / "survey" / "floor_1" / "SM-A310F" / "walk"
    folder.mkdir(parents=True)
    (folder / "T01.txt").write_text(log_text(), encoding="utf-8")
    (tmp_path / "survey" / "site.toml").write_text(SITE, encoding="utf-8")
    return tmp_path / "survey"


def test_a_log_is_mapped_through_the_marks_of_its_floor(survey: Path, tmp_path: Path) -> None:
    (ref,) = open_survey(survey).sessions
    assert ref.format == "getsensordata"
    summary = process(survey, tmp_path / "out")
    assert (summary.failed, set(summary.frames)) == (0, {"ok"})
    table = pl.read_parquet(next((tmp_path / "out" / "trajectory").glob("*.parquet")))
    corner_ns = round((AHEAD_S + 20 / 1.2) * 1e9)
    at = int(np.argmin(np.abs(table["time_ns"].to_numpy() - corner_ns)))
    assert np.linalg.norm(table.select("x", "y").to_numpy()[at] - WAY[1]) < 0.6
    wifi = pl.read_parquet(next((tmp_path / "out" / "wifi").glob("*.parquet")))
    assert wifi.select("x", "y").row(0) == pytest.approx((5 + 5 * 1.2, 5), abs=0.8)


def test_marks_need_a_georeference_and_their_own_floor(survey: Path) -> None:
    (survey / "site.toml").write_text("[[floors]]\nnumber = 1\n", encoding="utf-8")
    opened = open_survey(survey)
    prepared = prepared_session(SessionTask(opened.sessions[0], opened.site, Corrections()))
    assert [finding.kind for finding in prepared.session.findings] == ["fixes_without_georeference"]
    assert prepared.session.camera.fixes is None
    (survey / "floor_1").rename(survey / "floor_2")
    (survey / "site.toml").write_text(SITE.replace("number = 1", "number = 2"), encoding="utf-8")
    opened = open_survey(survey)
    prepared = prepared_session(SessionTask(opened.sessions[0], opened.site, Corrections()))
    assert [finding.kind for finding in prepared.session.findings] == ["too_few_fixes"]


def test_a_log_without_inertial_readings_is_told(survey: Path) -> None:
    file = next(survey.rglob("T01.txt"))
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True)
    file.write_text("".join(line for line in lines if not line.startswith("GYRO")), encoding="utf-8")
    with pytest.raises(SessionError, match=r"accelerometer or gyroscope readings in T01\.txt are missing"):
        read_session(open_survey(survey).sessions[0])


def test_air_pressure_tells_of_a_rise(survey: Path) -> None:
    (survey / "site.toml").write_text(f"{SITE}elevation_m = 3.5\n", encoding="utf-8")
    file = next(survey.rglob("T01.txt"))
    rises_m = {at: 3.5 * min(max(at - 15, 0) / 8, 1) for at in np.arange(0.0, 37.0, 0.1).tolist()}
    pressure = [f"PRES;{at:.3f};{at + AHEAD_S:.3f};{1000 - 0.12 * rise:.4f};0" for at, rise in rises_m.items()]
    rows = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("%")]
    rows = sorted(rows + pressure, key=lambda row: float(row.split(";")[1]))
    file.write_text(HEAD + "\n".join(rows) + "\n", encoding="utf-8")
    opened = open_survey(survey)
    prepared = prepared_session(SessionTask(opened.sessions[0], opened.site, Corrections()))
    strategy = strategy_named(WITHOUT_TRACKER, MappingSettings())
    walk = strategy.map(prepared.session.camera, prepared.session.landmarks, prepared.landmarks)
    assert np.ptp(walk.position_bcs[:, 2]) == pytest.approx(3.5, abs=0.4)
    assert EventKind.STAIRS in {event.kind for event in walk.events}
