"""What radio maps are made of: labelled readings of a floor, without the phones' offsets, in folds of whole walks.

The Gaussian process behind a radio map.
"""

from __future__ import annotations

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.datasets.factory import SCANS, bssid, small_dataset
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.datasets import map_process
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.schema import FINGERPRINTS, READINGS

PLACE = map_process.MapPlace("", 1, "wifi")
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
    found = map_process.map_readings(small_dataset(unlabelled=2), PLACE, NAMES, {})
    assert found.bssids == tuple(sorted(NAMES))
    assert len(found.scan_position) == 2 * (SCANS - 2)
    expected = small_dataset(unlabelled=2).readings.filter(pl.col("floor") == 1, pl.col("bssid").is_in(NAMES)).collect()
    assert len(found.scan) == len(expected)
    np.testing.assert_allclose(np.sort(found.rssi_dbm), expected["rssi_dbm"].sort().to_numpy(), rtol=1e-6)
    np.testing.assert_array_equal(found.position, found.scan_position[found.scan])


def test_a_reading_without_a_place_of_its_own_is_only_heard() -> None:
    dataset = small_dataset()
    readings = dataset.readings.with_columns(pl.when(pl.col("bssid") != NAMES[0]).then(pl.col("x", "y", "floor")))
    found = map_process.map_readings(Dataset(dataset.info, {**dataset.tables, READINGS: readings}), PLACE, NAMES, {})
    whole = map_process.map_readings(dataset, PLACE, NAMES, {})
    assert len(found.scan) == len(whole.scan)
    without, other = found.indices(NAMES).tolist()
    assert len(found.of(without)[1]) == 0
    assert len(found.of(other)[1]) == len(whole.of(other)[1]) > 0


def test_folds_are_whole_walks_or_stretches_of_the_only_one() -> None:
    dataset = small_dataset()
    two = map_process.map_readings(dataset, PLACE, NAMES, {})
    assert two.scan_fold.tolist() == [0] * (SCANS - 1) + [1] * (SCANS - 1)
    one_walk = dataset.fingerprints.filter(pl.col("device") == "Pixel")
    one = map_process.map_readings(Dataset(dataset.info, {**dataset.tables, FINGERPRINTS: one_walk}), PLACE, NAMES, {})
    assert one.scan_fold.tolist() == sorted(one.scan_fold.tolist())
    assert set(one.scan_fold.tolist()) == set(range(map_process.FOLDS))


def test_offsets_of_phones_are_found_and_taken_off() -> None:
    dataset = louder(small_dataset(), "Pixel", 6.0)
    offsets = map_process.offsets_db(dataset)
    assert {key: round(value, 3) for key, value in offsets.items()} == {
        ("wifi", "Galaxy"): -3.0,
        ("wifi", "Pixel"): 3.0,
    }
    found = map_process.map_readings(dataset, PLACE, NAMES, offsets)
    np.testing.assert_allclose(found.rssi_dbm, -47.0)


def test_one_phone_has_no_offset() -> None:
    dataset = small_dataset()
    one = dataset.fingerprints.filter(pl.col("device") == "Pixel")
    assert map_process.offsets_db(Dataset(dataset.info, {**dataset.tables, FINGERPRINTS: one})) == {}


def test_the_most_heard_of_each_floor_come_first() -> None:
    counts = map_process.heard_at(small_dataset())
    for _, own in counts.group_by("building", "floor", "technology", maintain_order=True):
        assert own["readings"].to_list() == own["readings"].sort(descending=True).to_list()
    assert counts["floor"].unique(maintain_order=True).to_list() == [0, 1]
    assert counts["readings"].sum() == small_dataset().readings.filter(pl.col("x").is_not_null()).collect().height


KERNEL = map_process.MapKernel()
FAR_M = 1e9


def readings(count: int, seed: int) -> tuple[FloatArray, FloatArray, IntArray]:
    rng = np.random.default_rng(seed)
    position = rng.uniform(0, 20, (count, 2))
    covariance = KERNEL.smooth()(position) + KERNEL.noise_db**2 * np.eye(count)
    rssi = -60 + rng.multivariate_normal(np.zeros(count), covariance)
    return position, rssi, rng.integers(0, 5, count)


