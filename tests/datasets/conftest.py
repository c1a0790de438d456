"""Labels of a small simulated survey, and of the survey that the published program's output is known for.

A described data set in a folder, with its card.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.datasets.described import FULL
from tests.datasets.factory import small_dataset
from tests.surveys import make_survey
from vislam2tag.common.findings import Finding
from vislam2tag.datasets.card import write_card
from vislam2tag.datasets.description import read_description, with_description
from vislam2tag.datasets.folder import dataset_folder
from vislam2tag.datasets.model import Dataset, DatasetSource, Fold, Split, SplitInfo
from vislam2tag.datasets.statistics import dataset_statistics
from vislam2tag.labeling.settings import LabelRule, LabelSettings
from vislam2tag.pipeline.labels.process import process
from vislam2tag.settings import Settings


@pytest.fixture(scope="session")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two floors, a walk each, a scan that repeats readings."""
    folder = tmp_path_factory.mktemp("formats") / "survey"
    return make_survey(folder, floors=2, devices=("LG",), seconds=120.0, traps=("stale_wifi", "odd_ssids"))


@pytest.fixture(scope="session")
def labels(survey: Path) -> Path:
    """By the paper's strategy, which states no sigma: the labelled layout loses none."""
    out = survey.parent / "labels"
    process(survey, out, Settings(strategy="local"))
    return out


@pytest.fixture(scope="session")
def labels_as_published(agreement: Path) -> Path:
    """Labels by the published program's own rules."""
    out = agreement / "labels"
    rule = LabelSettings(rule=LabelRule.NEXT_FRAME)
    process(agreement / "raw", out, Settings(strategy="local-corrected", labels=rule))
    return out


FINDING = Finding(kind="cached_readings", file="a.csv", count=3, message="Given again by the scan after, left out.")


def _written(target: Path, dataset: Dataset) -> Path:
    """Written as commands do: all files are there before the folder's record names them."""
    with dataset_folder(target) as folder:
        folder.add_tables(dataset.tables)
        folder.add_splits(dataset.splits)
        opened = folder.opened(dataset.info)
        write_card(opened, dataset_statistics(opened), folder.out)
    return target


@pytest.fixture(scope="session")
def described_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Everything stated, one split, one finding."""
    folder = tmp_path_factory.mktemp("card")
    (folder / "dataset.toml").write_text(FULL, encoding="utf-8")
    dataset = small_dataset()
    info = with_description(dataset.info, read_description(folder / "dataset.toml")).model_copy(
        update={"findings": (FINDING,), "sources": (DatasetSource(kind="process", name="survey", version="0.1.0"),)}
    )
    groups = dataset.fingerprints.select(id="scan_id", group="device").collect()
    folds = tuple(Fold(name=name, test=(name,)) for name in ("Galaxy", "Pixel"))
    split = Split(SplitInfo(name="device", kind="device", folds=folds), groups)
    again = replace(split, info=split.info.model_copy(update={"name": "again", "folds": folds[:1]}))
    return _written(folder / "set", Dataset(info, dataset.tables, {"device": split, "again": again}))


@pytest.fixture(scope="session")
def bare_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Nothing stated."""
    return _written(tmp_path_factory.mktemp("bare") / "set", small_dataset())
