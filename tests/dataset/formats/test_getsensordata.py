"""GetSensorData logs: two clocks, two variants of Wi-Fi rows, degrees to metres."""

from __future__ import annotations

import contextlib
import datetime as dt
import io
import zipfile
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.mutations import exaggerate, mutate
from vislam2tag.common.errors import DatasetError
from vislam2tag.dataset.folder import write_dataset
from vislam2tag.dataset.format_registry import ImportContext, import_format_of
from vislam2tag.dataset.formats.getsensordata.log_file import GetSensorDataLog, parse_log, parse_taps
from vislam2tag.dataset.formats.getsensordata.log_lines import looks_like_a_log
from vislam2tag.dataset.formats.getsensordata.reading import read
from vislam2tag.dataset.model import Dataset
from vislam2tag.survey.georeference import Georeference, to_wgs84

BOOT_S = 5000.25
"""The phone's clock when the app's began."""
HEAD = (
    "% LogFile created by the 'GetSensorData' App for Android.\n"
    "% Date of creation: Thu Jul 07 12:31:03 CEST 2016\n"
    "% Phone used for this logfile:\n"
    "% Manufacturer:            \tsamsung\n"
    "% Model:                   \tSM-A310F\n"
    "% WIFI data: \t'WIFI;AppTimestamp(s);SensorTimeStamp(s);Name_SSID;MAC_BSSID;Frequency;RSS(dBm);'\n"
)
HEAD_LINES = HEAD.count("\n")
ORIGIN = Georeference(latitude_deg=40.3133, longitude_deg=-3.4835)
MAC, OTHER = "00:0b:86:27:36:c1", "00:0b:86:27:36:c2"


def posi(at_s: float, east_m: float, north_m: float, floor: float = 1, building: int = 2) -> str:
    longitude, latitude = to_wgs84(np.array([[east_m, north_m]]), ORIGIN)[0]
    return f"POSI;{at_s:.3f};1;{latitude:.9f};{longitude:.9f};{floor:g};{building}"


def wifi(at_s: float, seen_s: float, rssi: int = -71, mac: str = MAC, ssid: str = "eduroam", new: bool = True) -> str:
    seen = "" if np.isnan(seen_s) else f"{seen_s:.3f}"
    return f"WIFI;{at_s:.3f};{seen};{ssid};{mac};{'2412;' if new else ''}{rssi}"


def acce(at_s: float, boot_s: float = BOOT_S, kind: str = "ACCE") -> str:
    return f"{kind};{at_s:.3f};{at_s + boot_s - 0.005:.3f};0.1;0.2;9.8;3"


def text(*rows: str) -> bytes:
    return (HEAD + "\n".join(rows) + "\n").encode()


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


def test_a_damaged_log_is_read_or_told(tmp_path: Path) -> None:
    data, read_whole = walk(posi(8, 1, 1)).replace(b";", b"; "), 0
    for seed in range(40):
        rng, folder = np.random.default_rng(seed), tmp_path / str(seed)
        folder.mkdir()
        (folder / "log.txt").write_bytes(exaggerate(mutate(data, rng), rng).replace(b"; ", b";"))
        with contextlib.suppress(DatasetError):
            imported(folder / "log.txt", folder)
            read_whole += 1
    assert 0 < read_whole < 40


def walk(*extra: str) -> bytes:
    return text(acce(1), posi(2, 10, 20), wifi(6, BOOT_S + 3.995), wifi(6, BOOT_S + 4.995, mac=OTHER),
                *extra, posi(12, 30, 0), acce(13))  # fmt: skip


def imported(path: Path, tmp_path: Path, origin: tuple[float, float] | None = None) -> Dataset:
    return write_dataset(read(path, ImportContext(tmp_path / "scratch", origin)), tmp_path / "set")


