"""Fingerprints of a data set as arrays, and the parts of a split.

A model's scans and a later survey: what is gone or was moved is left out of the old ones, known scans come once.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from tests.datasets.factory import ACCESS_POINTS_A_FLOOR, FLOORS, SCANS, SESSION_KEYS, small_dataset
from tests.positioning.radio_world import radio_world
from vislam2tag.common.errors import DatasetError
from vislam2tag.datasets.model import Dataset, Fold, Split, SplitInfo
from vislam2tag.datasets.schema import FINGERPRINTS
from vislam2tag.positioning.learning_data import learning_data, updated
from vislam2tag.positioning.models.weighted_knn import NearestNeighbours
from vislam2tag.positioning.places import LabelledScans, joined_places
from vislam2tag.positioning.radio_scans import joined_scans


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


KNOWN = radio_world(seed=1, walks=10)
SWAPPED = {"ap-1-1": "ap-1-2", "ap-1-2": "ap-1-1"}


@pytest.fixture(scope="module")
def later() -> LabelledScans:
    """A later survey: an access point is gone, two changed their places, one is new."""
    scans, places = radio_world(seed=2, walks=10)
    scans = scans.only(np.array(scans.access_points)[scans.column] != "ap-0-0")
    names = {**SWAPPED, "ap-0-3": "ap-9"}
    renamed = replace(scans, access_points=tuple(names.get(name, name) for name in scans.access_points))
    return renamed.over(sorted(renamed.access_points)), places


def test_what_changed_is_left_out_of_the_old_scans_alone(later: LabelledScans) -> None:
    update = updated(KNOWN, later)
    assert update.gone == ("ap-0-0", "ap-0-3")
    assert update.moved == ("ap-1-1", "ap-1-2")
    assert update.new == ("ap-9",)
    scans, places = update.learned
    assert (len(scans), update.added) == (len(places), len(later[0]))
    old = scans[: len(scans) - update.added]
    heard = {old.access_points[column] for column in old.column}
    assert heard == set(KNOWN[0].access_points) - {"ap-0-0", "ap-0-3", "ap-1-1", "ap-1-2"}
    np.testing.assert_array_equal(
        scans[len(scans) - update.added :].over(later[0].access_points).dense(), later[0].dense()
    )


def test_an_updated_model_errs_less_than_one_that_is_not(later: LabelledScans) -> None:
    scans, places = radio_world(seed=3)
    names = {**SWAPPED, "ap-0-3": "ap-9", "ap-0-0": "gone"}
    asked = replace(scans, access_points=tuple(names.get(name, name) for name in scans.access_points))
    before = NearestNeighbours().fit(*KNOWN)
    after = NearestNeighbours().fit(*updated(before.learned(), (later[0][::2], later[1][::2])).learned)
    assert after.score(asked, places) > before.score(asked, places)


def test_scans_that_are_known_come_once(later: LabelledScans) -> None:
    both = joined_scans([KNOWN[0], later[0]]), joined_places([KNOWN[1], later[1]])
    one, other = updated(KNOWN, later), updated(KNOWN, both)
    assert (one.added, one.moved) == (other.added, other.moved)
    np.testing.assert_array_equal(one.learned[0].dense(), other.learned[0].dense())
    with pytest.raises(DatasetError, match="nothing to update"):
        updated(KNOWN, KNOWN)
