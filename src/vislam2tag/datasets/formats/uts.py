"""UTSIndoorLoc (Song et al., CNNLoc, IEEE Access 2019): ``UTS_training.csv`` and ``UTS_test.csv``, a row a fingerprint.

589 columns of levels (100: not heard), then ``Pos_x``, ``Pos_y`` in metres and ``Floor_ID``; the published files have
further columns, of which building, user and phone are taken. Which rows belong to one walk is not known: each file is
one session.
"""

from __future__ import annotations

import re

import polars as pl

from vislam2tag.datasets.fingerprint_tables import FILE, WALK, FingerprintTables, SetDescription
from vislam2tag.datasets.model import TEST, TRAIN

_PLACE = ("Pos_x", "Pos_y", "Floor_ID")
TABLES = FingerprintTables(
    SetDescription(
        "uts",
        name="uts",
        title="UTSIndoorLoc",
        description="One university building of several floors.",
        clock="none",
    ),
    files=re.compile(r"UTS_(training|test)\.csv", re.IGNORECASE),
    none_found="holds no UTS_training.csv or UTS_test.csv; expected UTSIndoorLoc's files",
    columns={
        **dict.fromkeys(_PLACE, pl.Float64()),
        **dict.fromkeys(("Building_ID", "User_ID", "Phone_type"), pl.String()),
    },
    access_points=re.compile(r"W?AP[_ ]?\d+", re.IGNORECASE),
    needed=_PLACE,
    gaps_allowed=True,
    fields={
        "building": pl.col("Building_ID"),
        "floor": pl.col("Floor_ID").cast(pl.Int32, strict=False),
        "x": pl.col("Pos_x"),
        "y": pl.col("Pos_y"),
        "device": pl.col("Phone_type"),
        "user": pl.col("User_ID"),
        "session": pl.col(FILE),
        "part": pl.col(WALK).replace_strict({"uts_training": TRAIN, "uts_test": TEST}),
    },
)
TABLES.register()
