"""Columns, types and units of the tables that ``process`` writes for each session (docs/reference/output.md).

The column ``status`` of labelled tables: text in the tables, codes in arrays.
"""

from __future__ import annotations

import numpy as np
import polars as pl

from vislam2tag.core.arrays import StatusArray
from vislam2tag.core.status import STATUS_LABELS

TRAJECTORY = "trajectory"
_TEXT, _I32, _I64, _F32, _F64 = pl.String(), pl.Int32(), pl.Int64(), pl.Float32(), pl.Float64()
KEY: dict[str, pl.DataType] = {"floor": _I32, "device": _TEXT, "session": _TEXT}
_LABEL: dict[str, pl.DataType] = {"x": _F64, "y": _F64, "z": _F64, "sigma": _F64, "status": _TEXT}
SCHEMAS: dict[str, dict[str, pl.DataType]] = {
    TRAJECTORY: {
        **KEY,
        "time_ns": _I64,
        **dict.fromkeys(("x", "y", "z", "qx", "qy", "qz", "qw", "sigma", "cov_xx", "cov_xy", "cov_yy"), _F64),
        "status": _TEXT,
    },
    "wifi": {
        **KEY,
        "row": _I64,
        "scan": _I32,
        "time_ns": _I64,
        "bssid": _TEXT,
        "ssid": _TEXT,
        "rssi_dbm": _F32,
        "frequency_mhz": _F32,
        **_LABEL,
    },
    "sensors": {
        **KEY,
        "row": _I64,
        "time_ns": _I64,
        "sensor": _TEXT,
        **dict.fromkeys(("v1", "v2", "v3", "v4", "v5", "v6"), _F64),
        **_LABEL,
    },
    "ble": {
        **KEY,
        "row": _I64,
        "time_ns": _I64,
        "address": _TEXT,
        "name": _TEXT,
        "uuid": _TEXT,
        "major": _I32,
        "minor": _I32,
        "rssi_dbm": _F32,
        **_LABEL,
    },
    "rtt": {
        **KEY,
        "row": _I64,
        "time_ns": _I64,
        "bssid": _TEXT,
        "responder": pl.Boolean(),
        "range_m": _F32,
        "range_sigma_m": _F32,
        "rssi_dbm": _F32,
        "attempted": _I32,
        "successful": _I32,
        **_LABEL,
    },
}
"""Columns of the tables that sessions have, in order."""
OPTIONAL = ("ble", "rtt")
"""Tables that only those sessions have that logged them."""
UNITS = {
    "x": "m",
    "y": "m",
    "z": "m",
    "sigma": "m",
    "cov_xx": "m^2",
    "cov_xy": "m^2",
    "cov_yy": "m^2",
    **dict.fromkeys(("qx", "qy", "qz", "qw"), "unit quaternion, camera to BCS"),
    "time_ns": "ns since boot of the phone",
    "rssi_dbm": "dBm",
    "frequency_mhz": "MHz",
    "range_m": "m, from the phone to the access point",
    "range_sigma_m": "m, one standard deviation within the burst",
    **dict.fromkeys(("v1", "v2", "v3", "v4", "v5", "v6"), "as Android gives them for the sensor"),
}


STATUS_TYPE = pl.Enum(STATUS_LABELS)
"""Its physical values are the status codes."""
_LABELS = pl.Series(STATUS_LABELS, dtype=pl.String)


def status_text(status: StatusArray) -> pl.Series:
    """Turn status codes (n,) into the text column ``status``."""
    return _LABELS[status].rename("status")


def status_codes(table: pl.DataFrame) -> StatusArray:
    """Status code (n,) of each row of a labelled table, an array of its own."""
    return table["status"].cast(STATUS_TYPE).to_physical().to_numpy().astype(np.int8)
