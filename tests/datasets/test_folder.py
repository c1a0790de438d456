"""A data set that was made before the rules about radio readings keeps them when it is opened.

A data set written and read back, and what is said of a damaged one.
"""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import polars as pl
import pytest
from polars.testing import assert_frame_equal

from tests.cli.command import vislam2tag
from tests.datasets.factory import small_dataset
from vislam2tag.common.errors import DatasetError, OutputError
from vislam2tag.common.files.own_files import OWN_FILES, OwnFiles
from vislam2tag.datasets.folder import (
    MANIFEST,
    dataset_folder,
    is_dataset,
    open_dataset,
    sha256_of,
    with_rules,
    write_dataset,
)
from vislam2tag.datasets.model import Dataset, Fold, Split, SplitInfo
from vislam2tag.datasets.schema import FINGERPRINTS, READINGS


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


def with_split(dataset: Dataset) -> Dataset:
    ids = dataset.fingerprints.select(id="scan_id").collect()
    groups = ids.with_columns(
        group=pl.when(pl.int_range(pl.len()) % 3 == 0).then(pl.lit("test")).otherwise(pl.lit("train"))
    )
    info = SplitInfo(name="thirds", kind="random", folds=(Fold(name="thirds", test=("test",)),))
    return Dataset(dataset.info, dataset.tables, {"thirds": Split(info, groups)})


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    dataset = with_split(small_dataset())
    found = write_dataset(dataset, tmp_path / "set")
    for name, table in dataset.tables.items():
        assert_frame_equal(found.tables[name].collect(), table.collect())
    assert_frame_equal(found.splits["thirds"].groups, dataset.splits["thirds"].groups)
    assert found.splits["thirds"].info == dataset.splits["thirds"].info
    assert found.info.floors == dataset.info.floors
    assert found.info.tables["fingerprints"].rows == dataset.fingerprints.collect().height


def test_same_set_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        write_dataset(with_split(small_dataset()), tmp_path / name)
    files = sorted(path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*") if path.is_file())
    assert len(files) == 8
    assert all((tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes() for file in files)


def test_parts_of_a_fold() -> None:
    split = with_split(small_dataset()).splits["thirds"]
    train, test = split.train_test_ids(split.fold("thirds"))
    assert len(test) * 2 == len(train)
    assert not set(train) & set(test)
    with pytest.raises(KeyError):
        split.fold("none")


def write_as(target: Path, command: str, replace: bool = False) -> None:
    dataset = small_dataset()
    with dataset_folder(target, command, replace) as folder:
        folder.add_tables(dataset.tables)
        folder.finish(dataset.info)


def test_another_command_replaces_only_when_told(tmp_path: Path) -> None:
    target = tmp_path / "set"
    write_dataset(small_dataset(), target)
    write_as(target, "import")
    write_as(target, "import")
    with pytest.raises(OutputError, match="set: contains the output of `vislam2tag import`; pass --replace"):
        write_as(target, "join")
    assert open_dataset(target).info.made_by == "import"
    write_as(target, "join", replace=True)
    assert open_dataset(target).info.made_by == "join"
    write_dataset(open_dataset(target), tmp_path / "copy")
    assert open_dataset(tmp_path / "copy").info.made_by == "join"


def test_labels_are_replaced_only_when_told_and_a_survey_never(tmp_path: Path) -> None:
    target = tmp_path / "labels"
    target.mkdir()
    (target / "run.json").write_text('{"program": "vislam2tag"}')
    (target / OWN_FILES).write_text(OwnFiles.of(["run.json"]).text())
    with pytest.raises(OutputError, match="contains the output of `vislam2tag process`; pass --replace"):
        write_as(target, "dataset")
    (target / "floor_1" / "LG" / "first").mkdir(parents=True)
    with pytest.raises(OutputError, match="contains the floor folders of a survey"):
        write_as(target, "dataset", replace=True)
    shutil.rmtree(target / "floor_1")
    write_as(target, "dataset", replace=True)
    assert open_dataset(target).info.made_by == "dataset"
    assert not (target / "run.json").exists()


def test_a_failed_write_leaves_what_was_there(tmp_path: Path) -> None:
    target = tmp_path / "set"
    write_dataset(small_dataset(), target)
    before = (target / MANIFEST).read_bytes()
    with pytest.raises(RuntimeError):
        _write_half(target)
    assert (target / MANIFEST).read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["set"]


def _write_half(target: Path) -> None:
    with dataset_folder(target) as folder:
        folder.add_tables(small_dataset().tables)
        raise RuntimeError


def test_a_foreign_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(OutputError, match="is not empty"):
        write_dataset(small_dataset(), tmp_path)
    with pytest.raises(OutputError, match="is a file"):
        write_dataset(small_dataset(), tmp_path / "mine.txt")


def accounted(root: Path, name: str, table: pl.DataFrame) -> None:
    """Replace a table, and its checksum in the manifest."""
    table.write_parquet(root / name)
    manifest = json.loads((root / MANIFEST).read_bytes())
    manifest["tables"][name.removesuffix(".parquet")]["sha256"] = sha256_of(root / name)
    (root / MANIFEST).write_text(json.dumps(manifest))


def with_plan(root: Path, plan: str) -> None:
    manifest = json.loads((root / MANIFEST).read_bytes())
    manifest["floors"][0]["plan"] = plan
    (root / MANIFEST).write_text(json.dumps(manifest))


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda root: (root / MANIFEST).write_text("{}"), "is damaged"),
        (lambda root: (root / MANIFEST).write_text('{"format_version": 99}'), "format version 99"),
        (lambda root: (root / "readings.parquet").write_text("no"), "is damaged, or was changed"),
        (lambda root: (root / "splits" / "thirds.parquet").write_text("no"), "is damaged, or was changed"),
        (lambda root: (root / MANIFEST).write_text('{"format_version": 1e999}'), "is damaged"),
        (lambda root: (root / MANIFEST).write_text("[" * 100_000), "is damaged"),
        (lambda root: (root / "readings.parquet").unlink(), "cannot be read"),
        (lambda root: accounted(root, "readings.parquet", pl.DataFrame({"scan_id": ["a"]})), "column bssid"),
        (lambda root: with_plan(root, "../../secret.png"), "is outside the data set"),
        (lambda root: (root / "splits" / "thirds.json").write_text("no"), "make the split again"),
    ],
)
def test_a_damaged_set_is_told(tmp_path: Path, damage: object, said: str) -> None:
    target = tmp_path / "set"
    write_dataset(with_split(small_dataset()), target)
    assert callable(damage)
    damage(target)
    with pytest.raises(DatasetError, match=said):
        open_dataset(target)


def test_no_set(tmp_path: Path) -> None:
    assert not is_dataset(tmp_path)
    with pytest.raises(DatasetError, match="not a data set"):
        open_dataset(tmp_path)


@pytest.mark.parametrize("name", [FINGERPRINTS, READINGS])
@pytest.mark.parametrize("place", [1e300, float("nan"), float("-inf")])
def test_places_that_are_none_on_earth_are_refused(tmp_path: Path, place: float, name: str) -> None:
    dataset = small_dataset()
    rows = dataset.tables[name].with_columns(x=pl.when(pl.int_range(pl.len()) == 3).then(place).otherwise("x"))
    with pytest.raises(
        DatasetError, match=rf"{name}\.parquet: contains positions beyond 1e\+08 m, or that are not finite"
    ):
        write_dataset(replace(dataset, tables={**dataset.tables, name: rows}), tmp_path / "ds")
