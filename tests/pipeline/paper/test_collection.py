from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.surveys import make_survey
from vislam2tag.pipeline.paper.collection import Collection, paper_collection
from vislam2tag.pipeline.paper.data import open_paper_data
from vislam2tag.settings import Settings


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two surveys: one phone that collects and one that evaluates; the second holds the collecting walk once more."""
    root = tmp_path_factory.mktemp("data")
    make_survey(root / "one", devices=("LG", "LG_ref"))
    shutil.copytree(root / "one", root / "two", ignore=shutil.ignore_patterns("LG_ref"))
    return root


@pytest.fixture(scope="module")
def collection(data: Path) -> Collection:
    return paper_collection(open_paper_data(data), Settings())


def test_walks_that_collect_count_once_and_those_that_evaluate_not_at_all(collection: Collection) -> None:
    assert collection.failed == ()
    assert collection.statistics is not None
    assert list(collection.statistics.by_device) == ["LG"]
    assert collection.statistics.walks.trajectories == 1
    assert collection.statistics.walks.duration_s == pytest.approx(40, abs=1)
    wifi = collection.statistics.technologies["wifi"]
    assert 0 < wifi.labels.labelled <= wifi.labels.fingerprints


def test_every_walk_is_told_as_progress(data: Path, tmp_path: Path) -> None:
    shutil.copytree(data / "two", tmp_path / "survey")
    told: list[tuple[int, int]] = []
    paper_collection(open_paper_data(tmp_path), Settings(), lambda done, total: told.append((done, total)))
    assert told == [(1, 1)]


def test_a_walk_that_cannot_be_labelled_is_told(data: Path, tmp_path: Path) -> None:
    shutil.copytree(data / "two", tmp_path / "survey")
    (poses,) = tmp_path.glob("survey/floor_0/LG/*/poses.csv")
    poses.write_text("nothing\n")
    found = paper_collection(open_paper_data(tmp_path), Settings())
    assert len(found.failed) == 1
    assert "floor 0 / LG" in found.failed[0]


def test_evaluation_alone_collects_nothing(data: Path, tmp_path: Path) -> None:
    shutil.copytree(data / "one", tmp_path / "survey", ignore=shutil.ignore_patterns("LG"))
    assert paper_collection(open_paper_data(tmp_path), Settings()) == Collection(None, ())
