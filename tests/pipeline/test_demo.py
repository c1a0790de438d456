"""The demonstration, from simulation to scores."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.pipeline.positioning.test_serve import asked
from tests.positioning.in_an_app import answered, assert_same, question
from tests.surveys import bytes_of
from vislam2tag.common.errors import OutputError
from vislam2tag.estimation.strategy import strategies_for_poses
from vislam2tag.pipeline import demo
from vislam2tag.pipeline.datasets.build import BuildOptions, build_dataset
from vislam2tag.pipeline.demo import run_demo
from vislam2tag.pipeline.positioning.serve import ServedAnswers
from vislam2tag.pipeline.positioning.train import TrainPlan, train
from vislam2tag.positioning.learning_data import learning_data
from vislam2tag.positioning.model_files import load_model
from vislam2tag.quality.evaluation.metrics import ErrorSummary
from vislam2tag.settings import Settings
from vislam2tag.simulation.scenario import regular_survey


@pytest.fixture(scope="module")
def demonstrated(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, ErrorSummary]]:
    out = tmp_path_factory.mktemp("demonstrated") / "demo"
    return out, run_demo(out, say=lambda _: None)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["weighted-knn", "local-kriging"])
def test_a_model_learned_from_the_demonstration_answers_over_http_and_in_an_app(
    demonstrated: tuple[Path, dict[str, ErrorSummary]], tmp_path: Path, name: str
) -> None:
    out, _ = demonstrated
    dataset = build_dataset(out / "smoother", tmp_path / "set", options=BuildOptions(surveys=(out / "survey",)))
    made = train(tmp_path / "set", TrainPlan(name, {}), tmp_path / "demo.v2t")
    scans = learning_data(dataset).scans[np.arange(0, 200, 5)]
    answers = ServedAnswers(load_model(tmp_path / "demo.v2t"), tmp_path / "set")
    answer = asked(answers, "POST", "/locate", json=question(scans))
    assert answer.status_code == 200
    found = answer.json()["positions"]
    expected = made.saved.model.predict(scans)
    np.testing.assert_allclose([(one["x"], one["y"]) for one in found], expected.xy, atol=0.001)
    assert all(0 < one["radius_68_m"] <= one["radius_95_m"] for one in found)
    floors = asked(answers, "GET", "/model").json()["floors"]
    assert asked(answers, "GET", floors[0]["plan"]).headers["content-type"].startswith("image/")
    (tmp_path / "app.v2t").write_bytes(asked(answers, "GET", "/model.v2t").content)
    assert_same(answered(tmp_path / "app.v2t", scans), expected)


def test_demo_scores_each_strategy_and_repeats_nothing(
    demonstrated: tuple[Path, dict[str, ErrorSummary]],
) -> None:
    out, scores = demonstrated
    said: list[str] = []
    assert set(scores) == set(strategies_for_poses())
    for entry in scores.values():
        assert entry.labelled_share > 0.4
        assert 0 < entry.median_m <= entry.p75_m <= entry.p95_m <= entry.max_m
    assert scores["local-corrected"].mean_m < 0.5
    assert scores["local-corrected"].mean_m < scores["global"].mean_m
    assert scores["local-corrected"].labelled_share < scores["local"].labelled_share
    assert scores["smoother"].mean_m < scores["local"].mean_m
    assert scores["smoother"].labelled_share == 1 > scores["global"].labelled_share
    assert (out / Settings().strategy / "report.html").is_file()
    assert len(json.loads((out / "scores.json").read_text())) == len(scores)
    before = bytes_of(out)
    run_demo(out, say=said.append)
    assert bytes_of(out) == before
    assert any("earlier demonstration" in line for line in said)


@pytest.mark.parametrize(("seed", "kept"), [(1, True), (2, False)])
def test_a_survey_of_another_seed_is_simulated_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, seed: int, kept: bool
) -> None:
    monkeypatch.setattr(demo, "strategies_for_poses", lambda: ())
    monkeypatch.setattr(demo, "regular_survey", lambda seed, **_: regular_survey(seed, sessions=1, duration_s=5.0))
    said: list[str] = []
    run_demo(tmp_path / "demo", say=said.append)
    (tmp_path / "demo" / ".survey.vislam2tag").mkdir()
    before = bytes_of(tmp_path / "demo" / "survey")
    run_demo(tmp_path / "demo", seed=seed, say=said.append)
    assert (bytes_of(tmp_path / "demo" / "survey") == before) is kept
    assert any("earlier demonstration" in line for line in said) is kept


def test_a_foreign_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.txt").write_text("mine")
    with pytest.raises(OutputError, match="does not contain a demonstration"):
        run_demo(tmp_path)
