"""Columns, types and units of a data set's tables, in order (docs/reference/datasets.md), and their meaning."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

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


class Column(NamedTuple):
    """One column: its type and meaning."""

    kind: pl.DataType
    meaning: str


_USUAL: Mapping[str, Column] = MappingProxyType(
    {
        "building": Column(_TEXT, "building; empty if there is only one"),
        "floor": Column(_I32, "number of the floor; null without a label"),
        "x": Column(_F64, "position, to the right on the plan"),
        "y": Column(_F64, "position, up on the plan"),
        "z": Column(_F64, "height of the phone"),
        "sigma": Column(_F64, "standard deviation of the position"),
        "device": Column(_TEXT, "phone"),
        "user": Column(_TEXT, "person who carried the phone"),
        "session": Column(_TEXT, "walk"),
        "start_ns": Column(_I64, "time of the first reading"),
        "end_ns": Column(_I64, "time of the last reading"),
    }
)


def _usual(*names: str) -> dict[str, Column]:
    """Columns with the same meaning in several tables."""
    return {name: _USUAL[name] for name in names}


COLUMNS: Mapping[str, Mapping[str, Column]] = MappingProxyType(
    {
        FINGERPRINTS: {
            "scan_id": Column(_TEXT, "unique name of the scan or window"),
            "technology": Column(_TEXT, "wifi or ble"),
            **_usual("building", "floor"),
            "x": Column(_F64, "mean of the labelled readings, weighted by their information, to the right on the plan"),
            "y": Column(_F64, "the same mean, up on the plan"),
            **_usual("z", "sigma"),
            "x_median": Column(_F64, "median of the labelled readings"),
            "y_median": Column(_F64, "median of the labelled readings"),
            "spread": Column(_F64, "how widely the readings are spread"),
            "readings": Column(_I32, "rows in readings"),
            "labelled": Column(_I32, "readings with a position"),
            "labelled_share": Column(_F64, "labelled / readings, 0 to 1"),
            "status": Column(
                _TEXT, "ok; uncertain if sigma is above the limit of the data set; otherwise why there is no position"
            ),
            "heading_deg": Column(_F64, "viewing direction of the camera"),
            "speed_m_s": Column(_F64, "walking speed"),
            **_usual("device", "user", "session", "start_ns", "end_ns"),
            "date": Column(pl.Date(), "local date of the walk"),
        },
        READINGS: {
            "scan_id": Column(_TEXT, "fingerprint of the reading"),
            "bssid": Column(_TEXT, "transmitter; transmitters that were not heard have no row"),
            "rssi_dbm": Column(_F32, "received signal strength"),
            "frequency_mhz": Column(_F32, "channel"),
            "time_ns": Column(_I64, "time of the reading"),
            **_usual("floor"),
            "x": Column(_F64, "position of the phone at that time, to the right on the plan"),
            "y": Column(_F64, "position of the phone at that time, up on the plan"),
            **_usual("sigma"),
        },
        ACCESS_POINTS: {
            "bssid": Column(_TEXT, "transmitter"),
            "technology": Column(_TEXT, "wifi or ble"),
            "ssid": Column(_TEXT, "name of the network"),
            "radio": Column(_TEXT, "shared by all transmitters of one radio"),
            "frequency_mhz": Column(_F32, "most frequent channel"),
            "readings": Column(_I32, "rows in readings"),
            "fingerprints": Column(_I32, "scans that heard it"),
            "sessions": Column(_I32, "walks that heard it"),
            "floors": Column(pl.List(_I32), "floors where it was heard"),
            "strongest_dbm": Column(_F32, "strongest reading"),
            "randomised": Column(_BOOL, "the address is locally administered, not assigned by a manufacturer"),
            "mobile": Column(_BOOL, "a hotspot that may move"),
            "nomap": Column(_BOOL, "the owner asks not to be mapped (the SSID ends with _nomap)"),
        },
        SESSIONS: {
            "session": Column(_TEXT, "unique name of the walk"),
            **_usual("building"),
            "floor": Column(_I32, "floor where the walk began"),
            **_usual("device", "user"),
            "name": Column(_TEXT, "folder or file of the walk"),
            "started": Column(pl.Datetime("us"), "local time, or UTC if the walk has Unix times"),
            "duration_s": Column(_F64, "time from the first to the last frame"),
            "distance_m": Column(_F64, "distance walked"),
            "labelled_s": Column(_F64, "time with a position"),
            "labelled_m": Column(_F64, "distance with a position"),
            "fingerprints": Column(_I32, "scans of the walk"),
            "source": Column(_TEXT, "key of the source files (SHA-256)"),
        },
        MAGNETIC: {
            "window_id": Column(_TEXT, "unique name of the window"),
            **_usual("building", "floor", "x", "y", "z", "sigma"),
            "readings": Column(_I32, "samples of the magnetometer"),
            "norm_ut": Column(_F64, "mean field strength"),
            "norm_deviation_ut": Column(_F64, "standard deviation of the field strength"),
            "vertical_ut": Column(_F64, "mean component along gravity"),
            "horizontal_ut": Column(_F64, "mean component perpendicular to gravity"),
            **_usual("device", "session", "start_ns", "end_ns"),
        },
        IMU_WINDOWS: {
            "window_id": Column(_TEXT, "unique name of the window"),
            **_usual("building", "floor"),
            "start_ns": Column(_I64, "time of the first sample"),
            "rate_hz": Column(_F64, "sampling rate"),
            "x_start": Column(_F64, "position at the start"),
            "y_start": Column(_F64, "position at the start"),
            "x_end": Column(_F64, "position at the end"),
            "y_end": Column(_F64, "position at the end"),
            "sigma_start": Column(_F64, "standard deviation of the start"),
            "sigma_end": Column(_F64, "standard deviation of the end"),
            "displacement_x": Column(_F64, "displacement from start to end"),
            "displacement_y": Column(_F64, "displacement from start to end"),
            "heading_rad": Column(_F64, "orientation of the window's frame"),
            "heading_change_rad": Column(_F64, "turn from start to end"),
            "accelerometer": Column(pl.List(_F32), "samples"),
            "gyroscope": Column(pl.List(_F32), "samples"),
            **_usual("device", "session"),
        },
        RTT: {
            "range_id": Column(_TEXT, "unique name of the range"),
            "bssid": Column(_TEXT, "access point that answered"),
            "responder": Column(
                _BOOL, "it supports ranging (IEEE 802.11mc); otherwise the time of an ordinary response was used"
            ),
            "range_m": Column(_F32, "distance by the round-trip time"),
            "range_sigma_m": Column(_F32, "spread within the burst"),
            "rssi_dbm": Column(_F32, "received signal strength"),
            "attempted": Column(_I32, "frames sent in the burst"),
            "successful": Column(_I32, "frames that were answered"),
            **_usual("building", "floor", "x", "y", "z", "sigma", "device", "session"),
            "time_ns": Column(_I64, "time of the measurement"),
        },
    }
)
"""Every table that a data set can have; the first four always exist."""
SCHEMAS: Mapping[str, Schema] = MappingProxyType(
    {table: {name: column.kind for name, column in columns.items()} for table, columns in COLUMNS.items()}
)
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
"""The unique column of each table; readings have none."""
OF_ACCESS_POINTS = (READINGS, RTT)
"""Tables with an access point in each row."""
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
    """Put a table's columns into order and type; missing columns are null.

    Raises ValueError for a column that is not in the schema.
    """
    schema = SCHEMAS[name]
    unknown = [column for column in table.columns if column not in schema]
    if unknown:
        raise ValueError(f"{name} has no column {', '.join(unknown)}")
    return table.select(
        (pl.col(column) if column in table.columns else pl.lit(None)).cast(kind).alias(column)
        for column, kind in schema.items()
    )


_SPLIT = {
    "id": Column(_TEXT, "scan_id or window_id"),
    "group": Column(_TEXT, "group of the split; empty: in neither part"),
}


def meaning(table: str, column: str) -> str:
    """Return the meaning of a column, without its unit."""
    return COLUMNS.get(table, _SPLIT)[column].meaning


def column_text(table: str, column: str) -> str:
    """Return the meaning of a column, with its unit if it has one."""
    words = (meaning(table, column), f"({UNITS[column]})" if column in UNITS else "")
    return " ".join(word for word in words if word)
