"""Whatever bytes a file holds, a reader raises nothing and accounts for every line."""

from __future__ import annotations

from functools import cache

import numpy as np
import polars as pl
import pytest

from tests.mutations import mutate, some_or_many
from tests.sessions.raw import clean_files, count_lines, to_bytes
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.sessions.clocks import clock_mismatch
from vislam2tag.sessions.readings import (
    BEACON,
    BLE_LINES,
    SENSOR_SCHEMA,
    WIFI_LINES,
    ble_findings,
    mark_repeated,
    sensor_table,
    wifi_findings,
)
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import FieldTable, RawTable
from vislam2tag.sessions.tracker_tables import CAMERA_SCHEMA, LANDMARK_SCHEMA, camera_track, landmark_log
from vislam2tag.site.model import landmark_id

LINES = 30
SETTINGS = FindingSettings()
UUID = "32ff6e37-9a5b-457c-a5f3-bf91dfa4426e"
BLE = [f"{41_000_000_000_000 + n}; c2:00:00:00:00:0{n % 9}; desk; -{n + 50}" for n in range(15)]
BLE += [f"{line}; {UUID}; 1; {n}" for n, line in enumerate(BLE)]


@cache
def clean_camera() -> CameraTrack:
    data = to_bytes(clean_files()["poses.csv"])
    return camera_track(FieldTable(CAMERA_SCHEMA).read(data, "poses.csv").rows, "poses.csv", SETTINGS)[0]


def read_poses(data: bytes) -> RawTable:
    table = FieldTable(CAMERA_SCHEMA).read(data, "poses.csv")
    camera, _ = camera_track(table.rows, "poses.csv", SETTINGS)
    assert np.all(np.diff(camera.time_ns[camera.usable]) > 0)
    assert np.isfinite(camera.position_acs[camera.usable]).all()
    assert np.allclose(np.linalg.norm(camera.orientation_acs, axis=1), 1.0)
    return table


def read_landmarks(data: bytes) -> RawTable:
    table = FieldTable(LANDMARK_SCHEMA).read(data, "initPoses.csv")
    camera = clean_camera()
    log, _ = landmark_log(table.rows, "initPoses.csv", camera)
    assert np.isfinite(log.position_acs).all()
    pairs = log.landmark * len(camera.time_ns) + log.frame
    assert np.all(np.diff(pairs) > 0)
    assert all(landmark_id(name) == name for name in log.ids)
    return table


def read_sensors(data: bytes) -> RawTable:
    table = FieldTable(SENSOR_SCHEMA).read(data, "sensors.csv")
    rows, _ = sensor_table(table.rows, "sensors.csv")
    clock_mismatch(rows["time_ns"].to_numpy(), "sensors.csv", clean_camera())
    assert rows.height == table.rows.height
    return table


def read_wifi(data: bytes) -> RawTable:
    table = WIFI_LINES.read(data, "wifi.csv")
    rows = mark_repeated(table.rows, "bssid")
    wifi_findings(rows, "wifi.csv", SETTINGS)
    assert rows["time_ns"].min() is None or rows["time_ns"].to_numpy().min() >= 0
    return table


def read_ble(data: bytes) -> RawTable:
    table = BLE_LINES.read(data, "ble.csv")
    ble_findings(mark_repeated(table.rows, *BEACON), "ble.csv")
    identity = table.rows.select(pl.sum_horizontal(pl.col("uuid", "major", "minor").is_null())).to_series()
    assert identity.is_in([0, 3]).all()
    return table


READERS = {
    "poses.csv": read_poses,
    "initPoses.csv": read_landmarks,
    "sensors.csv": read_sensors,
    "wifi.csv": read_wifi,
    "ble.csv": read_ble,
}


@some_or_many
@pytest.mark.parametrize("name", READERS)
def test_damaged_files_raise_nothing_and_account_for_every_line(name: str, files: int) -> None:
    rng = np.random.default_rng(20220114)
    clean = to_bytes((clean_files() | {"ble.csv": BLE})[name][:LINES])
    for number in range(files):
        data = mutate(clean, rng)
        table = READERS[name](data)
        unreadable = sum(f.count for f in table.findings if f.kind in ("malformed_lines", "partial_last_line"))
        assert table.lines == count_lines(data) == table.rows.height + unreadable, (number, data)
        assert sorted((*table.rows["row"].to_list(), *table.unreadable)) == list(range(1, table.lines + 1))
