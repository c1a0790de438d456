"""Columns, types and units of a data set's tables, in order (docs/reference/datasets.md), and what they mean."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import polars as pl

_TEXT, _I32, _I64, _F32, _F64, _BOOL = pl.String(), pl.Int32(), pl.Int64(), pl.Float32(), pl.Float64(), pl.Boolean()
Schema = Mapping[str, pl.DataType]

FINGERPRINTS = "fingerprints"
READINGS = "readings"
ACCESS_POINTS = "access_points"
SESSIONS = "sessions"
MAGNETIC = "magnetic"
IMU_WINDOWS = "imu_windows"
RTT = "rtt"

SCHEMAS: Mapping[str, Schema] = MappingProxyType(
    {
        FINGERPRINTS: {
            "scan_id": _TEXT,
            "technology": _TEXT,
            "building": _TEXT,
            "floor": _I32,
            "x": _F64,
            "y": _F64,
            "z": _F64,
            "sigma": _F64,
            "x_median": _F64,
            "y_median": _F64,
            "spread": _F64,
            "readings": _I32,
            "labelled": _I32,
            "labelled_share": _F64,
            "status": _TEXT,
            "heading_deg": _F64,
            "speed_m_s": _F64,
            "device": _TEXT,
            "user": _TEXT,
            "session": _TEXT,
            "start_ns": _I64,
            "end_ns": _I64,
            "date": pl.Date(),
        },
        READINGS: {
            "scan_id": _TEXT,
            "bssid": _TEXT,
            "rssi_dbm": _F32,
            "frequency_mhz": _F32,
            "time_ns": _I64,
            "floor": _I32,
            "x": _F64,
            "y": _F64,
            "sigma": _F64,
        },
        ACCESS_POINTS: {
            "bssid": _TEXT,
            "technology": _TEXT,
            "ssid": _TEXT,
            "radio": _TEXT,
            "frequency_mhz": _F32,
            "readings": _I32,
            "fingerprints": _I32,
            "sessions": _I32,
            "floors": pl.List(_I32),
            "strongest_dbm": _F32,
            "randomised": _BOOL,
            "mobile": _BOOL,
            "nomap": _BOOL,
        },
        SESSIONS: {
            "session": _TEXT,
            "building": _TEXT,
            "floor": _I32,
            "device": _TEXT,
            "user": _TEXT,
            "name": _TEXT,
            "started": pl.Datetime("us"),
            "duration_s": _F64,
            "distance_m": _F64,
            "labelled_s": _F64,
            "labelled_m": _F64,
            "fingerprints": _I32,
            "source": _TEXT,
        },
        MAGNETIC: {
            "window_id": _TEXT,
            "building": _TEXT,
            "floor": _I32,
            "x": _F64,
            "y": _F64,
            "z": _F64,
            "sigma": _F64,
            "readings": _I32,
            "norm_ut": _F64,
            "norm_deviation_ut": _F64,
            "vertical_ut": _F64,
            "horizontal_ut": _F64,
            "device": _TEXT,
            "session": _TEXT,
            "start_ns": _I64,
            "end_ns": _I64,
        },
        IMU_WINDOWS: {
            "window_id": _TEXT,
            "building": _TEXT,
            "floor": _I32,
            "start_ns": _I64,
            "rate_hz": _F64,
            "x_start": _F64,
            "y_start": _F64,
            "x_end": _F64,
            "y_end": _F64,
            "sigma_start": _F64,
            "sigma_end": _F64,
            "displacement_x": _F64,
            "displacement_y": _F64,
            "heading_rad": _F64,
            "heading_change_rad": _F64,
            "accelerometer": pl.List(_F32),
            "gyroscope": pl.List(_F32),
            "device": _TEXT,
            "session": _TEXT,
        },
        RTT: {
            "range_id": _TEXT,
            "bssid": _TEXT,
            "responder": _BOOL,
            "range_m": _F32,
            "range_sigma_m": _F32,
            "rssi_dbm": _F32,
            "attempted": _I32,
            "successful": _I32,
            "building": _TEXT,
            "floor": _I32,
            "x": _F64,
            "y": _F64,
            "z": _F64,
            "sigma": _F64,
            "device": _TEXT,
            "session": _TEXT,
            "time_ns": _I64,
        },
    }
)
"""Every table that a data set can have; the first four are always there."""
REQUIRED = (FINGERPRINTS, READINGS, ACCESS_POINTS, SESSIONS)
KEYS: Mapping[str, str] = MappingProxyType(
    {
        FINGERPRINTS: "scan_id",
        ACCESS_POINTS: "bssid",
        SESSIONS: "session",
        MAGNETIC: "window_id",
        IMU_WINDOWS: "window_id",
        RTT: "range_id",
    }
)
"""The column that is unique in a table; readings have none."""
OF_ACCESS_POINTS = (READINGS, RTT)
"""Tables whose rows each name the access point that was heard."""
MEASURED = (*OF_ACCESS_POINTS, MAGNETIC, IMU_WINDOWS)
"""Tables of measurements."""
UNITS: Mapping[str, str] = MappingProxyType(
    {
        **dict.fromkeys(("x", "y", "x_median", "y_median", "x_start", "y_start", "x_end", "y_end"), "m, BCS"),
        "z": "m above the building's zero",
        **dict.fromkeys(("sigma", "sigma_start", "sigma_end"), "m, one standard deviation per axis"),
        "spread": "m, root mean square distance of the labelled readings from their mean",
        "heading_deg": "degrees from the BCS x axis, counter-clockwise",
        "speed_m_s": "m/s",
        "rssi_dbm": "dBm",
        "strongest_dbm": "dBm",
        "frequency_mhz": "MHz",
        "range_m": "m, from the phone to the access point",
        "range_sigma_m": "m, one standard deviation within the burst",
        **dict.fromkeys(("time_ns", "start_ns", "end_ns"), "ns on the clock of the data set's manifest"),
        **dict.fromkeys(("duration_s", "labelled_s"), "s"),
        **dict.fromkeys(("distance_m", "labelled_m"), "m"),
        **dict.fromkeys(("norm_ut", "norm_deviation_ut", "vertical_ut", "horizontal_ut"), "microtesla"),
        "rate_hz": "Hz",
        "displacement_x": "m, in the window's gravity-aligned frame",
        "displacement_y": "m, in the window's gravity-aligned frame",
        "heading_rad": "rad, direction of the window's x axis, counter-clockwise from the BCS x axis",
        "heading_change_rad": "rad, counter-clockwise",
        "accelerometer": "m/s^2, gravity-aligned, x y z of each sample in turn",
        "gyroscope": "rad/s, gravity-aligned, x y z of each sample in turn",
    }
)


def empty_table(name: str) -> pl.DataFrame:
    """Make a table of this name without rows."""
    return pl.DataFrame(schema=dict(SCHEMAS[name]))


def in_schema(name: str, table: pl.DataFrame) -> pl.DataFrame:
    """Put a table's columns into order and type; columns that it lacks are null.

    Raises ValueError for a column that the schema does not have.
    """
    schema = SCHEMAS[name]
    unknown = [column for column in table.columns if column not in schema]
    if unknown:
        raise ValueError(f"{name} has no column {', '.join(unknown)}")
    return table.select(
        (pl.col(column) if column in table.columns else pl.lit(None)).cast(kind).alias(column)
        for column, kind in schema.items()
    )


_PLACE = {
    "building": "building; empty where there is one only",
    "floor": "number of the floor; null where there is no label",
    "x": "position, to the right on the plan",
    "y": "position, up on the plan",
    "z": "height of the phone",
    "sigma": "how sure the position is",
}
_WALK = {
    "device": "phone",
    "user": "who carried it",
    "session": "walk",
    "start_ns": "first reading",
    "end_ns": "last reading",
}
_MEANINGS: Mapping[str, Mapping[str, str]] = MappingProxyType(
    {
        FINGERPRINTS: {
            **_PLACE,
            **_WALK,
            "scan_id": "unique name of the scan or window",
            "technology": "wifi or ble",
            "x": "mean of the labelled readings, weighted by certainty, to the right on the plan",
            "y": "the same, up on the plan",
            "x_median": "median of the labelled readings",
            "y_median": "median of the labelled readings",
            "spread": "how far the readings lie apart",
            "readings": "rows in readings",
            "labelled": "those that have a position of their own",
            "labelled_share": "labelled / readings, 0 to 1",
            "status": "ok; uncertain where sigma is greater than the limit of the set; else why there is no position",
            "heading_deg": "where the camera looked",
            "speed_m_s": "walking speed",
            "date": "day of the walk, local",
        },
        READINGS: {
            **_PLACE,
            "scan_id": "fingerprint it belongs to",
            "bssid": "transmitter; one that was not heard has no row",
            "rssi_dbm": "received signal strength",
            "frequency_mhz": "channel",
            "time_ns": "when it was heard",
            "x": "where the phone was at that time, to the right on the plan",
            "y": "the same, up on the plan",
        },
        ACCESS_POINTS: {
            "bssid": "transmitter",
            "technology": "wifi or ble",
            "ssid": "name of the network",
            "radio": "transmitters of one radio share it",
            "frequency_mhz": "channel heard most",
            "readings": "rows in readings",
            "fingerprints": "scans that heard it",
            "sessions": "walks that heard it",
            "floors": "floors where it was heard",
            "strongest_dbm": "loudest reading",
            "randomised": "the address was given locally, not by a manufacturer",
            "mobile": "a hotspot that may move",
            "nomap": "its owner asks not to be mapped (SSID ends with _nomap)",
        },
        SESSIONS: {
            **_PLACE,
            **_WALK,
            "session": "unique name of the walk",
            "floor": "floor where the walk began",
            "name": "folder or file of the walk",
            "started": "local time, or UTC where the walk has Unix times",
            "duration_s": "from the first to the last frame",
            "distance_m": "way walked",
            "labelled_s": "time with a position",
            "labelled_m": "way with a position",
            "fingerprints": "scans of the walk",
            "source": "key of what it was made of (SHA-256)",
        },
        MAGNETIC: {
            **_PLACE,
            **_WALK,
            "window_id": "unique name of the window",
            "readings": "samples of the magnetometer",
            "norm_ut": "mean strength of the field",
            "norm_deviation_ut": "standard deviation of the strength",
            "vertical_ut": "mean component along gravity",
            "horizontal_ut": "mean component across gravity",
        },
        IMU_WINDOWS: {
            **_PLACE,
            **_WALK,
            "window_id": "unique name of the window",
            "start_ns": "first sample",
            "rate_hz": "samples a second",
            "x_start": "position at the start",
            "y_start": "position at the start",
            "x_end": "position at the end",
            "y_end": "position at the end",
            "sigma_start": "how sure the start is",
            "sigma_end": "how sure the end is",
            "displacement_x": "way from start to end",
            "displacement_y": "way from start to end",
            "heading_rad": "how the window's frame is turned",
            "heading_change_rad": "turn from start to end",
            "accelerometer": "samples",
            "gyroscope": "samples",
        },
        RTT: {
            **_PLACE,
            **_WALK,
            "range_id": "unique name of the range",
            "bssid": "access point that answered",
            "responder": "it answers ranging (IEEE 802.11mc); otherwise the time of an ordinary answer was taken",
            "range_m": "distance by the round-trip time",
            "range_sigma_m": "spread within the burst",
            "rssi_dbm": "received signal strength",
            "attempted": "frames of the burst",
            "successful": "frames that were answered",
            "time_ns": "when it was measured",
        },
    }
)
_SPLIT = MappingProxyType({"id": "scan_id or window_id", "group": "group of the split; empty: in neither part"})


def meaning(table: str, column: str) -> str:
    """Return what a column says, without its unit; nothing for a column that no text is about."""
    return _MEANINGS.get(table, _SPLIT).get(column, "")


def column_text(table: str, column: str) -> str:
    """Return what a column says, with its unit where it has one."""
    words = (meaning(table, column), f"({UNITS[column]})" if column in UNITS else "")
    return " ".join(word for word in words if word)
