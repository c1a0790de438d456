"""Recordings of Sensor Logger, with the columns and units of its documentation, Android's and iOS's."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.sessions.companion_walks import METADATA
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import format_of, hash_inputs, read_session
from vislam2tag.site.model import SessionKey, SessionRef

START_NS = 1_700_000_000_000_000_000
TIMES = [START_NS + i * 10_000_000 for i in range(40)]


def ref_of(folder: Path) -> SessionRef:
    return SessionRef(SessionKey(1, "Pixel", "walk"), folder, "sensor-logger", "slug")


def write(folder: Path, name: str, header: str, *lines: str) -> None:
    (folder / name).write_text("\n".join((f"time,seconds_elapsed,{header}", *lines)) + "\n", encoding="utf-8")


def recording(folder: Path, platform: str, standardised: bool = False) -> Session:
    text = METADATA.format(platform=platform)
    (folder / "Metadata.csv").write_text(text.replace("false", str(standardised).lower()), encoding="utf-8")
    write(folder, "Gyroscope.csv", "z,y,x", *(f"{t},0,0.3,0.2,0.1" for t in TIMES))
    sign = -1 if platform == "ios" and not standardised else 1
    write(folder, "Accelerometer.csv", "z,y,x", *(f"{t},0,{sign * 0.5},0,0" for t in TIMES))
    write(folder, "Gravity.csv", "z,y,x", *(f"{t},0,{sign * 9.80665},0,0" for t in TIMES))
    assert format_of(folder) == "sensor-logger"
    return read_session(ref_of(folder))


@pytest.mark.parametrize(("platform", "standardised"), [("android", False), ("ios", False), ("ios", True)])
def test_accelerations_get_their_gravity_again_upwards_at_rest(
    platform: str, standardised: bool, tmp_path: Path
) -> None:
    sensors = recording(tmp_path, platform, standardised).tables["sensors"]
    force = sensors.filter(sensor="ACC").select("v1", "v2", "v3").to_numpy()
    np.testing.assert_allclose(force, np.tile((0, 0, 10.30665), (40, 1)), atol=1e-9)
    turns = sensors.filter(sensor="GYRO").select("v1", "v2", "v3").to_numpy()
    np.testing.assert_allclose(turns, np.tile((0.1, 0.2, 0.3), (40, 1)))
    assert sensors["time_ns"].min() == START_NS


def test_radio_readings_pressure_and_annotations(tmp_path: Path) -> None:
    recording(tmp_path, "android")
    write(tmp_path, "TotalAcceleration.csv", "z,y,x", *(f"{t},0,9.8,0,0" for t in TIMES))
    write(tmp_path, "Barometer.csv", "relativeAltitude,pressure", *(f"{t},0,0,1001.5" for t in TIMES))
    wifi = [f'{START_NS + scan},0,"a, b",AA:BB:CC:00:11:22,5180,{-50 - scan},[ESS]' for scan in (1, 2)]
    write(tmp_path, "WiFi.csv", "ssid,bssid,frequency,level,capabilities", *wifi, "half a line")
    write(tmp_path, "Bluetooth.csv", "id,rssi,manufacturerData", f"{START_NS},0,C2:00:00:00:00:01,-70,ff")
    write(tmp_path, "Annotation.csv", "text,millisecond_press_duration", f"{START_NS + 5},0,door,12")
    session = read_session(ref_of(tmp_path))
    assert session.tables["wifi"].select("scan", "bssid", "ssid", "rssi_dbm").rows() == [
        (1, "aa:bb:cc:00:11:22", "a, b", -51.0), (2, "aa:bb:cc:00:11:22", "a, b", -52.0)
    ]  # fmt: skip
    assert session.tables["ble"]["rssi_dbm"].to_list() == [-70.0]
    assert session.presses_ns.tolist() == [START_NS + 5]
    assert session.tables["sensors"].filter(sensor="PRESSURE")["v1"][0] == 1001.5
    assert session.tables["sensors"].filter(sensor="ACC")["v3"][0] == 9.8, "what was measured counts"
    found = {each.kind: each for each in session.findings}
    assert found["malformed_lines"].lines == (4,)
    assert "vislam2tag attach" in found["no_frames"].message
    assert hash_inputs(ref_of(tmp_path)) == {file.name: file.sha256 for file in session.files}


def test_advertisements_of_single_devices_get_their_names(tmp_path: Path) -> None:
    write(tmp_path, "Metadata.csv", "platform")
    for last in ("01", "02"):
        rows = [f"{START_NS + i},0,-7{i},C2:00:00:00:00:{last}" for i in range(3)]
        write(tmp_path, f"bluetooth-C200000000{last}.csv", "rssi,id", *rows)
    assert format_of(tmp_path) == "sensor-logger"
    write(tmp_path, "BluetoothMetadata.csv", "id,name", f"{START_NS},0,C2:00:00:00:00:02,beacon")
    session = read_session(ref_of(tmp_path))
    ble = session.tables["ble"]
    assert ble["rssi_dbm"].to_list() == [-70, -71, -72] * 2
    assert ble["name"].to_list() == [""] * 3 + ["beacon"] * 3
    assert hash_inputs(ref_of(tmp_path)) == {file.name: file.sha256 for file in session.files}


@pytest.mark.parametrize("packed", [False, True])
def test_files_that_are_not_read_are_named_once(tmp_path: Path, packed: bool) -> None:
    folder = tmp_path / "walk"
    folder.mkdir()
    recording(folder, "android")
    for usual in ("Battery.csv", "Location.csv", "truth.csv"):
        write(folder, usual, "x")
    assert "unread_file" not in {each.kind for each in read_session(ref_of(folder)).findings}
    write(folder, "Combined.csv", "x")
    write(folder, "2024-01-01.json", "x")
    ref = ref_of(folder)
    if packed:
        archive = Path(shutil.make_archive(str(folder), "zip", folder))
        shutil.rmtree(folder)
        ref = replace(ref, packed=archive)
    (unread,) = [each for each in read_session(ref).findings if each.kind == "unread_file"]
    assert unread.count == 2
    assert "2024-01-01.json, Combined.csv" in unread.message


def test_fixes_make_a_walk_of_it(tmp_path: Path) -> None:
    recording(tmp_path, "android")
    (tmp_path / "fixes.csv").write_text(f"{TIMES[0]}; 1; 2\n{TIMES[-1]}; 3; 4\n", encoding="utf-8")
    session = read_session(ref_of(tmp_path))
    assert session.camera.fixes is not None
    assert session.camera.usable.any()
    assert not session.findings


def test_metadata_that_are_damaged_are_named(tmp_path: Path) -> None:
    recording(tmp_path, "ios")
    (tmp_path / "Metadata.csv").write_bytes(b"")
    assert "unreadable_record" in {each.kind for each in read_session(ref_of(tmp_path)).findings}
