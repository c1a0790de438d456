"""The benchmark as a whole: what it writes, that it can be stopped and continued, that it repeats itself."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from tests.datasets.formats.test_fingerprint_tables import quartet_in
from tests.positioning.benchmarked import MODELS, benchmark_dataset, known_models
from tests.surveys import bytes_of
from vislam2tag.common.errors import DatasetError, OutputError, UsageError
from vislam2tag.common.progress import Stage
from vislam2tag.datasets.model import Dataset
from vislam2tag.pipeline.positioning.benchmark import BenchmarkPlan, benchmark, benchmark_figures, public_dataset
from vislam2tag.positioning.benchmark import Benchmark, ModelChoice
from vislam2tag.positioning.registry import MODELS as REGISTRY

__all__ = ["known_models"]
pytestmark = pytest.mark.usefixtures("known_models")


@pytest.fixture(autouse=True)
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw only where a test is about figures: they take long."""
    monkeypatch.setattr("vislam2tag.pipeline.positioning.benchmark.benchmark_figures", lambda *_: iter(()))


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return benchmark_dataset(tmp_path_factory.mktemp("benchmark") / "ds")


def plan_of(*models: str, splits: Sequence[str] = ("random", "device"), seeds: int = 2, **more: Any) -> BenchmarkPlan:
    return BenchmarkPlan([ModelChoice(name) for name in models], splits, seeds, **more)


def untimed(out: Path) -> dict[str, str]:
    """Digests of all files that hold no time."""
    return {name: digest for name, digest in bytes_of(out).items() if not name.startswith("times")}


@pytest.fixture(scope="module")
def whole(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Benchmark]:
    out = tmp_path_factory.mktemp("whole") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(REGISTRY, "_items", dict(MODELS))
        patch.setattr("vislam2tag.pipeline.positioning.benchmark.benchmark_figures", lambda *_: iter(()))
        found = benchmark(dataset, out, plan_of("test-loudest", "test-drawn", beside_paper=True))
    return out, found


def test_every_run_is_kept_and_summed_up(whole: tuple[Path, Benchmark]) -> None:
    out, found = whole
    assert [(run.model, run.split, run.fold, run.seed) for run in found.runs] == [
        (model, split, fold, seed)
        for split, fold in (("random", "test"), ("device", "Galaxy"), ("device", "Pixel"))
        for model, seed in (("test-loudest", None), ("test-drawn", 0), ("test-drawn", 1))
    ]
    assert Benchmark.model_validate_json((out / "benchmark.json").read_bytes()) == found
    assert len(list((out / "runs").glob("*.json"))) == len(list((out / "runs").glob("*.parquet"))) == 9
    assert pl.read_csv(out / "scores.csv").height == len(found.rows) == 2 * 4
    table = pl.read_csv(out / "table_4.csv")
    assert table["test"].to_list() == ["random 30 %"] * 2 + ["Galaxy"] * 2 + ["Pixel"] * 2
    assert table["paper_mean_m"].null_count() == 6, "models of ours are not in the paper"


def test_predictions_are_kept_with_the_true_places(dataset: Dataset, whole: tuple[Path, Benchmark]) -> None:
    out, found = whole
    (path,) = (out / "runs").glob("test-loudest.device.Galaxy.once.*.parquet")
    table = pl.read_parquet(path)
    true = dataset.fingerprints.filter(pl.col("scan_id").is_in(table["scan_id"].implode())).collect()
    joined = table.join(true, on="scan_id", suffix="_true")
    assert joined.height == table.height == 22
    assert (joined["x"] == joined["x_true"]).all()
    error = ((pl.col("x") - pl.col("found_x")) ** 2 + (pl.col("y") - pl.col("found_y")) ** 2).sqrt().mean()
    (run,) = (run for run in found.runs if run.key[:12] == path.stem.split(".")[-1])
    assert table.select(error).item() == pytest.approx(run.score.plane.mean_m)


