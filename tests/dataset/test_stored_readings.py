"""A data set that was made before the rules about radio readings keeps them when it is opened."""

from __future__ import annotations

from pathlib import Path

import polars as pl

from tests.cli.command import vislam2tag
from tests.dataset.factory import small_dataset
from vislam2tag.dataset.folder import write_dataset
from vislam2tag.dataset.stored_readings import with_rules


def test_a_data_set_that_keeps_the_rules_is_as_it_was() -> None:
    dataset = small_dataset()
    assert with_rules(dataset) is dataset


def test_older_data_sets_match(tmp_path: Path) -> None:
    old = small_dataset()
    points = old.access_points.collect()["bssid"].to_list()
    names = {name: name.replace(":", "").upper() if n % 2 else name.replace(":", "-") for n, name in enumerate(points)}
    renamed = {
        name: table.with_columns(pl.col("bssid").replace(old=names)) if "bssid" in table.collect_schema() else table
        for name, table in old.tables.items()
    }
    made = write_dataset(type(old)(old.info, renamed, old.splits, old.files), tmp_path / "old")
    assert sorted(made.access_points.collect()["bssid"]) == sorted(points)
    assert made.readings.collect()["bssid"].to_list() == old.readings.collect()["bssid"].to_list()
    stored = pl.read_parquet(tmp_path / "old" / "readings.parquet")
    assert stored["bssid"].to_list() != old.readings.collect()["bssid"].to_list()


def test_training_leaves_impossible_levels_of_older_data_sets_out(tmp_path: Path) -> None:
    old = small_dataset()
    level = pl.when(pl.int_range(pl.len()) < 3).then(pl.lit(65.0)).otherwise("rssi_dbm").cast(pl.Float32)
    odd = {**old.tables, "readings": old.readings.with_columns(rssi_dbm=level)}
    made = write_dataset(type(old)(old.info, odd, old.splits, old.files), tmp_path / "odd")
    assert made.readings.collect().height == old.readings.collect().height - 3
    assert made.fingerprints.collect()["readings"].sum() == made.readings.collect().height
    done = vislam2tag("train", tmp_path / "odd", "--model", "weighted-knn", "--out", tmp_path / "odd.v2t")
    assert done.returncode == 0, done.stderr
    assert "absurd_levels 3: signal strengths must be from -126 to -1 dBm" in done.stdout
