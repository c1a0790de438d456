"""The published raw layout (and the paper's file names for it): one folder of ``;`` separated files a session."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.intake.time_units import ANY, FRAMES, SCANS
from vislam2tag.sessions.clocks import clock_of, pose_lag_of
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.readings import BLE_LINES, SENSOR_SCHEMA, WIFI_LINES, pressure_log
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import FileFormat, SessionFiles, existing_files
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import FieldTable
from vislam2tag.sessions.tracker_tables import CAMERA_SCHEMA, LANDMARK_SCHEMA, camera_track, landmark_log
from vislam2tag.sessions.without_poses import FIXES_FILE, with_fixes
from vislam2tag.site.model import SessionKey
from vislam2tag.site.site_table import is_file

SENSOR_LOGGER_METADATA = "Metadata.csv"
FILE_NAMES = {
    "poses": ("poses.csv", "CameraPose.csv"),
    "landmarks": ("initPoses.csv", "LandmarkPose.csv"),
    "wifi": ("wifi.csv", "WiFi.csv"),
    "sensors": ("sensors.csv", "Sensors.csv"),
    "presses": ("refMarker.csv", "ControlPoint.csv"),
    "ble": ("ble.csv", "Ble.csv"),
    "fixes": (FIXES_FILE,),
}
"""The names of each role's file: the published one, and the paper's."""

_PRESSES = FieldTable({"n": pl.Int64, "time_ns": pl.Int64})


def _recognises(folder: Path) -> bool:
    """A session has at least one file of a known name; Sensor Logger also writes a WiFi.csv, beside metadata."""
    return bool(existing_files(folder, FILE_NAMES)) and not is_file(folder / SENSOR_LOGGER_METADATA)


def _session(reading: SessionFiles, key: SessionKey, settings: FindingSettings) -> Session:
    poses = reading.rows("poses", FieldTable(CAMERA_SCHEMA).read, FRAMES)
    camera = reading.noted(camera_track(poses, reading.name_of("poses"), settings))
    logged = reading.rows("landmarks", FieldTable(LANDMARK_SCHEMA).read, FRAMES, clock_of(camera))
    landmarks = reading.noted(landmark_log(logged, reading.name_of("landmarks"), camera))
    sensors = reading.readings(FieldTable(SENSOR_SCHEMA).read, camera)
    clock_ns = clock_of(camera, sensors)
    scans = reading.rows("wifi", WIFI_LINES.read, SCANS, clock_ns, "microseconds")
    tables = {"wifi": reading.on_clock("wifi", reading.wifi(scans, settings), camera, sensors), "sensors": sensors}
    if reading.has("ble"):
        adverts = reading.ble(reading.rows("ble", BLE_LINES.read, ANY, clock_ns))
        tables["ble"] = reading.on_clock("ble", adverts, camera)
    presses = reading.on_clock("presses", reading.rows("presses", _PRESSES.read, ANY, clock_ns), camera)
    camera = replace(camera, pressure=pressure_log(sensors), pose_lag_s=pose_lag_of(camera, sensors))
    presses_ns = presses["time_ns"].to_numpy().astype(np.int64)
    return with_fixes(reading.session(key, camera, landmarks, tables, presses_ns=presses_ns), reading)


register(FileFormat("published", FILE_NAMES, _recognises, _session))