def test_page_and_figures_hold_all_of_it_and_ask_for_nothing(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("vislam2tag.pipeline.positioning.benchmark.benchmark_figures", benchmark_figures)
    benchmark(dataset, tmp_path / "out", plan_of("test-loudest", "test-drawn", beside_paper=True, splits=["device"]))
    page = (tmp_path / "out" / "report.html").read_text()
    figures = {path.stem for path in (tmp_path / "out" / "figures").glob("*.svg")}
    assert figures == {f"{what}.device" for what in ("errors", "calibration", "floors")} | {
        f"map.device.{model}" for model in ("test-loudest", "test-drawn")
    }
    assert page.count("data:image/svg+xml;base64,") == len(figures)
    assert "http" not in page.replace("http-equiv", "")
    assert "Table IV" in page
    assert "mean of folds" in page


def test_the_same_again_makes_no_run_twice(
    dataset: Dataset, whole: tuple[Path, Benchmark], monkeypatch: pytest.MonkeyPatch
) -> None:
    out, found = whole
    monkeypatch.setattr(
        "vislam2tag.pipeline.positioning.benchmark.execute", lambda *_: pytest.fail("a run was repeated")
    )
    before = bytes_of(out)
    assert benchmark(dataset, out, plan_of("test-loudest", "test-drawn", beside_paper=True)) == found
    assert bytes_of(out) == before


def test_a_changed_source_makes_all_runs_again(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plan = plan_of("test-loudest", splits=["random"])
    benchmark(dataset, tmp_path / "out", plan)
    monkeypatch.setattr("vislam2tag.pipeline.positioning.benchmark.code_key", lambda *modules: "+".join(modules))
    benchmark(dataset, tmp_path / "out", plan)
    assert len(list((tmp_path / "out" / "runs").glob("*.json"))) == 2


def test_a_damaged_record_is_made_again(dataset: Dataset, tmp_path: Path) -> None:
    benchmark(dataset, tmp_path / "out", plan_of("test-loudest", splits=["random"]))
    before = untimed(tmp_path / "out")
    (table,) = (tmp_path / "out" / "runs").glob("*.parquet")
    table.write_bytes(b"half")
    benchmark(dataset, tmp_path / "out", plan_of("test-loudest", splits=["random"]))
    assert untimed(tmp_path / "out") == before


def test_what_was_stopped_and_goes_on_comes_to_the_same_bytes(
    dataset: Dataset, whole: tuple[Path, Benchmark], tmp_path: Path
) -> None:
    plan = plan_of("test-loudest", "test-drawn", beside_paper=True)

    def stop(stage: Stage, _: int) -> None:
        if stage.done >= 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        benchmark(dataset, tmp_path / "out", plan, stop)
    assert len(list((tmp_path / "out" / "runs").glob("*.json"))) == 4
    benchmark(dataset, tmp_path / "out", plan)
    assert untimed(tmp_path / "out") == untimed(whole[0])


def test_a_run_that_fails_is_told_and_the_rest_is_made(dataset: Dataset, tmp_path: Path) -> None:
    found = benchmark(dataset, tmp_path / "out", plan_of("test-picky", "test-loudest", splits=["device"]))
    assert [(one.run, one.error) for one in found.failed] == [
        ("test-picky: device / Pixel", "it takes a Pixel"),
    ]
    assert {(row.model, row.fold) for row in found.rows if row.model == "test-picky"} == {("test-picky", "Galaxy")}
    assert "it takes a Pixel" in (tmp_path / "out" / "report.html").read_text()


def test_where_all_fail_there_is_a_page_without_figures(dataset: Dataset, tmp_path: Path) -> None:
    found = benchmark(dataset, tmp_path / "out", plan_of("test-picky", splits=["random"]))
    assert found.rows == []
    assert "it takes a Pixel" in (tmp_path / "out" / "report.html").read_text()


def test_a_folder_that_is_not_ours_is_refused(dataset: Dataset, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").write_text("keep")
    with pytest.raises(OutputError, match="vislam2tag benchmark did not create it"):
        benchmark(dataset, tmp_path / "out", plan_of("test-loudest"))


def test_public_sets_say_what_lacks(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="--dataset cities: unknown data set; choose one of tampere, "):
        public_dataset("cities", tmp_path).__enter__()
    with pytest.raises(
        DatasetError,
        match=r"gone: no such file or folder; --data must be the folder with the published files of tampere",
    ):
        public_dataset("tampere", tmp_path / "gone").__enter__()
    for name in ("tampere", "ujiindoorloc", "utsindoorloc"):
        with pytest.raises(DatasetError, match=str(tmp_path)):
            public_dataset(name, tmp_path).__enter__()


def test_a_public_set_is_run_with_its_own_split(tmp_path: Path) -> None:
    (tmp_path / "files").mkdir()
    for part in ("Training", "Test"):
        quartet_in(tmp_path / "files", part)
    with public_dataset("tampere", tmp_path / "files") as opened:
        found = benchmark(opened, tmp_path / "out", plan_of("test-loudest", splits=()))
    assert [(run.split, run.fold) for run in found.runs] == [("official", "official")]


def test_half_a_public_set_is_told(tmp_path: Path) -> None:
    quartet_in(tmp_path)
    with pytest.raises(
        DatasetError, match="the folder contains only a part of tampere; put its training and test files together"
    ):
        public_dataset("tampere", tmp_path).__enter__()
