"""Training from a data set's folder: which part is learned, what is saved, what is told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.datasets.factory import small_dataset
from vislam2tag.common.errors import DatasetError, OutputError, UsageError
from vislam2tag.datasets.folder import write_dataset
from vislam2tag.datasets.splits import standard_splits
from vislam2tag.pipeline.positioning.train import TrainedModel, TrainPlan, train
from vislam2tag.positioning import model_scores
from vislam2tag.positioning.model_files import load_model


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    small = small_dataset()
    path = tmp_path_factory.mktemp("data") / "set"
    write_dataset(replace(small, splits=standard_splits(small)), path)
    return path


def trained(folder: Path, out: Path, **plan: object) -> TrainedModel:
    return train(folder, TrainPlan(**{"model": "weighted-knn", "parameters": {"k": 1}} | plan), out)  # type: ignore[arg-type]


def test_all_labelled_fingerprints_are_learned(folder: Path, tmp_path: Path) -> None:
    steps: list[tuple[float, int]] = []
    plan = TrainPlan("local-kriging", {"k": 3}, seed=2)
    made = train(folder, plan, tmp_path / "model.v2t", lambda done, total: steps.append((done, total)))
    saved = load_model(tmp_path / "model.v2t")
    assert saved.model.get_params()["seed"] == 2
    assert (saved.origin.dataset, saved.origin.part, saved.origin.scans) == ("small", "all", 44)
    assert len(saved.model.access_points_) == 10
    assert made.tested is None
    assert steps[-1] == (1, 1)


def test_without_a_model_the_best_is_found_and_trained(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(model_scores, "CANDIDATES", ("weighted-knn", "local-kriging"))
    made = train(folder, TrainPlan(None, {}), tmp_path / "model.v2t")
    assert made.trial is not None
    assert load_model(tmp_path / "model.v2t").name == made.trial.chosen.name == made.saved.name
    with pytest.raises(UsageError, match="choose one with --model"):
        train(folder, TrainPlan(None, {"k": 1}), tmp_path / "other.v2t")


def test_a_fold_trains_and_tests(folder: Path, tmp_path: Path) -> None:
    made = trained(folder, tmp_path / "model.v2t", split="device", fold="Pixel")
    assert made.saved.origin.part == "split device, fold Pixel"
    assert made.saved.origin.scans == 22
    assert made.tested is not None
    assert made.tested.score.scans == 22
    assert made.tested.score.plane.mean_m == pytest.approx(5.0, abs=0.5)
    assert 0 < made.tested.radius_68_m <= made.tested.radius_95_m
    only = trained(folder, tmp_path / "again.v2t", split="random")
    assert only.saved.origin.scans == 32


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        ({"model": "psychic"}, "there is no positioning model 'psychic'"),
        ({"model": "knn"}, "^the model knn was removed; use weighted-knn$"),
        ({"parameters": {"neighbours": 3}}, "has no parameter 'neighbours'"),
        ({"seed": 1}, "--seed: weighted-knn does not use random numbers"),
        ({"fold": "Pixel"}, "--fold Pixel: a fold needs a split"),
        ({"split": "moon"}, "--split moon: the data set has no such split; available: block, day, device"),
        ({"split": "device"}, "--fold: choose one of split device: Galaxy, Pixel"),
        ({"split": "device", "fold": "Nokia"}, "--fold Nokia: choose one of split device"),
    ],
)
def test_wrong_wishes_are_told(folder: Path, tmp_path: Path, plan: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        trained(folder, tmp_path / "model.v2t", **plan)
    assert not list(tmp_path.iterdir())


def test_a_network_is_also_written_as_onnx(folder: Path, tmp_path: Path) -> None:
    onnx = pytest.importorskip("onnx")
    pytest.importorskip("torch")
    small = {"epochs": 1, "backbone": (4,), "heads": (4,), "device": "cpu"}
    trained(folder, tmp_path / "model.v2t", model="multi-cel", parameters=small, onnx=tmp_path / "model.onnx")
    entries = {entry.key: entry.value for entry in onnx.load(tmp_path / "model.onnx").metadata_props}
    assert entries["model"] == "multi-cel"
    assert '"dataset":"small"' in entries["origin"]
    assert load_model(tmp_path / "model.v2t").name == "multi-cel"
    with pytest.raises(UsageError, match="only networks and cell-density can"):
        trained(folder, tmp_path / "neighbours.v2t", onnx=tmp_path / "neighbours.onnx")
    with pytest.raises(UsageError, match="this is also the file of --out"):
        trained(folder, tmp_path / "neighbours.v2t", onnx=tmp_path / "neighbours.v2t")


def test_a_model_is_updated_by_a_later_survey(folder: Path, tmp_path: Path) -> None:
    before, after = tmp_path / "before.v2t", tmp_path / "after.v2t"
    trained(folder, before, split="device", fold="Pixel")
    plan = TrainPlan(None, {}, update=before)
    made = train(folder, plan, after)
    assert made.update is not None
    assert (made.update.added, made.saved.origin.scans) == (22, 44)
    assert made.saved.origin.part == "split device, fold Pixel; updated by 22 of small (all)"
    saved = load_model(after)
    assert (saved.name, saved.model.get_params()["k"]) == ("weighted-knn", 1)
    with pytest.raises(DatasetError, match="nothing to update"):
        train(folder, replace(plan, update=after), after)
    with pytest.raises(UsageError, match="--update keeps the model's kind"):
        train(folder, replace(plan, model="weighted-knn"), after)
    trained(folder, before, model="cell-density", parameters={"copies": 0})
    with pytest.raises(UsageError, match="cell-density does not keep its fingerprints; join the data sets"):
        train(folder, plan, after)


def test_other_faults_are_told(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        trained(folder, tmp_path / "absent" / "model.v2t")
    with pytest.raises(DatasetError, match="no labelled fingerprint of technology ble"):
        trained(folder, tmp_path / "model.v2t", technology="ble")
    with pytest.raises(DatasetError, match="not a data set"):
        trained(tmp_path, tmp_path / "model.v2t")
