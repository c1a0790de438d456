"""WiFine (Khassanov et al. 2021): trajectories of scans, a CSV each, in the folders ``train``, ``val`` and ``test``.

Columns of levels (-100: not heard) named by numbers from 0, then ``num_visible_APs``, ``timestamp`` in seconds since
the walk's start, ``x``, ``y``, ``z`` in metres and ``floorID``. A session is one trajectory.
"""

from __future__ import annotations

import re

import polars as pl

from vislam2tag.datasets.fingerprint_tables import FILE, WALK, FingerprintTables, SetDescription
from vislam2tag.datasets.model import TEST, TRAIN

TABLES = FingerprintTables(
    SetDescription(
        "wifine",
        name="wifine",
        title="WiFine: finer-level sequential WiFi-based indoor localization",
        description="One university building, three floors, walked with one phone.",
        licence="MIT",
        creators=(
            "Yerbolat Khassanov",
            "Mukhamet Nurpeiissov",
            "Azamat Sarkytbayev",
            "Askat Kuzdeuov",
            "Huseyin Atakan Varol",
        ),
        clock="boot",
    ),
    files=re.compile(r"(train|val|test)_[0-9a-z_]+\.csv", re.IGNORECASE),
    recognised_by=re.compile(r"(train|val|test)/\1_[0-9a-z_]+\.csv", re.IGNORECASE),
    none_found="holds no train/train_*.csv, val/val_*.csv or test/test_*.csv of WiFine",
    columns=dict.fromkeys(("num_visible_APs", "timestamp", "x", "y", "z", "floorID"), pl.Float64()),
    access_points=re.compile(r"\d+"),
    access_point_name="ap{}",
    needed=("x", "y", "floorID"),
    not_heard=-100.0,
    lone_part=False,
    fields={
        **{name: pl.col(name) for name in "xyz"},
        "floor": pl.col("floorID").cast(pl.Int32),
        "session": pl.col(FILE),
        "time_ns": (pl.col("timestamp") * 1e9).round().cast(pl.Int64),
        "part": pl.when(pl.col(WALK).str.starts_with("train")).then(pl.lit(TRAIN)).otherwise(pl.lit(TEST)),
    },
)
TABLES.register()
