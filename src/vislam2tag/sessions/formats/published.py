"""The published raw layout (and the paper's file names for it): one folder of ``;`` separated files a session."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.core.arrays import IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.intake.readings import admitted
from vislam2tag.sessions.clocks import (
    clock_mismatch,
    clock_of,
    pose_lag_of,
    with_frame_times,
    with_landmark_times,
    with_reading_times,
    with_scan_times,
    with_times_of,
)
from vislam2tag.sessions.model import FindingSettings, Session
from vislam2tag.sessions.readings import (
    SENSOR_SCHEMA,
    ble_findings,
    mark_repeated,
    mark_repeated_ble,
    parse_ble,
    parse_wifi,
    pressure_log,
    sensor_table,
    wifi_findings,
)
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import SessionFiles, existing_files
from vislam2tag.sessions.text_tables import parse_table
from vislam2tag.sessions.tracker_tables import CAMERA_SCHEMA, LANDMARK_SCHEMA, camera_track, landmark_log
from vislam2tag.sessions.without_poses import FIXES_FILE, with_fixes
from vislam2tag.survey.model import SessionKey, SessionRef
from vislam2tag.survey.site_table import is_file

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

_PRESS_SCHEMA = {"n": pl.Int64, "time_ns": pl.Int64}


class PublishedFormat:
    """Reads the folders of the published survey and phone app, whichever names their files have."""

    name = "published"

    def recognises(self, folder: Path) -> bool:
        """A session has at least one file of a known name; Sensor Logger also writes a WiFi.csv, beside metadata."""
        return bool(existing_files(folder, FILE_NAMES)) and not is_file(folder / SENSOR_LOGGER_METADATA)

    def input_files(self, folder: Path) -> list[Path]:
        """The files that :meth:`read` looks at, as far as they are there."""
        return existing_files(folder, FILE_NAMES)

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a session whole; problems are findings."""
        return _session(SessionFiles(ref.folder, FILE_NAMES), ref.key, settings)

    def read_track(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read what the tracker said."""
        return _session(SessionFiles(ref.folder, FILE_NAMES, track_only=True), ref.key, settings)


def _session(reading: SessionFiles, key: SessionKey, settings: FindingSettings) -> Session:
    camera = _camera(reading, settings)
    landmarks = _landmarks(reading, camera)
    sensors = _sensors(reading, camera)
    clock_ns = clock_of(camera, sensors)
    tables = {"wifi": _wifi(reading, camera, clock_ns, settings), "sensors": sensors}
    if reading.has("ble"):
        tables["ble"] = _ble(reading, camera, clock_ns)
    presses_ns = _presses(reading, camera, clock_ns)
    pose_lag_s = pose_lag_of(camera, tables["sensors"])
    session = Session(
        key=key,
        camera=replace(camera, pressure=pressure_log(tables["sensors"]), pose_lag_s=pose_lag_s),
        landmarks=landmarks,
        presses_ns=presses_ns,
        tables=tables,
        files=tuple(reading.files),
        findings=tuple(reading.findings),
    )
    return with_fixes(session, reading)


def _camera(reading: SessionFiles, settings: FindingSettings) -> CameraTrack:
    file, data = reading.load("poses")
    rows, unit = with_frame_times(reading.account("poses", data, parse_table(data, file, CAMERA_SCHEMA)), file)
    camera, findings = camera_track(rows, file, settings)
    reading.findings += [*unit, *findings]
    return camera


def _landmarks(reading: SessionFiles, camera: CameraTrack) -> LandmarkLog:
    file, data = reading.load("landmarks")
    rows = reading.account("landmarks", data, parse_table(data, file, LANDMARK_SCHEMA))
    rows, unit = with_landmark_times(rows, file, clock_of(camera))
    log, findings = landmark_log(rows, file, camera)
    reading.findings += [*unit, *findings]
    return log


def _wifi(reading: SessionFiles, camera: CameraTrack, clock_ns: IntArray, settings: FindingSettings) -> pl.DataFrame:
    file, data = reading.load("wifi")
    rows, unit = with_scan_times(reading.account("wifi", data, parse_wifi(data, file)), file, clock_ns, "microseconds")
    rows, odd = admitted(rows, "bssid", file)
    rows = mark_repeated(rows)
    reading.findings += [*unit, *odd, *wifi_findings(rows, file, settings)]
    reading.findings += clock_mismatch(rows["time_ns"].to_numpy(), file, camera)
    return rows


def _sensors(reading: SessionFiles, camera: CameraTrack) -> pl.DataFrame:
    file, data = reading.load("sensors")
    readings = reading.account("sensors", data, parse_table(data, file, SENSOR_SCHEMA))
    readings, unit = with_reading_times(readings, file, clock_of(camera))
    rows, findings = sensor_table(readings, file)
    reading.findings += [*unit, *findings]
    reading.findings += clock_mismatch(rows["time_ns"].to_numpy(), file, camera)
    return rows


def _ble(reading: SessionFiles, camera: CameraTrack, clock_ns: IntArray) -> pl.DataFrame:
    file, data = reading.load("ble")
    rows, unit = with_times_of(reading.account("ble", data, parse_ble(data, file)), file, clock_ns)
    rows, odd = admitted(rows, "address", file, pl.col("uuid").is_not_null())
    rows = mark_repeated_ble(rows)
    reading.findings += [*unit, *odd, *ble_findings(rows, file)]
    reading.findings += clock_mismatch(rows["time_ns"].to_numpy(), file, camera)
    return rows


def _presses(reading: SessionFiles, camera: CameraTrack, clock_ns: IntArray) -> IntArray:
    """Times (k,) of the presses, ns."""
    file, data = reading.load("presses")
    rows, unit = with_times_of(reading.account("presses", data, parse_table(data, file, _PRESS_SCHEMA)), file, clock_ns)
    reading.findings += unit
    presses_ns = rows["time_ns"].to_numpy().astype(np.int64)
    reading.findings += clock_mismatch(presses_ns, file, camera)
    return presses_ns


register(PublishedFormat())
