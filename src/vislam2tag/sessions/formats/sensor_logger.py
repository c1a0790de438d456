"""Recordings of Sensor Logger (Android, iOS): a CSV file a sensor, Unix times in ns, no poses.

Units and columns are those of UNITS.md and CROSSPLATFORM.md in the repository tszheichoi/awesome-sensor-logger. Without
poses a recording is mapped by its inertial readings and ``fixes.csv``, or attached to the walk of another phone.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import polars as pl

from vislam2tag.common.errors import first_line
from vislam2tag.common.files.table_files import read_csv
from vislam2tag.intake.readings import admitted
from vislam2tag.sessions.formats.published import SENSOR_LOGGER_METADATA
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.readings import BEACON, ble_rows, mark_repeated, sensor_rows, sensor_table
from vislam2tag.sessions.registry import register
from vislam2tag.sessions.session_files import FileFormat, SessionFiles, existing_files
from vislam2tag.sessions.settings import FindingSettings
from vislam2tag.sessions.text_tables import Columns, NamedTable, RawTable
from vislam2tag.sessions.tracker_tables import CAMERA_SCHEMA, camera_track
from vislam2tag.sessions.without_poses import FIXES_FILE, no_landmarks, with_fixes
from vislam2tag.site.model import SessionKey
from vislam2tag.site.site_table import is_file

_AXES = ("x", "y", "z")
_SENSORS: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "TotalAcceleration.csv": ("ACC", _AXES),
    "Gyroscope.csv": ("GYRO", _AXES),
    "Magnetometer.csv": ("MAG", _AXES),
    "Barometer.csv": ("PRESSURE", ("pressure",)),
}
"""Files of sensors, what the table ``sensors`` calls them, and their columns."""
_FORCE_WITHOUT_GRAVITY, _GRAVITY = "Accelerometer.csv", "Gravity.csv"
FILE_NAMES: Mapping[str, tuple[str, ...]] = {
    **{name: (name,) for name in (*_SENSORS, _FORCE_WITHOUT_GRAVITY, _GRAVITY)},
    "wifi": ("WiFi.csv",),
    "ble": ("Bluetooth.csv",),
    "ble_names": ("BluetoothMetadata.csv",),
    "presses": ("Annotation.csv",),
    "record": (SENSOR_LOGGER_METADATA,),
    "fixes": (FIXES_FILE,),
}
_BLE_OF_DEVICE = re.compile(r"bluetooth-.+\.csv", re.IGNORECASE)
"""A file for each device that was chosen in the app, ``bluetooth-DB08D33338EF.csv``."""
_UNUSED = re.compile(
    r"(accelerometer|gyroscope|magnetometer)uncalibrated|activity|battery(temp)?|brightness|compass|headphone|heartrate|"
    r"light|location(gps|network)?|metadata|microphone|network|orientation|pedometer|studymetadata|watch\w+|wristmotion"
)
"""Files of the app that contain nothing that this program uses (UNITS.md lists them all)."""
_NO_POSES = (
    "the app records no poses: attach this recording to the walk of the phone that had the camera (vislam2tag "
    f"attach), or write its known positions into {FIXES_FILE}"
)
_PAGE = "UNITS.md of github.com/tszheichoi/awesome-sensor-logger"


def _recognises(folder: Path) -> bool:
    """The app's metadata are beside a sensor's file."""
    if not is_file(folder / SENSOR_LOGGER_METADATA):
        return False
    others = {role: names for role, names in FILE_NAMES.items() if role not in ("record", "fixes")}
    return bool(existing_files(folder, others)) or any(_BLE_OF_DEVICE.fullmatch(path.name) for path in folder.iterdir())


def _session(reading: SessionFiles, key: SessionKey, settings: FindingSettings) -> Session:
    sensors = reading.noted(sensor_table(_sensors(reading), "Gyroscope.csv"))
    tables = {"wifi": reading.wifi(_wifi(reading), settings), "sensors": sensors}
    ble = _ble(reading)
    if ble.height:
        tables["ble"] = ble
    no_poses = pl.DataFrame(schema={"row": pl.Int64, **CAMERA_SCHEMA})
    camera, no_frames = camera_track(no_poses, SENSOR_LOGGER_METADATA, settings)
    presses_ns = _rows(reading, "presses", {})["time_ns"].to_numpy()
    session = with_fixes(reading.session(key, camera, no_landmarks(), tables, presses_ns=presses_ns), reading)
    if session.camera.usable.any():
        return session
    missing = [finding.model_copy(update={"message": _NO_POSES}) for finding in no_frames]
    return replace(session, findings=(*session.findings, *missing))


def _rows(reading: SessionFiles, role: str, columns: Columns, *needed: str) -> pl.DataFrame:
    """Rows of a file, ``time_ns`` first; none where it is not there."""
    table = NamedTable({"time": pl.Int64, **columns}, needed, quoted=True, page=_PAGE)
    if not reading.has(role):
        return pl.DataFrame(schema={"row": pl.Int64, "time_ns": pl.Int64, **columns})
    return reading.rows(role, table.read).rename({"time": "time_ns"})


def _sensors(reading: SessionFiles) -> pl.DataFrame:
    """Rows of all sensors, in the units of Android, as a sensor table has them."""
    parts = []
    for file, (sensor, names) in _SENSORS.items():
        rows = _rows(reading, file, dict.fromkeys(names, pl.Float64), *names)
        parts.append(sensor_rows(rows, sensor, [pl.col(name) for name in names]))
    axes = dict.fromkeys(_AXES, pl.Float64)
    force, gravity = (_rows(reading, name, axes, *axes) for name in (_FORCE_WITHOUT_GRAVITY, _GRAVITY))
    upwards = _upwards(reading)
    if not parts[0].height:
        parts[0] = _force_with_gravity(force, gravity, upwards)
    return pl.concat(parts)


def _force_with_gravity(force: pl.DataFrame, gravity: pl.DataFrame, upwards: float) -> pl.DataFrame:
    """Accelerations that gravity was taken out of, with it added again at the same times."""
    both = force.join(gravity.unique("time_ns", keep="first"), on="time_ns", suffix="_g", maintain_order="left")
    return sensor_rows(both, "ACC", [(pl.col(axis) + pl.col(f"{axis}_g")) * upwards for axis in _AXES])


def _upwards(reading: SessionFiles) -> float:
    """1 where readings are upwards at rest, as Android has them; -1 where downwards, as on iOS.

    An app that is set to standardise its frames has them upwards there, too.
    """
    file, data = reading.load("record")
    reading.account("record", data, RawTable(file, 1, pl.DataFrame({"row": [1]}), (), ()))
    try:
        row = read_csv(data, infer_schema=False, truncate_ragged_lines=True).row(0, named=True)
    except (pl.exceptions.PolarsError, IndexError) as error:
        message = f"not understood ({first_line(error)}); readings are read as those of Android"
        reading.note("unreadable_record", SENSOR_LOGGER_METADATA, message)
        return 1.0
    ios = (row.get("platform") or "").strip().lower() == "ios"
    return -1.0 if ios and (row.get("standardisation") or "").strip().lower() != "true" else 1.0


def _wifi(reading: SessionFiles) -> pl.DataFrame:
    """Networks (Android only); rows of one time are a scan."""
    columns = {"bssid": pl.String, "ssid": pl.String, "level": pl.Float64, "frequency": pl.Float32}
    return _rows(reading, "wifi", columns, "level").select(
        "row",
        "time_ns",
        pl.col("time_ns").rank("dense").cast(pl.Int32).alias("scan"),
        "bssid",
        "ssid",
        pl.col("level").cast(pl.Float32).alias("rssi_dbm"),
        pl.col("frequency").alias("frequency_mhz"),
    )


def _ble(reading: SessionFiles) -> pl.DataFrame:
    """Advertisements, of all devices in one file or of each in its own."""
    named = _rows(reading, "ble_names", {"id": pl.String, "name": pl.String}, "id").drop_nulls().unique("id")
    parts = []
    for role in ("ble", *filter(_BLE_OF_DEVICE.fullmatch, reading.names)):
        logged = _rows(reading, role, {"id": pl.String, "rssi": pl.Float64}, "rssi")
        rows = logged.join(named.select("id", "name"), on="id", how="left", maintain_order="left")
        own = ble_rows(rows, "id", pl.col("name").fill_null(""), "rssi")
        parts.append(reading.noted(admitted(own, "address", reading.name_of(role))))
    return mark_repeated(pl.concat(parts), *BEACON)


register(FileFormat("sensor-logger", FILE_NAMES, _recognises, _session, _BLE_OF_DEVICE, _UNUSED))
