"""UJI's long-term library set (Mendoza-Silva et al., Data 2018, 3(1), 3): months of a folder each, four files a walk.

``MM/trnNNrss.csv`` (levels, 100: not heard), ``...crd.csv`` (x, y in metres, floor), ``...tms.csv`` (local time as
digits from year to millisecond) and ``...ids.csv``, and the same of ``tst``; no headers. In the split that comes along
the first month's ``trn`` trains and what is later tests; the first month's own tests say nothing of change and are in
neither part.
"""

from __future__ import annotations

import re

import polars as pl

from vislam2tag.datasets.fingerprint_tables import FOLDER, WALK, FingerprintTables, RowCheck, SetDescription
from vislam2tag.datasets.model import TEST, TRAIN

_TIME = pl.col("time").str.to_datetime("%Y%m%d%H%M%S%3f", time_unit="ns", strict=False)
TABLES = FingerprintTables(
    SetDescription(
        "uji-library",
        name="uji-library",
        title="Long-Term Wi-Fi fingerprinting dataset for robust indoor positioning",
        description="Two floors of a university library, walked each month with one phone.",
        licence="CC-BY-4.0",
        creators=(
            "Germán Martín Mendoza-Silva",
            "Philipp Richter",
            "Joaquín Torres-Sospedra",
            "Elena Simona Lohan",
            "Joaquín Huerta",
        ),
    ),
    files=re.compile(r"(?P<walk>(trn|tst)\d\d)(?P<role>rss|crd|tms|ids)\.csv", re.IGNORECASE),
    none_found="holds no MM/trnNNrss.csv; expected UJI's long-term library set",
    missing="month {folder} has no {walk}{role}.csv; expected rss, crd, tms",
    by_folder=True,
    companions={"crd": dict.fromkeys(("x", "y", "floor"), pl.Float64()), "tms": {"time": pl.String()}},
    fields={
        **{name: pl.col(name) for name in "xy"},
        "floor": pl.col("floor").cast(pl.Int32),
        "time_ns": _TIME.cast(pl.Int64),
        "date": _TIME.cast(pl.Date),
        "session": pl.format("month_{}.{}", FOLDER, WALK),
        "part": pl.when(pl.col(FOLDER) > pl.col(FOLDER).min())
        .then(pl.lit(TEST))
        .when(pl.col(WALK).str.starts_with("trn"))
        .then(pl.lit(TRAIN)),
    },
    checks=(
        RowCheck(
            "unreadable_dates",
            "tms",
            _TIME.is_null() & pl.col("time").is_not_null(),
            "times are not digits from year to millisecond; they are left out",
        ),
    ),
)
TABLES.register()
