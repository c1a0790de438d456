"""The published raw layout (and the paper's file names for it): one folder of ``;`` separated files a session."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.core.arrays import IntArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.findings import Finding, Severity
from vislam2tag.sessions.ble_table import ble_findings, parse_ble
from vislam2tag.sessions.ble_table import mark_repeated as mark_repeated_ble
from vislam2tag.sessions.camera import CAMERA_SCHEMA, camera_track
from vislam2tag.sessions.clock import clock_mismatch
from vislam2tag.sessions.landmark_log import LANDMARK_SCHEMA, landmark_log
from vislam2tag.sessions.model import FileRecord, Session
from vislam2tag.sessions.pose_lag import pose_lag_of
from vislam2tag.sessions.pressure import pressure_log
from vislam2tag.sessions.raw_table import RawTable, parse_table
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.sensor_table import SENSOR_SCHEMA, sensor_table
from vislam2tag.sessions.wifi_table import mark_repeated, parse_wifi, wifi_findings
from vislam2tag.settings import FindingSettings
from vislam2tag.survey.files import is_file
from vislam2tag.survey.model import SessionRef

FILE_NAMES = {
    "poses": ("poses.csv", "CameraPose.csv"),
    "landmarks": ("initPoses.csv", "LandmarkPose.csv"),
    "wifi": ("wifi.csv", "WiFi.csv"),
    "sensors": ("sensors.csv", "Sensors.csv"),
    "presses": ("refMarker.csv", "ControlPoint.csv"),
    "ble": ("ble.csv", "Ble.csv"),
}
"""The names of each role's file: the published one, and the paper's."""

_PRESS_SCHEMA = {"n": pl.Int64, "time_ns": pl.Int64}
_MISSING = {
    "poses": ("no camera poses; the session cannot be mapped", Severity.ERROR),
    "landmarks": ("no landmark poses; the session cannot be mapped", Severity.ERROR),
    "wifi": ("no Wi-Fi scans; the session gives no Wi-Fi labels", Severity.WARNING),
    "sensors": ("no sensor readings; the session gives no sensor labels", Severity.WARNING),
}

_OPTIONAL = {"presses": ("no presses", Severity.WARNING), "ble": ("no BLE readings", Severity.WARNING)}


@dataclass
class _Reading:
    """One session while it is read: the account of its files and what was found."""

    folder: Path
    files: list[FileRecord] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)
    opened: set[str] = field(default_factory=set)

    def load(self, role: str) -> tuple[str, bytes]:
        """Name and bytes of a role's file; no bytes where the file is missing or cannot be opened."""
        names = [name for name in FILE_NAMES[role] if is_file(self.folder / name)]
        if not names:
            if role in _MISSING:
                self._note("missing_file", FILE_NAMES[role][0], *_MISSING[role])
            return FILE_NAMES[role][0], b""
        if len(names) > 1:
            self._note("second_file", names[1], f"{names[0]} says the same; this file is not read", Severity.WARNING)
        try:
            data = (self.folder / names[0]).read_bytes()
        except OSError as error:
            self._note("unreadable_file", names[0], *_unreadable(role, error))
            return names[0], b""
        self.opened.add(names[0])
        return names[0], data

    def account(self, role: str, data: bytes, table: RawTable) -> pl.DataFrame:
        """Record a file that was opened, and return its rows."""
        if table.file in self.opened:
            digest = hashlib.sha256(data).hexdigest()
            record = FileRecord(table.file, role, len(data), digest, table.lines, table.rows.height)
            self.files.append(record)
            self.findings += table.findings
        return table.rows

    def _note(self, kind: str, file: str, message: str, severity: Severity) -> None:
        self.findings.append(Finding(kind=kind, file=file, count=1, message=message, severity=severity))


def _unreadable(role: str, error: OSError) -> tuple[str, Severity]:
    """Message and severity for a file that cannot be opened: as grave as if it were missing."""
    consequence, severity = (_MISSING | _OPTIONAL)[role]
    return f"cannot be opened ({error.strerror}): {consequence}; check its permissions", severity


class PublishedFormat:
    """Reads the folders of the published survey and phone app, whichever names their files have."""

    name = "published"

    def recognises(self, folder: Path) -> bool:
        """A session has at least one file of a known name."""
        return any(is_file(folder / name) for names in FILE_NAMES.values() for name in names)

    def input_files(self, folder: Path) -> list[Path]:
        """The files that :meth:`read` looks at, as far as they are there."""
        paths = (folder / name for names in FILE_NAMES.values() for name in names)
        return [path for path in paths if is_file(path)]

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a session whole; problems are findings."""
        reading = _Reading(ref.folder)
        camera = _camera(reading, settings)
        landmarks = _landmarks(reading, camera)
        tables = {"wifi": _wifi(reading, camera, settings), "sensors": _sensors(reading, camera)}
        if any(is_file(ref.folder / name) for name in FILE_NAMES["ble"]):
            tables["ble"] = _ble(reading, camera)
        presses_ns = _presses(reading, camera)
        pose_lag_s = pose_lag_of(camera, tables["sensors"])
        return Session(
            key=ref.key,
            camera=replace(camera, pressure=pressure_log(tables["sensors"]), pose_lag_s=pose_lag_s),
            landmarks=landmarks,
            presses_ns=presses_ns,
            tables=tables,
            files=tuple(reading.files),
            findings=tuple(reading.findings),
        )


def _camera(reading: _Reading, settings: FindingSettings) -> CameraTrack:
    file, data = reading.load("poses")
    rows = reading.account("poses", data, parse_table(data, file, CAMERA_SCHEMA))
    camera, findings = camera_track(rows, file, settings)
    reading.findings += findings
    return camera


def _landmarks(reading: _Reading, camera: CameraTrack) -> LandmarkLog:
    file, data = reading.load("landmarks")
    rows = reading.account("landmarks", data, parse_table(data, file, LANDMARK_SCHEMA))
    log, findings = landmark_log(rows, file, camera)
    reading.findings += findings
    return log


def _wifi(reading: _Reading, camera: CameraTrack, settings: FindingSettings) -> pl.DataFrame:
    file, data = reading.load("wifi")
    rows = mark_repeated(reading.account("wifi", data, parse_wifi(data, file)))
    reading.findings += wifi_findings(rows, file, settings)
    reading.findings += clock_mismatch(rows["time_ns"].to_numpy(), file, camera)
    return rows


def _sensors(reading: _Reading, camera: CameraTrack) -> pl.DataFrame:
    file, data = reading.load("sensors")
    rows, findings = sensor_table(reading.account("sensors", data, parse_table(data, file, SENSOR_SCHEMA)), file)
    reading.findings += findings
    reading.findings += clock_mismatch(rows["time_ns"].to_numpy(), file, camera)
    return rows


def _ble(reading: _Reading, camera: CameraTrack) -> pl.DataFrame:
    file, data = reading.load("ble")
    rows = mark_repeated_ble(reading.account("ble", data, parse_ble(data, file)))
    reading.findings += ble_findings(rows, file)
    reading.findings += clock_mismatch(rows["time_ns"].to_numpy(), file, camera)
    return rows


def _presses(reading: _Reading, camera: CameraTrack) -> IntArray:
    file, data = reading.load("presses")
    rows = reading.account("presses", data, parse_table(data, file, _PRESS_SCHEMA))
    presses_ns = rows["time_ns"].to_numpy().astype(np.int64)
    reading.findings += clock_mismatch(presses_ns, file, camera)
    return presses_ns


register(PublishedFormat())