def test_readings_in_metres_from_the_origin(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_bytes(walk())
    assert import_format_of(tmp_path / "log.txt").name == "getsensordata"
    dataset = imported(tmp_path / "log.txt", tmp_path, (ORIGIN.latitude_deg, ORIGIN.longitude_deg))
    rows = dataset.readings.select("x", "y").collect().to_numpy()
    assert rows == pytest.approx(np.array([[14, 16], [16, 14]]), abs=0.005)
    (row,) = dataset.fingerprints.collect().rows(named=True)
    assert (row["building"], row["floor"], row["device"], row["date"]) == (
        "2",
        1,
        "samsung SM-A310F",
        dt.date(2016, 7, 7),
    )
    assert row["scan_id"] == "log/wifi/000001"
    (floor,) = dataset.info.floors
    assert floor.georeference == ORIGIN
    assert dataset.info.sources[0].settings["origin"] == [40.3133, -3.4835]
    (session,) = dataset.sessions.collect().rows(named=True)
    assert session["distance_m"] == pytest.approx(np.hypot(20, 20), abs=0.01)
    assert session["started"] == dt.datetime(2016, 7, 7, 12, 31, 3)


def test_without_an_origin_it_is_the_south_west_corner(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_bytes(text(acce(1), posi(2, 10, 20), wifi(6, BOOT_S + 4), posi(12, 30, 5)))
    dataset = imported(tmp_path / "log.txt", tmp_path)
    assert dataset.info.floors[0].georeference == Georeference(latitude_deg=40.3133, longitude_deg=-3.4834)
    found = dataset.readings.select("x", "y").collect()
    assert found["x"].min() > 0  # type: ignore[operator]
    assert found["y"].min() > 0  # type: ignore[operator]


def test_floors_and_buildings_change_within_a_walk(tmp_path: Path) -> None:
    more = (posi(14, 30, 0, floor=2), wifi(17, BOOT_S + 13.0), wifi(18, BOOT_S + 16.0), posi(20, 30, 9, floor=2))
    (tmp_path / "log.txt").write_bytes(walk() + "\n".join((*more, posi(30, 0, 0, 0, 3))).encode())
    dataset = imported(tmp_path / "log.txt", tmp_path)
    assert [(floor.building, floor.number) for floor in dataset.info.floors] == [("2", 1), ("2", 2), ("3", 0)]
    found = dataset.fingerprints.select("building", "floor", "status").collect().rows()
    assert found == [("2", 1, "ok"), ("", None, "gap"), ("2", 2, "ok")]
    (session,) = dataset.sessions.collect().rows(named=True)
    assert (session["building"], session["floor"]) == ("", None)


def test_a_tap_in_another_town_is_none(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_bytes(walk(posi(9, 20_000, 0)))
    dataset = imported(tmp_path / "log.txt", tmp_path)
    assert [(finding.kind, finding.count) for finding in dataset.info.findings] == [("far_taps", 1)]
    assert dataset.readings.select(pl.col("x").max()).collect().item() < 30


def test_archives_and_folders_of_logs(tmp_path: Path) -> None:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr("training/T02.txt", walk())
        archive.writestr("training/T01.txt", walk())
        archive.writestr("readme.txt", "no log")
    (tmp_path / "ipin.zip").write_bytes(packed.getvalue())
    assert import_format_of(tmp_path / "ipin.zip").name == "getsensordata"
    dataset = imported(tmp_path / "ipin.zip", tmp_path)
    assert dataset.sessions.collect()["session"].to_list() == ["training.T01", "training.T02"]


@pytest.mark.parametrize(
    ("content", "said"),
    [(b"hello", "holds no log"), (text(acce(1)), "no log has a POSI row")],
)
def test_wrong_files_are_told(tmp_path: Path, content: bytes, said: str) -> None:
    (tmp_path / "a.txt").write_bytes(content)
    with pytest.raises(DatasetError, match=said):
        read(tmp_path, ImportContext(tmp_path / "scratch"))
