from __future__ import annotations

import csv
import shutil
from collections.abc import Iterator
from pathlib import Path

import polars as pl
import pytest

from tests.positioning.benchmarked import benchmark_dataset, known_models
from tests.surveys import bytes_of, make_survey
from tests.undrawn import undrawn
from vislam2tag.common.errors import OutputError, SurveyError, UsageError
from vislam2tag.common.progress import silent
from vislam2tag.pipeline.paper.data import open_paper_data, paper_collection
from vislam2tag.pipeline.paper.figures import FIGURES, SCANNED, SPLIT
from vislam2tag.pipeline.paper.reproduce import (
    PAGE_FILE,
    WALKS_FILE,
    ReproducedPaper,
    paper_positioning,
    refuse_without_networks,
    reproduce,
)
from vislam2tag.pipeline.run.claims import claim
from vislam2tag.pipeline.run.output import OutputFolder
from vislam2tag.positioning.benchmark import ModelChoice
from vislam2tag.settings import Settings

__all__ = ["known_models"]
NEVER_DRAWN = {"distribution_total_station", "coverage", "figure_7"}


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("reproduced") / "out"


@pytest.fixture(scope="module")
def made(paper_copy: Path, out: Path) -> ReproducedPaper:
    with undrawn():
        return reproduce(paper_copy, out)


def test_every_table_and_figure_is_made(made: ReproducedPaper, out: Path) -> None:
    assert made.failed == []
    assert {figure.stem: figure.missing for figure in made.figures} == {figure.stem: "" for figure in FIGURES}
    assert {f"figure_{number}" for number in range(1, 10)} < {figure.stem for figure in made.figures}
    expected = {f"{figure.stem}.{kind}" for figure in made.figures for kind in ("svg", "pdf")}
    expected |= {f"table_{number}.{kind}" for number in (1, 2, 3) for kind in ("csv", "tex", "md")}
    assert {path.name for path in out.iterdir()} == expected | {PAGE_FILE, WALKS_FILE, "run.json", ".vislam2tag-files"}


def test_page_holds_all_of_it_and_asks_for_nothing(made: ReproducedPaper, out: Path) -> None:
    page = (out / PAGE_FILE).read_text()
    assert page.count("data:image/svg+xml;base64,") == len(made.figures)
    assert all(part.table.title in page for part in made.tables)
    assert "http" not in page.replace("http-equiv", "")
    assert "20.78" in page, "the paper's figures stand beside"


def test_walks_are_listed_with_their_errors(made: ReproducedPaper, out: Path) -> None:
    with (out / WALKS_FILE).open() as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == 4 * 4, "four walks with truth, four strategies"
    assert {line["truth"] for line in lines} == {"control_points", "total_station"}
    (cell,) = (c for c in made.tables[1].table.rows[0].cells if c.strategy == "local")
    own = [float(line["error_m"]) for line in lines if (line["truth"], line["strategy"]) == ("total_station", "local")]
    assert cell.here_m == pytest.approx(sum(own) / len(own), abs=1e-4)


def test_walks_that_collect_are_counted_beside_the_papers(made: ReproducedPaper, out: Path) -> None:
    with (out / "table_3.csv").open() as file:
        galaxy, total = csv.DictReader(file)
    assert (galaxy["device"], galaxy["trajectories"], galaxy["paper_trajectories"]) == ("Galaxy", "1", "24")
    assert float(galaxy["duration_min"]) == pytest.approx(80 / 60, abs=0.05)
    assert total["trajectories"] == "1", "walks over control points and before the station collect nothing"
    labelled = int(made.collection.sentence.split()[0])
    assert 10 < labelled < 40
    assert made.collection.sentence in (out / PAGE_FILE).read_text().replace("&#39;", "'")


@pytest.mark.usefixtures("undrawn_figures")
def test_what_the_data_lacks_is_said_and_the_rest_is_made(paper_copy: Path, tmp_path: Path) -> None:
    part = tmp_path / "part"
    shutil.copytree(paper_copy / "floor_1", part / "floor_1")
    shutil.copy(paper_copy / "floor_dimensions.csv", part)
    made = reproduce(part, tmp_path / "out")
    missing = {figure.stem: figure.missing for figure in made.figures if figure.missing}
    assert set(missing) == NEVER_DRAWN | {"figure_2", "figure_3", "figure_8", "figure_9"}
    assert made.collection.missing == "The data contains no walk for collecting fingerprints."
    assert not (tmp_path / "out" / "table_3.csv").exists()
    assert f"{SPLIT} does not exist in this data" in missing["figure_2"]
    assert f"{SCANNED} does not exist in this data" in missing["figure_9"]
    assert made.tables[1].missing == "The data contains no walk before a total station."
    assert not (tmp_path / "out" / "table_2.csv").exists()
    page = (tmp_path / "out" / PAGE_FILE).read_text()
    assert all(sentence in page for sentence in missing.values())


@pytest.mark.campaign
def test_a_second_run_gives_the_same_bytes(paper_copy: Path, tmp_path: Path) -> None:
    raw = bytes_of(paper_copy)
    made = reproduce(paper_copy, tmp_path / "out")
    before = bytes_of(tmp_path / "out")
    assert reproduce(paper_copy, tmp_path / "out") == made
    assert bytes_of(tmp_path / "out") == before
    assert bytes_of(paper_copy) == raw


def test_nothing_is_written_where_it_must_not_be(paper_copy: Path, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="this folder is among the survey's sessions"):
        reproduce(paper_copy, paper_copy / "floor_1" / "out")
    (tmp_path / "mine").write_text("mine")
    with pytest.raises(OutputError, match="is not empty"):
        reproduce(paper_copy, tmp_path)
    with pytest.raises(SurveyError, match="not a survey"):
        reproduce(tmp_path, tmp_path / "out")


@pytest.fixture
def quick_model(known_models: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vislam2tag.pipeline.paper.reproduce.published_choices", lambda: [ModelChoice("test-drawn")])
    monkeypatch.setattr("vislam2tag.pipeline.positioning.benchmark.benchmark_figures", lambda *_: iter(()))


@pytest.fixture
def folder(quick_model: None, tmp_path: Path) -> Iterator[OutputFolder]:
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
    assert "Use --models" in paper_positioning(folder, None, None, silent).missing
    assert "no walk for collecting fingerprints" in paper_positioning(folder, tmp_path / "none", 2, silent).missing


def test_the_walks_that_collect_become_a_data_set(folder: OutputFolder, tmp_path: Path) -> None:
    make_survey(tmp_path / "survey", devices=("LG",))
    paper_collection(open_paper_data(tmp_path / "survey"), Settings(), keep=tmp_path / "ds")
    part = paper_positioning(folder, tmp_path / "ds", 1, silent)
    assert part.table is not None
    assert [row.test for row in part.table.rows] == ["random 30 %"], "one phone cannot be held out"


def test_networks_that_cannot_run_are_told_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("vislam2tag.pipeline.paper.reproduce.published_choices", lambda: [ModelChoice("psychic")])
    refuse_without_networks(None)
    with pytest.raises(UsageError, match="psychic"):
        refuse_without_networks(1)
