"""What each column of a data set's tables means, in words; units stand in :mod:`vislam2tag.dataset.schema`."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from vislam2tag.dataset.schema import ACCESS_POINTS, FINGERPRINTS, IMU_WINDOWS, MAGNETIC, READINGS, RTT, SESSIONS, UNITS

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
