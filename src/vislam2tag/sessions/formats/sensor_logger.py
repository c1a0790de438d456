"""Recordings of Sensor Logger (Android, iOS): a CSV file a sensor, Unix times in ns, no poses.

Units and columns are those of UNITS.md and CROSSPLATFORM.md in the repository tszheichoi/awesome-sensor-logger. Without
poses a recording is mapped by its inertial readings and ``fixes.csv``, or attached to the walk of another phone.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl

from vislam2tag.common.errors import first_line
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.common.findings import Finding
from vislam2tag.core.arrays import FloatArray
from vislam2tag.intake.readings import admitted
from vislam2tag.sessions.formats.published import SENSOR_LOGGER_METADATA
from vislam2tag.sessions.model import FindingSettings, Session
from vislam2tag.sessions.readings import SENSOR_VALUES, mark_repeated, mark_repeated_ble, sensor_table, wifi_findings
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import SessionFiles, existing_files
from vislam2tag.sessions.text_tables import PhoneSchema, RawTable, parse_phone_table
from vislam2tag.sessions.tracker_tables import CAMERA_SCHEMA, camera_track
from vislam2tag.sessions.without_poses import FIXES_FILE, no_landmarks, with_fixes
from vislam2tag.survey.model import SessionRef
from vislam2tag.survey.site_table import is_file

_SENSORS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "TotalAcceleration.csv": ("ACC", ("x", "y", "z")),
    "Gyroscope.csv": ("GYRO", ("x", "y", "z")),
    "Magnetometer.csv": ("MAG", ("x", "y", "z")),
    "Barometer.csv": ("PRESSURE", ("pressure",)),
}
"""Files of sensors, what the table ``sensors`` calls them, and their columns."""
_FORCE_WITHOUT_GRAVITY, _GRAVITY, _METADATA = "Accelerometer.csv", "Gravity.csv", SENSOR_LOGGER_METADATA
FILE_NAMES: Mapping[str, tuple[str, ...]] = {
    **{name: (name,) for name in (*_SENSORS, _FORCE_WITHOUT_GRAVITY, _GRAVITY)},
    "wifi": ("WiFi.csv",),
    "ble": ("Bluetooth.csv",),
    "presses": ("Annotation.csv",),
    "record": (_METADATA,),
    "fixes": (FIXES_FILE,),
}
_NO_POSES = (
    "the app records no poses: attach this recording to the walk of the phone that had the camera (vislam2tag attach), "
    f"or give its fixes in {FIXES_FILE}"
)
_PAGE = "UNITS.md of github.com/tszheichoi/awesome-sensor-logger"


class SensorLoggerFormat:
    """Reads the folders that the app's zip unpacks to."""

    name = "sensor-logger"

    def recognises(self, folder: Path) -> bool:
        """The app's metadata lie beside a sensor's file."""
        others = {role: names for role, names in FILE_NAMES.items() if role not in ("record", "fixes")}
        return is_file(folder / _METADATA) and bool(existing_files(folder, others))

    def input_files(self, folder: Path) -> list[Path]:
        """The files that :meth:`read` looks at, as far as they are there."""
        return existing_files(folder, FILE_NAMES)

    def read(self, ref: SessionRef, settings: FindingSettings) -> Session:
        """Read a recording whole; problems are findings."""
        reading = SessionFiles(ref.folder, {**FILE_NAMES, "poses": ("poses",)})
        sensors, found = sensor_table(_sensors(reading), "Gyroscope.csv")
        reading.findings += found
        tables = {"wifi": _wifi(reading, settings), "sensors": sensors}
        ble = _ble(reading)
        if ble.height:
            tables["ble"] = ble
        camera, no_frames = camera_track(pl.DataFrame(schema={"row": pl.Int64, **CAMERA_SCHEMA}), _METADATA, settings)
        session = Session(
            key=ref.key,
            camera=camera,
            landmarks=no_landmarks(),
            presses_ns=_rows(reading, "presses", {})["time_ns"].to_numpy(),
            tables=tables,
            files=tuple(reading.files),
            findings=tuple(reading.findings),
        )
        session = with_fixes(session, reading)
        if session.camera.usable.any():
            return session
        lacks = [finding.model_copy(update={"message": _NO_POSES}) for finding in no_frames]
        return replace(session, findings=(*session.findings, *lacks))


