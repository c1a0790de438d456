"""Fingerprints of a data set as arrays, and the parts of a split."""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest

from tests.datasets.factory import ACCESS_POINTS_A_FLOOR, FLOORS, SCANS, SESSION_KEYS, small_dataset
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.model import Dataset, Fold, Split, SplitInfo
from vislam2tag.datasets.schema import FINGERPRINTS
from vislam2tag.positioning.learning_data import learning_data


def test_arrays_are_the_tables() -> None:
    dataset = small_dataset(unlabelled=2)
    data = learning_data(dataset)
    assert len(data) == (SCANS - 2) * len(SESSION_KEYS)
    table = dataset.fingerprints.collect().filter(pl.col("x").is_not_null())
    assert data.ids.tolist() == table["scan_id"].to_list()
    np.testing.assert_array_equal(data.places.xy, table.select("x", "y").to_numpy())
    np.testing.assert_array_equal(data.places.floor, table["floor"].to_numpy())
    assert len(data.scans.access_points) == ACCESS_POINTS_A_FLOOR * len(FLOORS)
    one = dataset.readings.filter(pl.col("scan_id") == data.ids[3]).collect()
    row = dict(zip(data.scans.access_points, data.scans[np.array([3])].dense()[0], strict=True))
    assert {name: level for name, level in row.items() if np.isfinite(level)} == dict(
        zip(one["bssid"], one["rssi_dbm"], strict=True)
    )


def test_parts_of_a_fold_hold_its_groups_only() -> None:
    data = learning_data(small_dataset())
    groups = pl.DataFrame({"id": data.ids.tolist(), "group": data.scans.device.tolist()})
    fold = Fold(name="Pixel", test=("Pixel",))
    split = Split(SplitInfo(name="device", kind="device", folds=(fold,)), groups)
    train, test = data.train_test(split, fold)
    assert set(train.scans.device) == {"Galaxy"}
    assert set(test.scans.device) == {"Pixel"}
    assert len(train) + len(test) == len(data)


def test_uncertain_labels_are_not_learned_from() -> None:
    dataset = small_dataset()
    status = pl.when(pl.col("device") == "Pixel").then(pl.lit("uncertain")).otherwise(pl.col("status"))
    doubted = {**dataset.tables, FINGERPRINTS: dataset.fingerprints.with_columns(status=status)}
    assert set(learning_data(Dataset(dataset.info, doubted)).scans.device) == {"Galaxy"}


def test_nothing_labelled() -> None:
    dataset = small_dataset(unlabelled=SCANS)
    with pytest.raises(DatasetError, match="no labelled fingerprint"):
        learning_data(dataset)
    with pytest.raises(DatasetError, match="technology ble"):
        learning_data(Dataset(dataset.info, small_dataset().tables), "ble")