@given(seed=st.integers(0, 1000), count=st.integers(10, 40))
@settings(max_examples=15)
def test_left_out_readings_are_predicted_as_without_them(seed: int, count: int) -> None:
    position, rssi, fold = readings(count, seed)
    process = map_process.fit_process(map_process.map_points(position, rssi, fold, 1000), rssi, KERNEL, FAR_M)
    own = fold == fold[0]
    if own.all():
        return
    rest = map_process.map_points(
        position[~own], rssi[~own] - process.level_dbm, np.zeros((~own).sum(), dtype=np.int64), 1000
    )
    covariance = KERNEL.smooth()(rest.position) + KERNEL.noise_db**2 * np.eye(len(rest.rssi_dbm))
    cross = KERNEL.smooth()(position[own], rest.position)
    mean = process.level_dbm + cross @ np.linalg.solve(covariance, rest.rssi_dbm)
    variance = np.diag(KERNEL.smooth()(position[own]) - cross @ np.linalg.solve(covariance, cross.T))
    np.testing.assert_allclose(process.left_out.error_db[own], rssi[own] - mean, atol=1e-6)
    stated = process.scale * np.sqrt(variance + KERNEL.noise_db**2)
    np.testing.assert_allclose(process.left_out.deviation_db[own], stated, atol=1e-6)
    apart = np.linalg.norm(position[own][:, None] - rest.position, axis=2).min(axis=1)
    np.testing.assert_allclose(process.left_out.distance_m[own], apart)


def test_without_other_folds_nothing_is_near() -> None:
    position, rssi, fold = readings(20, 1)
    process = map_process.fit_process(map_process.map_points(position, rssi, 0 * fold, 1000), rssi, KERNEL, 3.0)
    assert np.isinf(process.left_out.distance_m).all()
    assert process.scale == 1.0


def test_far_from_all_readings_the_mean_is_their_level_and_unsure() -> None:
    position, rssi, fold = readings(30, 2)
    process = map_process.fit_process(map_process.map_points(position, rssi, fold, 1000), rssi, KERNEL, 3.0)
    mean, deviation, sigma = process.at(np.array([[1000.0, 1000.0]]))
    assert mean[0] == pytest.approx(rssi.mean())
    assert sigma[0] == pytest.approx(process.scale * np.hypot(KERNEL.trend_db, KERNEL.shadowing_db))
    assert deviation[0] == pytest.approx(np.hypot(sigma[0], process.scale * KERNEL.noise_db))


def test_deviations_follow_the_readings() -> None:
    position, rssi, fold = readings(300, 3)
    honest = map_process.fit_process(map_process.map_points(position, rssi, fold, 1000), rssi, KERNEL, FAR_M)
    noisy = rssi + np.random.default_rng(4).normal(0, 9, len(rssi))
    wild = map_process.fit_process(map_process.map_points(position, noisy, fold, 1000), noisy, KERNEL, FAR_M)
    assert honest.scale == pytest.approx(1, abs=0.15)
    assert wild.scale > 2


def test_few_readings_stay_as_they_are() -> None:
    position, rssi, fold = readings(50, 5)
    points = map_process.map_points(position, rssi, fold, 50)
    assert points.square_m is None
    np.testing.assert_array_equal(points.position, position)
    assert points.readings.tolist() == [1] * 50


def test_many_readings_become_means_of_squares_and_folds() -> None:
    position, rssi, fold = readings(400, 6)
    points = map_process.map_points(position, rssi, fold, 100)
    assert points.square_m is not None
    assert len(points.rssi_dbm) <= 100
    assert points.readings.sum() == 400
    np.testing.assert_array_equal(points.fold[points.of_reading], fold)
    np.testing.assert_allclose(points.rssi_dbm @ points.readings, rssi.sum())
    assert (np.abs(points.position[points.of_reading] - position) < points.square_m).all()


def test_means_of_squares_hardly_change_a_map() -> None:
    position, rssi, fold = readings(600, 7)
    at = np.random.default_rng(8).uniform(2, 18, (50, 2))
    single, square = (
        map_process.fit_process(map_process.map_points(position, rssi, fold, most), rssi, KERNEL, FAR_M).at(at)[0]
        for most in (1000, 599)
    )
    assert np.sqrt(((single - square) ** 2).mean()) < 0.5


def test_the_kernel_of_generated_readings_is_found() -> None:
    true = map_process.MapKernel(trend_db=8, trend_m=20, shadowing_db=5, shadowing_m=2, noise_db=1.5)
    rng = np.random.default_rng(9)
    count, points = 120, 6
    position = rng.uniform(0, 25, (points, count, 2))
    covariances = [true.smooth()(place) + true.noise_db**2 * np.eye(count) for place in position]
    rssi = np.array([rng.multivariate_normal(np.zeros(count), covariance) for covariance in covariances])
    scan = np.arange(points * count)
    found = map_process.fit_kernel(
        map_process.MapReadings(
            bssids=tuple("abcdef"),
            scan_position=position.reshape(-1, 2),
            scan_fold=scan % 5,
            scan=scan,
            access_point=np.repeat(np.arange(points), count),
            position=position.reshape(-1, 2),
            rssi_dbm=rssi.ravel(),
            place=PLACE,
            offsets_db={},
        ),
        np.arange(points),
    )
    assert found.noise_db == pytest.approx(true.noise_db, rel=0.25)
    assert found.shadowing_db == pytest.approx(true.shadowing_db, rel=0.25)
    assert found.shadowing_m == pytest.approx(true.shadowing_m, rel=0.35)
