"""The Tampere quartet (Lohan et al., Data 2017, 2(4), 32): levels, coordinates, device and date, a row a fingerprint.

``Training_rss_*.csv``, ``..._coordinates_*.csv``, ``..._device_*.csv``, ``..._date_*.csv`` and the same of ``Test_``,
without headers. x, y, z in metres in a local frame; floors are 3.7 m apart.
"""

from __future__ import annotations

import re

import polars as pl

from vislam2tag.datasets.fingerprint_tables import WALK, FingerprintTables, RowCheck, SetDescription
from vislam2tag.datasets.model import TEST, TRAIN

STOREY_M = 3.7
_OFF_FLOOR_M = 0.05
"""A height farther than this from every floor is a finding; it goes to the nearest."""
_STOREY = pl.col("z") / STOREY_M
_FLOOR = _STOREY.round().cast(pl.Int32, strict=False)
_TIME = pl.col("date").str.to_datetime("%Y-%m-%d %H:%M:%S", time_unit="ns", strict=False)
TABLES = FingerprintTables(
    SetDescription(
        "tampere",
        name="tampere",
        title="Wi-Fi Crowdsourced Fingerprinting Dataset for Indoor Positioning (Tampere)",
        description="One university building, crowdsourced; times are the phones' local time.",
        licence="CC-BY-4.0",
        creators=(
            "Elena Simona Lohan",
            "Joaquín Torres-Sospedra",
            "Helena Leppäkoski",
            "Philipp Richter",
            "Zhe Peng",
            "Joaquín Huerta",
        ),
        storey_m=STOREY_M,
    ),
    files=re.compile(r"(?P<walk>Training|Test)_(?P<role>rss|coordinates|device|date)(_.*)?\.csv", re.IGNORECASE),
    none_found="holds no Training_rss_*.csv or Test_rss_*.csv; expected the Tampere quartet",
    missing="has no {walk} {role}.csv; expected rss, coordinates, device, date of each part",
    companions={
        "coordinates": dict.fromkeys("xyz", pl.Float64()),
        "device": {"device": pl.String()},
        "date": {"date": pl.String()},
    },
    optional=("device", "date"),
    fields={
        **{name: pl.col(name) for name in ("x", "y", "z", "device")},
        "floor": _FLOOR,
        "time_ns": _TIME.cast(pl.Int64),
        "date": _TIME.cast(pl.Date),
        "part": pl.col(WALK).replace_strict({"training": TRAIN, "test": TEST}),
        "session": pl.concat_str("device", _TIME.cast(pl.Date), separator=" ", ignore_nulls=True),
    },
    checks=(
        RowCheck(
            "height_off_floor",
            "coordinates",
            ((_STOREY - _FLOOR) * STOREY_M).abs() > _OFF_FLOOR_M,
            "heights are no multiple of 3.7 m; the nearest floor counts",
        ),
        RowCheck(
            "unreadable_dates",
            "date",
            _TIME.is_null() & pl.col("date").is_not_null(),
            "dates are not like 2017-08-18 11:59:23; they are left out",
        ),
    ),
)
TABLES.register()