def _rows(
    reading: SessionFiles, role: str, columns: Mapping[str, pl.DataType | type[pl.DataType]], *needed: str
) -> pl.DataFrame:
    """Rows of a file, ``time_ns`` first; none where it is not there."""
    schema = PhoneSchema({"time": pl.Int64, **columns}, ("time", *needed), quoted=True, page=_PAGE)
    if not reading.has(role):
        return pl.DataFrame(schema={"row": pl.Int64, "time_ns": pl.Int64, **columns})
    file, data = reading.load(role)
    return reading.account(role, data, parse_phone_table(data, file, schema)).rename({"time": "time_ns"})


def _sensors(reading: SessionFiles) -> pl.DataFrame:
    """Rows of all sensors, in the units of Android, as a sensor table has them."""
    parts = []
    for file, (sensor, names) in _SENSORS.items():
        rows = _rows(reading, file, dict.fromkeys(names, pl.Float64), *names)
        parts.append(_readings(rows, sensor, rows.select(names).to_numpy()))
    axes = dict.fromkeys(("x", "y", "z"), pl.Float64)
    force, gravity = (_rows(reading, name, axes, *axes) for name in (_FORCE_WITHOUT_GRAVITY, _GRAVITY))
    upwards = _upwards(reading)
    if not parts[0].height:
        parts[0] = _force_with_gravity(force, gravity, upwards)
    return pl.concat(parts)


def _force_with_gravity(force: pl.DataFrame, gravity: pl.DataFrame, upwards: float) -> pl.DataFrame:
    """Accelerations that gravity was taken out of, with it added again at the same times."""
    both = force.join(gravity.unique("time_ns", keep="first"), on="time_ns", suffix="_g", maintain_order="left")
    total = both.select("x", "y", "z").to_numpy() + both.select("x_g", "y_g", "z_g").to_numpy()
    return _readings(both, "ACC", total * upwards)


def _upwards(reading: SessionFiles) -> float:
    """1 where readings are upwards at rest, as Android has them; -1 where downwards, as on iOS.

    An app that was told to standardise its frames has them upwards there, too.
    """
    file, data = reading.load("record")
    reading.account("record", data, RawTable(file, 1, pl.DataFrame({"row": [1]}), (), ()))
    try:
        row = read_csv(data, infer_schema=False, truncate_ragged_lines=True).row(0, named=True)
    except (pl.exceptions.PolarsError, IndexError) as error:
        message = f"not understood ({first_line(error)}); readings are taken for those of Android"
        reading.findings.append(Finding(kind="unreadable_record", file=_METADATA, count=1, message=message))
        return 1.0
    ios = (row.get("platform") or "").strip().lower() == "ios"
    return -1.0 if ios and (row.get("standardisation") or "").strip().lower() != "true" else 1.0


def _readings(rows: pl.DataFrame, sensor: str, values: FloatArray) -> pl.DataFrame:
    columns = [
        pl.Series(name, values[:, i] if i < values.shape[1] else np.zeros(len(values)), dtype=pl.Float64)
        for i, name in enumerate(SENSOR_VALUES)
    ]
    return rows.select("row", "time_ns", pl.lit(sensor).alias("sensor")).hstack(columns)


def _wifi(reading: SessionFiles, settings: FindingSettings) -> pl.DataFrame:
    """Networks (Android only); rows of one time are a scan."""
    columns = {"bssid": pl.String, "ssid": pl.String, "level": pl.Float64, "frequency": pl.Float32}
    raw = _rows(reading, "wifi", columns, "level")
    rows = raw.select(
        "row",
        "time_ns",
        pl.col("time_ns").rank("dense").cast(pl.Int32).alias("scan"),
        "bssid",
        pl.col("ssid").fill_null(""),
        pl.col("level").cast(pl.Float32).alias("rssi_dbm"),
        pl.col("frequency").alias("frequency_mhz"),
    )
    rows, odd = admitted(rows, "bssid", "WiFi.csv")
    marked = mark_repeated(rows)
    reading.findings += odd
    reading.findings += wifi_findings(marked, "WiFi.csv", settings)
    return marked


def _ble(reading: SessionFiles) -> pl.DataFrame:
    raw = _rows(reading, "ble", {"id": pl.String, "rssi": pl.Float64}, "rssi")
    none = {"uuid": pl.String, "major": pl.Int32, "minor": pl.Int32}
    rows = raw.select(
        "row",
        "time_ns",
        pl.col("id").alias("address"),
        pl.lit("").alias("name"),
        *(pl.lit(None, dtype=kind).alias(name) for name, kind in none.items()),
        pl.col("rssi").cast(pl.Float32).alias("rssi_dbm"),
    )
    rows, odd = admitted(rows, "address", "Bluetooth.csv")
    reading.findings += odd
    return mark_repeated_ble(rows)


register(SensorLoggerFormat())
