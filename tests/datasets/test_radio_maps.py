"""The share of scans that hear an access point.

Radio maps agree with the simulator's true field, say how sure they are, and leave out what nobody measured.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import polars as pl
import pytest

from tests.datasets.factory import bssid, small_dataset
from tests.datasets.surveyed import FADING_DB, OFFSETS_DB, Surveyed, surveyed
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.datasets import radio_maps as mapping
from vislam2tag.datasets.model import Dataset
from vislam2tag.datasets.schema import ACCESS_POINTS, FINGERPRINTS
from vislam2tag.datasets.settings import RadioMapSettings


def test_a_reading_given_twice_is_heard_once() -> None:
    matrix = mapping.heard_matrix(np.array([0, 0, 2]), np.array([1, 1, 0]), 3, 2)
    assert matrix.toarray().tolist() == [[0, 1], [0, 0], [1, 0]]


def test_near_many_scans_the_share_is_theirs_and_far_away_the_floors() -> None:
    scans = np.zeros((400, 2))
    heard = mapping.heard_matrix(np.arange(100), np.zeros(100, dtype=np.int64), 400, 1)
    share = mapping.heard_share(np.array([[0.0, 0.0], [500.0, 0.0]]), scans, heard, np.array([0.9]), 1.0)
    assert share[0, 0] == pytest.approx(0.25, abs=0.01)
    assert share[1, 0] == pytest.approx(0.9)


def test_it_changes_from_place_to_place() -> None:
    scans = np.column_stack((np.repeat([0.0, 30.0], 50), np.zeros(100)))
    heard = mapping.heard_matrix(np.arange(50), np.zeros(50, dtype=np.int64), 100, 1)
    share = mapping.heard_share(np.array([[0.0, 1.0], [30.0, 1.0]]), scans, heard, np.array([0.5]), 2.0)
    assert share[:, 0] == pytest.approx([1, 0], abs=0.02)
    assert ((share >= 0) & (share <= 1)).all()


@pytest.mark.parametrize(("period_m", "expected"), [(4.0, mapping.WIDTHS_M[0]), (1e6, mapping.WIDTHS_M[-1])])
def test_the_width_follows_how_quickly_the_share_changes(period_m: float, expected: float) -> None:
    rng = np.random.default_rng(1)
    scans = np.column_stack((rng.uniform(0, 60, 1500), np.zeros(1500)))
    probability = 0.5 + 0.5 * np.sign(np.sin(2 * np.pi * scans[:, 0] / period_m + 1)) * (period_m < 1e5)
    scan = np.flatnonzero(rng.random(1500) < probability)
    heard = mapping.heard_matrix(scan, np.zeros(len(scan), dtype=np.int64), 1500, 1)
    assert mapping.best_width(scans, np.arange(1500) % 5, heard) == expected


def test_a_scan_does_not_predict_its_own_fold() -> None:
    scans = np.zeros((10, 2))
    heard = mapping.heard_matrix(np.arange(5), np.zeros(5, dtype=np.int64), 10, 1)
    fold = np.repeat([0, 1], 5)
    assert mapping.heard_error(scans, fold, heard, 1.0)[0] > 0.5


SETTINGS = RadioMapSettings()
Errors = tuple[FloatArray, FloatArray, FloatArray]
HEARD_OFTEN = 0.05
"""Where fewer scans hear an access point its mean is that of rare accidents."""


def changed(dataset: Dataset, table: str, change: Callable[[pl.LazyFrame], pl.LazyFrame]) -> Dataset:
    return Dataset(dataset.info, {**dataset.tables, table: change(dataset.tables[table])})


@pytest.fixture(scope="module")
def survey() -> Surveyed:
    return surveyed(walks=8, scans=60, access_points=8)


@pytest.fixture(scope="module")
def maps(survey: Surveyed) -> mapping.FloorMaps:
    (only,) = mapping.radio_maps(survey.dataset, SETTINGS)
    return only


@pytest.fixture(scope="module")
def cells(survey: Surveyed, maps: mapping.FloorMaps) -> IntArray:
    """Cells (n, 2) of random points of the ways, where few fingerprints lie."""
    cells: IntArray = maps.grid.cells_of(survey.points(300, seed=9))
    return cells[((cells >= 0) & (cells < maps.grid.shape)).all(axis=1)]


@pytest.fixture(scope="module")
def errors(survey: Surveyed, maps: mapping.FloorMaps, cells: IntArray) -> list[Errors]:
    """Of each map: error of the mean, the sigma stated of it, error of the share heard."""
    found = []
    for number, one in enumerate(maps.maps):
        mean, heard = survey.truth(one.bssid, maps.grid.centres_m(cells))
        at = (number, *cells.T)
        off = maps.mean_dbm[at] - mean
        known = np.isfinite(off) & (heard > HEARD_OFTEN)
        share = maps.heard[at] - heard
        found.append((off[known], maps.sigma_db[at][known], share[np.isfinite(share)]))
    return found


def test_the_mean_is_nearer_to_the_truth_than_a_fingerprint(errors: list[Errors]) -> None:
    each = [float(np.sqrt((error**2).mean())) for error, _, _ in errors]
    assert np.sqrt(np.mean(np.square(each))) < FADING_DB
    assert max(each) < 2 * FADING_DB
    assert abs(np.mean([error.mean() for error, _, _ in errors])) < 0.5


def test_the_sigma_of_the_mean_is_true(errors: list[Errors]) -> None:
    ratio = np.concatenate([error / sigma for error, sigma, _ in errors])
    assert 0.60 < (np.abs(ratio) < 1).mean() < 0.76


def test_the_share_heard_is_near_the_truth(errors: list[Errors]) -> None:
    share = np.concatenate([share for _, _, share in errors])
    assert np.sqrt((share**2).mean()) < 0.15
    assert abs(share.mean()) < 0.02


def test_deviations_are_those_of_new_readings(survey: Surveyed, maps: mapping.FloorMaps, cells: IntArray) -> None:
    rng = np.random.default_rng(3)
    within = []
    for number, one in enumerate(maps.maps):
        mean, heard = survey.truth(one.bssid, maps.grid.centres_m(cells))
        at = (number, *cells.T)
        error = mean + rng.normal(0, FADING_DB, len(mean)) - maps.mean_dbm[at]
        known = np.isfinite(error) & (heard > 0.5)
        within.append(np.abs(error[known]) < maps.deviation_db[at][known])
    assert 0.60 < np.concatenate(within).mean() < 0.76


def test_cross_validation_says_so_too(maps: mapping.FloorMaps) -> None:
    shares = [one.errors.within_one_deviation for one in maps.maps]
    assert 0.60 < np.mean([share for share in shares if share is not None]) < 0.76
    for one in maps.maps:
        assert one.errors.rms_db is not None
        assert FADING_DB < one.errors.rms_db < 2 * FADING_DB
        assert 0 < one.errors.readings <= one.readings
        assert 0 <= one.heard_error < 0.25


def test_the_phones_offsets_are_found(maps: mapping.FloorMaps) -> None:
    assert maps.offsets_db == pytest.approx(OFFSETS_DB, abs=0.5)


def test_the_floors_own_noise_is_found(maps: mapping.FloorMaps) -> None:
    assert maps.kernel.noise_db == pytest.approx(np.hypot(FADING_DB, 12**-0.5), abs=0.4)


def test_nothing_is_said_far_from_fingerprints(survey: Surveyed, maps: mapping.FloorMaps) -> None:
    scans = survey.dataset.fingerprints.select("x", "y").collect().to_numpy()
    cells = np.argwhere(np.ones(maps.grid.shape))
    distance = np.linalg.norm(maps.grid.centres_m(cells)[:, None] - scans, axis=2).min(axis=1)
    near = (distance <= SETTINGS.reach_m).reshape(maps.grid.shape)
    assert (np.isfinite(maps.heard) == near).all()
    assert not np.isfinite(maps.mean_dbm[:, ~near]).any()
    assert (np.isfinite(maps.mean_dbm) == np.isfinite(maps.deviation_db)).all()
    assert (~near).any()


def test_most_heard_come_first_and_only_so_many(survey: Surveyed) -> None:
    (few,) = mapping.radio_maps(survey.dataset, RadioMapSettings(most=3))
    counts = [one.readings for one in few.maps]
    assert len(counts) == 3
    assert counts == sorted(counts, reverse=True)


def test_a_named_access_point_gets_the_same_map(survey: Surveyed, maps: mapping.FloorMaps) -> None:
    name = maps.maps[1].bssid
    steps: list[tuple[int, int]] = []
    (one,) = mapping.radio_maps(survey.dataset, SETTINGS, (name,), lambda *told: steps.append(told))
    assert [found.bssid for found in one.maps] == [name]
    assert steps == [(1, 1)]
    assert one.maps == maps.maps[1:2]
    np.testing.assert_array_equal(one.mean_dbm[0], maps.mean_dbm[1])
    np.testing.assert_array_equal(one.heard[0], maps.heard[1])


def test_floors_are_mapped_apart_and_in_order() -> None:
    found = list(mapping.radio_maps(small_dataset(), SETTINGS))
    assert [floor.place for floor in found] == [("", 0, "wifi"), ("", 1, "wifi")]
    for floor in found:
        number = [one.bssid for one in floor.maps].index(bssid(floor.place.floor, 1))
        middle = floor.grid.cells_of(np.array([[20.0, 10.0]]))[0]
        assert floor.mean_dbm[number, *middle] == pytest.approx(-42, abs=2)


def test_networks_that_opted_out_are_mapped_only_by_name() -> None:
    name = bssid(0, 0)
    dataset = changed(small_dataset(), ACCESS_POINTS, lambda table: table.with_columns(nomap=pl.col("bssid") == name))
    assert all(one.bssid != name for floor in mapping.radio_maps(dataset, SETTINGS) for one in floor.maps)
    assert [one.bssid for floor in mapping.radio_maps(dataset, SETTINGS, (name,)) for one in floor.maps] == [name] * 2


def test_an_unknown_access_point_is_told() -> None:
    with pytest.raises(UsageError, match="--ap 00:00: no such access point in this data set"):
        list(mapping.radio_maps(small_dataset(), SETTINGS, ("00:00",)))


def test_without_a_label_there_is_nothing_to_map() -> None:
    with pytest.raises(DatasetError, match=r"small: no access point has 10 readings .* \(at most 0\)"):
        list(mapping.radio_maps(small_dataset(unlabelled=12), SETTINGS))


def test_all_scans_at_one_point_give_a_map_of_that_point() -> None:
    there = pl.when(pl.col("x").is_not_null()).then(7.5)
    dataset = small_dataset()
    for table in dataset.tables:
        if "x" in dataset.tables[table].collect_schema():
            dataset = changed(dataset, table, lambda one: one.with_columns(x=there, y=there))
    for floor in mapping.radio_maps(dataset, SETTINGS):
        assert floor.grid.shape == (7, 7)
        assert np.isfinite(floor.mean_dbm[:, 3, 3]).all()


def test_a_label_far_off_is_told() -> None:
    far = pl.when(pl.col("scan_id").str.ends_with("000000")).then(1e6).otherwise(pl.col("x"))
    dataset = changed(small_dataset(), FINGERPRINTS, lambda table: table.with_columns(x=far))
    with pytest.raises(DatasetError, match="correct the labels or choose a larger --cell"):
        list(mapping.radio_maps(dataset, SETTINGS))


def test_grids_of_different_points_fit_together() -> None:
    first = mapping.grid_of(np.array([[0.3, 0.2], [9.9, 5.0]]), SETTINGS)
    second = mapping.grid_of(np.array([[4.6, -7.7]]), SETTINGS)
    for one in (first, second):
        np.testing.assert_allclose(np.mod(one.origin_m, SETTINGS.cell_m), 0)
    assert first.origin_m == (-3.0, -3.0)
    assert first.shape == (11, 16)
