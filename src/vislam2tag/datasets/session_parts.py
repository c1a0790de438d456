"""The tables of a data set while it is made: rows of one session at a time, in files that are joined at the end."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import polars as pl

from vislam2tag.common.files.folder import Folder
from vislam2tag.common.files.table_files import scan_parquet, write_parquet
from vislam2tag.datasets.access_points import access_point_table
from vislam2tag.datasets.schema import SCHEMAS

NAMES = "names"
"""Parts that say how often each transmitter was heard by each name; no table of the data set."""


def write_part(folder: Folder, number: int, tables: Mapping[str, pl.DataFrame]) -> None:
    """Write one session's rows of some tables, and its NAMES; ``number`` is its place in the order of all."""
    for name, rows in tables.items():
        write_parquet(rows, folder, f"{name}/{number:06d}.parquet", compression="lz4")


def tables_of(folder: Path) -> dict[str, pl.LazyFrame]:
    """Scan the rows of all sessions, table by table."""
    return {name: _rows(folder, name) for name in SCHEMAS if (folder / name).is_dir()}


def access_points_of(folder: Path, fingerprints: pl.LazyFrame, readings: pl.LazyFrame) -> pl.DataFrame:
    """Make the table of access points of what all sessions heard, and of their NAMES in ``folder``."""
    names = _rows(folder, NAMES).group_by("bssid", "technology", "ssid").agg(pl.col("count").sum())
    counted = names.sort("bssid", "technology", "ssid").collect(engine="streaming")
    return access_point_table(fingerprints, readings, counted)


def _rows(folder: Path, name: str) -> pl.LazyFrame:
    return scan_parquet(sorted((folder / name).glob("*.parquet")))
