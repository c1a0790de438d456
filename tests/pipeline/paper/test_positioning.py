"""The paper's Table IV from walks that collect, with models that train in no time in the networks' place."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import polars as pl
import pytest

from tests.positioning.benchmarked import benchmark_dataset, known_models
from tests.surveys import make_survey
from vislam2tag.common.errors import UsageError
from vislam2tag.common.progress import silent
from vislam2tag.pipeline.paper.collection import paper_collection
from vislam2tag.pipeline.paper.data import open_paper_data
from vislam2tag.pipeline.paper.positioning import paper_positioning, refuse_without_networks
from vislam2tag.pipeline.run.store import OutputFolder, claim
from vislam2tag.positioning.benchmark.protocol import ModelChoice
from vislam2tag.settings import Settings

__all__ = ["known_models"]
pytestmark = pytest.mark.usefixtures("known_models")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vislam2tag.pipeline.paper.positioning.published_choices", lambda: [ModelChoice("test-drawn")])
    monkeypatch.setattr("vislam2tag.pipeline.positioning.benchmark.benchmark_figures", lambda *_: iter(()))


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[OutputFolder]:
    with claim(tmp_path / "out", {}, "test") as opened:
        yield opened


def test_table_4_is_made_of_the_paper_splits(folder: OutputFolder, tmp_path: Path) -> None:
    benchmark_dataset(tmp_path / "ds")
    part = paper_positioning(folder, tmp_path / "ds", 2, silent)
    assert part.table is not None
    assert [row.test for row in part.table.rows] == ["random 30 %", "Galaxy", "Pixel"]
    table = pl.read_csv(folder.root / "table_4.csv")
    assert table["model"].unique().to_list() == ["test-drawn"]
    assert (folder.root / "positioning" / "benchmark.json").is_file()


def test_without_being_asked_it_trains_nothing(folder: OutputFolder, tmp_path: Path) -> None:
    assert "Made with --models" in paper_positioning(folder, None, None, silent).missing
    assert "No walk that collects" in paper_positioning(folder, tmp_path / "none", 2, silent).missing


def test_the_walks_that_collect_become_a_data_set(folder: OutputFolder, tmp_path: Path) -> None:
    make_survey(tmp_path / "survey", devices=("LG",))
    paper_collection(open_paper_data(tmp_path / "survey"), Settings(), keep=tmp_path / "ds")
    part = paper_positioning(folder, tmp_path / "ds", 1, silent)
    assert part.table is not None
    assert [row.test for row in part.table.rows] == ["random 30 %"], "one phone cannot be held out"


def test_networks_that_cannot_run_are_told_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vislam2tag.pipeline.paper.positioning.published_choices", lambda: [ModelChoice("psychic")])
    refuse_without_networks(None)
    with pytest.raises(UsageError, match="psychic"):
        refuse_without_networks(1)
