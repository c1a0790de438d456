"""Logs of GetSensorData (IPIN competitions) as sessions: one text file in a session's folder, no poses.

Its position marks (``POSI``) are the fixes; they are in degrees, so that the floor needs a georeference.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import SessionError
from vislam2tag.common.files.plain_files import plain, read_bytes
from vislam2tag.sessions.fixes import GeographicFixes
from vislam2tag.sessions.model import FileRecord, Session
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.tables.getsensordata_lines import looks_like_a_log
from vislam2tag.sessions.tables.getsensordata_log import GetSensorDataLog, parse_log
from vislam2tag.sessions.tables.wifi_table import wifi_findings
from vislam2tag.sessions.without_poses import inertial_log, no_landmarks, track_without_poses
from vislam2tag.site.model import SessionRef

_HEAD_BYTES = 65_536


class GetSensorDataFormat:
    """Reads folders that hold one log; times are nanoseconds since the phone started."""

    name = "getsensordata"

    def recognises(self, folder: Path) -> bool:
        """The folder's one text file begins like a log."""
        return folder.is_dir() and len(self.input_files(folder)) == 1

    def input_files(self, folder: Path) -> list[Path]:
        """The log."""
        return [path for path in sorted(folder.glob("*.txt")) if _begins_like_a_log(path)]

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a log whole; problems are findings. Raises SessionError where it has no inertial readings."""
        (path,) = self.input_files(ref.folder)
        data, name = read_bytes(path), path.name
        log = parse_log(data, name)
        sensors = log.tables["sensors"]
        inertial = inertial_log(sensors)
        if inertial is None:
            raise SessionError(f"{ref.key}: {name} has no accelerometer and gyroscope readings; it cannot be mapped")
        tables = {"wifi": log.tables["wifi"], "sensors": sensors}
        if log.tables["ble"].height:
            tables["ble"] = _ble(log.tables["ble"])
        lines = data.count(b"\n") + int(not data.endswith(b"\n") and data != b"")
        record = FileRecord(name, "log", len(data), hashlib.sha256(data).hexdigest(), lines, lines)
        return Session(
            key=ref.key,
            camera=track_without_poses(inertial, sensors, None),
            landmarks=no_landmarks(),
            presses_ns=np.empty(0, dtype=np.int64),
            tables=tables,
            files=(record,),
            findings=(*log.findings, *wifi_findings(tables["wifi"], name, settings)),
            geographic_fixes=_fixes(log, name),
        )


def _begins_like_a_log(path: Path) -> bool:
    try:
        with plain(path).open("rb") as file:
            return looks_like_a_log(file.read(_HEAD_BYTES))
    except OSError:
        return False


def _fixes(log: GetSensorDataLog, file: str) -> GeographicFixes:
    """The marks in time order, of several at one time the first."""
    time_ns, first = np.unique(log.taps.time_ns, return_index=True)
    names = tuple(f"the mark at {at_s:.1f} s" for at_s in log.taps.app_s[first].tolist())
    return GeographicFixes(file, time_ns, log.taps.position[first], log.taps.floor[first], names)


def _ble(adverts: pl.DataFrame) -> pl.DataFrame:
    none = {"uuid": pl.String, "major": pl.Int32, "minor": pl.Int32}
    return adverts.select(
        "row",
        "time_ns",
        "repeated",
        pl.col("bssid").alias("address"),
        pl.col("ssid").alias("name"),
        *(pl.lit(None, dtype=dtype).alias(name) for name, dtype in none.items()),
        "rssi_dbm",
    )


register(GetSensorDataFormat())
