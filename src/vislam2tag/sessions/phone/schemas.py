"""Columns of the phone app's tables that are used (docs/reference/phone-tables.md has all)."""

from __future__ import annotations

import polars as pl

from vislam2tag.common.findings import Severity
from vislam2tag.sessions.phone.table import PhoneSchema
from vislam2tag.sessions.tables.camera import POSE_COLUMNS
from vislam2tag.sessions.tables.sensor_table import SENSOR_VALUES

FIRST_COLUMN = b"time_ns,"
"""How the header of every table begins."""
TRACKING = "TRACKING"
SIGHTING = "FULL_TRACKING"
"""The tracker's word for a landmark that it sees in this frame."""
_Types = dict[str, pl.DataType | type[pl.DataType]]
_POSE: _Types = dict.fromkeys(("tx_m", "ty_m", "tz_m", "qx", "qy", "qz", "qw"), pl.Float64)

CAMERA = PhoneSchema(
    {
        "time_ns": pl.Int64,
        "frame_clock": pl.String,
        "part": pl.Int64,
        "state": pl.String,
        "failure": pl.String,
        **_POSE,
    },
    required=("time_ns", "frame_clock", "part", "state", "failure"),
    words=("frame_clock", "state", "failure"),
    severity=Severity.ERROR,
)
LANDMARKS = PhoneSchema(
    {"time_ns": pl.Int64, "id": pl.String, "state": pl.String, "method": pl.String, **_POSE},
    required=("time_ns", "id", "state", "method"),
    words=("state", "method"),
    quoted=True,
    severity=Severity.ERROR,
)
ANCHORS = PhoneSchema(
    {"time_ns": pl.Int64, "anchor": pl.Int64, "state": pl.String, **_POSE},
    required=("time_ns", "anchor", "state"),
    words=("state",),
)
SENSORS = PhoneSchema(
    {"time_ns": pl.Int64, "sensor": pl.String} | dict.fromkeys(SENSOR_VALUES, pl.Float64),
    required=("time_ns", "sensor"),
    words=("sensor",),
)
WIFI = PhoneSchema(
    {
        "time_ns": pl.Int64,
        "scan": pl.Int32,
        "bssid": pl.String,
        "ssid": pl.String,
        "rssi_dbm": pl.Float32,
        "frequency_mhz": pl.Float32,
    },
    required=("time_ns", "scan", "rssi_dbm", "frequency_mhz"),
    quoted=True,
)
BLE = PhoneSchema(
    {
        "time_ns": pl.Int64,
        "address": pl.String,
        "name": pl.String,
        "uuid": pl.String,
        "major": pl.Int32,
        "minor": pl.Int32,
        "rssi_dbm": pl.Float32,
    },
    required=("time_ns", "rssi_dbm"),
    quoted=True,
)
RTT = PhoneSchema(
    {
        "time_ns": pl.Int64,
        "bssid": pl.String,
        "responder": pl.Int32,
        "range_m": pl.Float32,
        "range_sigma_m": pl.Float32,
        "rssi_dbm": pl.Float32,
        "attempted": pl.Int32,
        "successful": pl.Int32,
    },
    required=("time_ns", "responder", "range_m"),
)
PRESSES = PhoneSchema(
    {"time_ns": pl.Int64, "n": pl.Int64, "action": pl.String}, required=("time_ns", "n", "action"), words=("action",)
)
TAPS = PhoneSchema(
    {**PRESSES.columns, "x_m": pl.Float64, "y_m": pl.Float64, "sigma_m": pl.Float64},
    required=PRESSES.required,
    words=PRESSES.words,
)
"""Presses as apps write them that take taps on the plan, too."""
EVENTS = PhoneSchema(
    {"time_ns": pl.Int64, "event": pl.String, "detail": pl.String},
    required=("time_ns", "event"),
    words=("event",),
    quoted=True,
)


def unit_poses(rows: pl.DataFrame) -> pl.DataFrame:
    """Name the pose columns as other formats do."""
    return rows.rename(dict(zip(_POSE, POSE_COLUMNS, strict=True)))
