"""Plain CSV tables, read by pandas."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import polars as pl

from tests.datasets.factory import small_dataset
from tests.datasets.formats.round_trip import exported, odd_dataset, with_split


def test_pandas_reads_all_rows_of_all_tables(tmp_path: Path) -> None:
    dataset = odd_dataset()
    assert exported(dataset, "csv", tmp_path) == ()
    for name in ("fingerprints", "readings", "access_points", "sessions"):
        known = dataset.tables[name].collect()
        read = pd.read_csv(tmp_path / f"{name}.csv", dtype=object, keep_default_na=False)
        texts = known.select(
            pl.col(str(column)).cast(pl.String).fill_null("") for column in read if column != "started"
        )
        assert [list(row) for row in texts.rows()] == read.drop(columns="started", errors="ignore").to_numpy().tolist()
    columns = pd.read_csv(tmp_path / "columns.csv").set_index(["table", "column"])
    assert columns.loc[("fingerprints", "x"), "unit"] == "m, BCS"
    for name in {table for table, _ in columns.index} - {"splits"}:
        assert [each for table, each in columns.index if table == name] == list(pd.read_csv(tmp_path / f"{name}.csv"))


def test_splits_are_one_table(tmp_path: Path) -> None:
    dataset = with_split(small_dataset())
    exported(dataset, "csv", tmp_path)
    splits = pd.read_csv(tmp_path / "splits.csv", dtype=str).fillna("")
    for name, split in dataset.splits.items():
        own = splits[splits["split"] == name]
        assert dict(zip(own["id"], own["group"], strict=True)) == dict(split.groups.fill_null("").rows())


def test_names_that_a_spreadsheet_would_run_get_an_apostrophe(tmp_path: Path) -> None:
    dataset = small_dataset()
    named = dataset.tables["access_points"].with_columns(ssid=pl.lit("=1+1"))
    dataset.tables["access_points"] = named  # type: ignore[index]
    exported(dataset, "csv", tmp_path / "kept", escape_formulas=False)
    exported(dataset, "csv", tmp_path / "escaped")
    for folder, ssid in (("kept", "=1+1"), ("escaped", "'=1+1")):
        assert set(pd.read_csv(tmp_path / folder / "access_points.csv")["ssid"]) == {ssid}
