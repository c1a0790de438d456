"""Commands that compare models and repeat the paper: ``benchmark`` and ``paper``."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.positioning.benchmarked import benchmark_dataset
from tests.surveys import make_survey
from vislam2tag.cli.commands_benchmark import with_parameters
from vislam2tag.common.errors import UsageError
from vislam2tag.positioning.benchmark import ModelChoice


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("benchmark") / "ds"
    benchmark_dataset(folder)
    return folder


@pytest.mark.usefixtures("undrawn_figures")
def test_models_are_compared_and_told(dataset: Path, tmp_path: Path) -> None:
    done = vislam2tag(
        "benchmark", dataset, "--model", "weighted-knn", "--set", "weighted-knn.k=2", "--out", tmp_path / "out"
    )
    assert done.returncode == 0, done.stderr
    assert "Split random" in done.stdout
    assert "best on split random: weighted-knn, " in done.stdout
    assert (
        f"page: {tmp_path / 'out' / 'report.html'}\nnext: vislam2tag train {dataset} --model weighted-knn "
        in done.stdout
    )
    found = json.loads((tmp_path / "out" / "benchmark.json").read_text())
    assert [(run["model"], run["parameters"]["k"]) for run in found["runs"]] == [("weighted-knn", 2)]
    assert (tmp_path / "out" / "times.csv").read_text().splitlines()[0].startswith("model,fit_s,")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "--model: pass at least one of "),
        (("--model", "psychic"), "there is no positioning model 'psychic'; available are: "),
        (
            ("--model", "weighted-knn", "--split", "weather"),
            "--split weather: small has no such split; it has: block, day",
        ),
        (("--model", "probabilistic"), "the model probabilistic was removed; use weighted-knn"),
        (
            ("--model", "weighted-knn", "--set", "k=3"),
            "--set k=3: expected MODEL.PARAMETER=VALUE, such as weighted-knn.k=5",
        ),
        (
            ("--model", "weighted-knn", "--set", "other.k=3"),
            "--set other.k=3: 'other' is not among the models to run: weighted-knn",
        ),
        (("--model", "weighted-knn", "--set", "weighted-knn.legs=3"), "model weighted-knn has no parameter 'legs'"),
        (("--model", "weighted-knn", "--dataset", "tampere"), "pass either DS, or --dataset NAME with --data FILES"),
    ],
)
def test_wrong_usage_is_one_line(arguments: tuple[str, ...], message: str, dataset: Path, tmp_path: Path) -> None:
    assert message in the_error(vislam2tag("benchmark", dataset, "--out", tmp_path / "out", *arguments))
    assert list(tmp_path.iterdir()) == []


def test_public_sets_need_their_files(tmp_path: Path) -> None:
    command = ("benchmark", "--dataset", "ujiindoorloc", "--model", "weighted-knn", "--out", tmp_path / "out")
    assert "pass either DS" in the_error(vislam2tag(*command))
    assert "no such file or folder; --data must be" in the_error(vislam2tag(*command, "--data", tmp_path / "gone"))


def test_values_are_read_as_json_or_text() -> None:
    texts = ["net.layers=[512, 256]", "net.rate=1e-3", "net.scale=powed", "net.fast=true"]
    (choice,) = with_parameters([ModelChoice("net", {"cell_m": 20.0})], texts)
    assert choice.parameters == {"cell_m": 20.0, "layers": (512, 256), "rate": 1e-3, "scale": "powed", "fast": True}
    with pytest.raises(UsageError, match="expected MODEL"):
        with_parameters([ModelChoice("net")], ["net="])


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey that has nothing to do with the paper."""
    return make_survey(tmp_path_factory.mktemp("any") / "survey", devices=("LG",))


@pytest.mark.usefixtures("undrawn_figures")
def test_says_what_the_data_lacks(survey: Path, tmp_path: Path) -> None:
    done = vislam2tag("paper", survey, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "Table I: error at control points, over walks (metres): The data contains no walk over control points." in (
        done.stdout
    )
    assert "not drawn: Figure 9: labels of single scans: " in done.stdout
    assert "floor 4 / Galaxy / 2021-12-20T14:17:21 does not exist in this data" in done.stdout
    assert "2 of 13 figures drawn" in done.stdout
    assert (tmp_path / "out" / "index.html").is_file()


@pytest.mark.usefixtures("undrawn_figures")
def test_a_walk_that_cannot_be_evaluated_shows_in_the_exit_code(survey: Path, tmp_path: Path) -> None:
    copy = tmp_path / "survey"
    shutil.copytree(survey, copy)
    (poses,) = copy.glob("floor_0/LG/*/poses.csv")
    poses.with_name("tachy.csv").write_text(
        "time;X;Y\n2022-01-14 16:01:04.250;1.5;-2\n2022-01-14 16:01:04.350;1.6;-2\n"
    )
    done = vislam2tag("paper", copy, "--out", tmp_path / "out")
    assert done.returncode == 1, done.stderr
    assert "skipped: floor 0 / LG: the total station's frame needs at least two common points, but none is known" in (
        done.stdout
    )
