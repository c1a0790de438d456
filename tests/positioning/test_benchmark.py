"""Which runs there are, that they see nothing of the test part, and that their keys tell them apart.

Predictions as a table, and the errors in it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.positioning.benchmarked import benchmark_dataset, known_models
from vislam2tag.common.errors import DatasetError, UsageError
from vislam2tag.datasets.model import Dataset, Storey
from vislam2tag.positioning.benchmark import (
    PREDICTIONS,
    BenchmarkRun,
    ModelChoice,
    execute,
    planned,
    predictions_table,
    with_errors,
)
from vislam2tag.positioning.learning_data import LearningData, learning_data
from vislam2tag.positioning.places import Positions, ScanPlaces

__all__ = ["known_models"]
pytestmark = pytest.mark.usefixtures("known_models")


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return benchmark_dataset(tmp_path_factory.mktemp("benchmark") / "ds")


@pytest.fixture(scope="module")
def data(dataset: Dataset) -> LearningData:
    return learning_data(dataset)


def run_of(
    dataset: Dataset, model: str = "test-loudest", seed: int | None = None, **parameters: object
) -> BenchmarkRun:
    return BenchmarkRun(ModelChoice(model, parameters), dataset.splits["device"], "Galaxy", seed)


def test_models_that_draw_nothing_run_once(dataset: Dataset) -> None:
    models = [ModelChoice("test-loudest"), ModelChoice("test-drawn"), ModelChoice("test-drawn", {"seed": 7})]
    runs = list(planned(models, [dataset.splits["device"]], 3))
    assert [(run.fold, run.model.name, run.seed) for run in runs[:5]] == [
        ("Galaxy", "test-loudest", None),
        ("Galaxy", "test-drawn", 0),
        ("Galaxy", "test-drawn", 1),
        ("Galaxy", "test-drawn", 2),
        ("Galaxy", "test-drawn", None),
    ]
    assert {run.fold for run in runs[5:]} == {"Pixel"}
    assert runs[4].parameters["seed"] == 7


def test_a_run_is_scored_on_what_tests(dataset: Dataset, data: LearningData) -> None:
    record, _, table = execute(run_of(dataset), data, "key")
    assert set(data[np.isin(data.ids, table["scan_id"])].scans.device) == {"Galaxy"}
    assert record.train_scans + record.score.scans == len(data)
    assert record.score.plane.median_m is not None
    assert record.score.plane.median_m >= 5.0, "the phones walked in lanes 5 m apart"
    assert record.parameters == {"radius_m": 10.0}


@pytest.mark.parametrize("model", ["test-loudest", "weighted-knn"])
def test_labels_of_the_test_part_teach_nothing(model: str, dataset: Dataset, data: LearningData) -> None:
    run = run_of(dataset, model)
    record, _, first = execute(run, data, "key")
    tests = np.flatnonzero(np.isin(data.ids, first["scan_id"]))
    order = np.arange(len(data))
    order[tests] = np.random.default_rng(1).permutation(tests)
    permuted_record, _, permuted = execute(run, replace(data, places=data.places[order]), "key")
    assert not permuted.select("x", "y").equals(first.select("x", "y"))
    same = ("scan_id", "found_x", "found_y", "radius_95_m")
    assert permuted.select(same).equals(first.select(same))
    assert permuted_record.score != record.score


def test_readings_of_the_test_part_are_no_vocabulary(dataset: Dataset, data: LearningData) -> None:
    record, _, first = execute(run_of(dataset), data, "key")
    tests = np.isin(data.ids, first["scan_id"])
    louder = np.where(tests[data.scans.row], data.scans.rssi_dbm - 3.0, data.scans.rssi_dbm)
    heard = np.unique(data.scans[~tests].column)
    assert record.access_points == len(heard)
    _, _, again = execute(run_of(dataset), replace(data, scans=replace(data.scans, rssi_dbm=louder)), "key")
    assert again.select("found_x", "found_y").equals(first.select("found_x", "found_y"))


def test_a_seed_repeats_a_run(dataset: Dataset, data: LearningData) -> None:
    (first, _, places), (same, _, again), (other, _, _) = (
        execute(run_of(dataset, "test-drawn", seed), data, "key") for seed in (1, 1, 2)
    )
    assert places.equals(again)
    assert first.score == same.score != other.score


def test_keys_follow_from_everything(dataset: Dataset) -> None:
    table = dataset.info.tables["readings"].model_copy(update={"sha256": "0"})
    changed = replace(
        dataset, info=dataset.info.model_copy(update={"tables": {**dataset.info.tables, "readings": table}})
    )
    keys = [
        run_of(dataset).key(dataset, "source"),
        run_of(dataset).key(changed, "source"),
        run_of(dataset, radius_m=2.0).key(dataset, "source"),
        run_of(dataset, "test-drawn", 0).key(dataset, "source"),
        run_of(dataset, "test-drawn", 1).key(dataset, "source"),
        run_of(dataset).key(dataset, "changed source"),
        replace(run_of(dataset), fold="Pixel").key(dataset, "source"),
        replace(run_of(dataset), split=dataset.splits["random"], fold="test").key(dataset, "source"),
    ]
    assert len(set(keys)) == len(keys)
    assert run_of(dataset).key(dataset, "source") == run_of(dataset, radius_m=10.0).key(dataset, "source") == keys[0]


def test_an_empty_part_is_told(dataset: Dataset, data: LearningData) -> None:
    pixel = data[data.scans.device == "Pixel"]
    with pytest.raises(DatasetError, match="split device, fold Galaxy: the test set contains no labelled fingerprint"):
        execute(run_of(dataset), pixel, "key")


def test_unknown_parameters_are_told_before_any_run(dataset: Dataset) -> None:
    with pytest.raises(UsageError, match="test-loudest has no parameter 'k'"):
        list(planned([ModelChoice("test-loudest", {"k": 3})], [dataset.splits["device"]], 1))


def test_progress_reaches_the_model(dataset: Dataset, data: LearningData) -> None:
    steps: list[tuple[float, int]] = []
    execute(run_of(dataset, "test-telling", 0), data, "key", lambda done, total: steps.append((done, total)))
    assert steps == [(0.5, 1)]


STOREYS = (Storey("a", 0), Storey("a", 1))


def test_truth_and_answers_stand_side_by_side() -> None:
    nan = np.nan
    truth = ScanPlaces(STOREYS, np.array([0, 1, 1]), np.array([[0.0, 0], [3, 4], [1, 1]]), np.zeros(3), np.zeros(3))
    found = Positions(
        storeys=STOREYS,
        storey=np.array([0, 0, -1]),
        xy=np.array([[3.0, 4], [3, 4], [nan, nan]]),
        z=np.array([0.0, nan, nan]),
        storey_probability=np.zeros((3, 2)),
        radius_68_m=np.array([1.0, 2, nan]),
        radius_95_m=np.array([2.0, 4, nan]),
    )
    table = predictions_table(np.array(["s1", "s2", "s3"]), truth, found)
    assert dict(table.schema) == PREDICTIONS
    assert table["floor"].to_list() == [0, 1, 1]
    assert table["found_floor"].to_list() == [0, 0, None]
    assert table["found_z"].to_list() == [0.0, None, None]
    errors = with_errors(table)
    assert errors["error_m"].to_list() == [pytest.approx(5.0), pytest.approx(0.0), None]
    assert errors["on_floor"].to_list() == [True, False, False]
