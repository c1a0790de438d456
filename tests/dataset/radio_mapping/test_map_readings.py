"""What radio maps are made of: labelled readings of a floor, without the phones' offsets, in folds of whole walks."""

from __future__ import annotations

import numpy as np
import polars as pl

from tests.dataset.factory import SCANS, bssid, small_dataset
from vislam2tag.dataset.model import Dataset
from vislam2tag.dataset.radio_mapping.map_readings import FOLDS, MapPlace, heard_at, map_readings, offsets_db
from vislam2tag.dataset.schema import FINGERPRINTS, READINGS

PLACE = MapPlace("", 1, "wifi")
NAMES = (bssid(1, 0), bssid(0, 2))


def louder(dataset: Dataset, device: str, offset_db: float) -> Dataset:
    """Move both phones to the same way and let one hear louder."""
    same = dataset.fingerprints.with_columns(y=pl.when(pl.col("x").is_not_null()).then(12.0))
    own = pl.col("scan_id").str.contains(device, literal=True)
    readings = dataset.readings.with_columns(
        y=pl.when(pl.col("x").is_not_null()).then(12.0), rssi_dbm=-50.0 + own.cast(pl.Float32) * offset_db
    )
    return Dataset(dataset.info, {**dataset.tables, FINGERPRINTS: same, READINGS: readings})


def test_only_labelled_readings_of_the_floor_count() -> None:
    found = map_readings(small_dataset(unlabelled=2), PLACE, NAMES, {})
    assert found.bssids == tuple(sorted(NAMES))
    assert len(found.scan_position) == 2 * (SCANS - 2)
    expected = small_dataset(unlabelled=2).readings.filter(pl.col("floor") == 1, pl.col("bssid").is_in(NAMES)).collect()
    assert len(found.scan) == len(expected)
    np.testing.assert_allclose(np.sort(found.rssi_dbm), expected["rssi_dbm"].sort().to_numpy(), rtol=1e-6)
    np.testing.assert_array_equal(found.position, found.scan_position[found.scan])


def test_a_reading_without_a_place_of_its_own_is_only_heard() -> None:
    dataset = small_dataset()
    readings = dataset.readings.with_columns(pl.when(pl.col("bssid") != NAMES[0]).then(pl.col("x", "y", "floor")))
    found = map_readings(Dataset(dataset.info, {**dataset.tables, READINGS: readings}), PLACE, NAMES, {})
    whole = map_readings(dataset, PLACE, NAMES, {})
    assert len(found.scan) == len(whole.scan)
    without, other = found.indices(NAMES).tolist()
    assert len(found.of(without)[1]) == 0
    assert len(found.of(other)[1]) == len(whole.of(other)[1]) > 0


def test_folds_are_whole_walks_or_stretches_of_the_only_one() -> None:
    dataset = small_dataset()
    two = map_readings(dataset, PLACE, NAMES, {})
    assert two.scan_fold.tolist() == [0] * (SCANS - 1) + [1] * (SCANS - 1)
    one_walk = dataset.fingerprints.filter(pl.col("device") == "Pixel")
    one = map_readings(Dataset(dataset.info, {**dataset.tables, FINGERPRINTS: one_walk}), PLACE, NAMES, {})
    assert one.scan_fold.tolist() == sorted(one.scan_fold.tolist())
    assert set(one.scan_fold.tolist()) == set(range(FOLDS))


def test_offsets_of_phones_are_found_and_taken_off() -> None:
    dataset = louder(small_dataset(), "Pixel", 6.0)
    offsets = offsets_db(dataset)
    assert {key: round(value, 3) for key, value in offsets.items()} == {
        ("wifi", "Galaxy"): -3.0,
        ("wifi", "Pixel"): 3.0,
    }
    found = map_readings(dataset, PLACE, NAMES, offsets)
    np.testing.assert_allclose(found.rssi_dbm, -47.0)


def test_one_phone_has_no_offset() -> None:
    dataset = small_dataset()
    one = dataset.fingerprints.filter(pl.col("device") == "Pixel")
    assert offsets_db(Dataset(dataset.info, {**dataset.tables, FINGERPRINTS: one})) == {}


def test_the_most_heard_of_each_floor_come_first() -> None:
    counts = heard_at(small_dataset())
    for _, own in counts.group_by("building", "floor", "technology", maintain_order=True):
        assert own["readings"].to_list() == own["readings"].sort(descending=True).to_list()
    assert counts["floor"].unique(maintain_order=True).to_list() == [0, 1]
    assert counts["readings"].sum() == small_dataset().readings.filter(pl.col("x").is_not_null()).collect().height
