"""What version 0.1.0 wrote opens, or is refused by name."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.surveys import bytes_of, make_survey
from vislam2tag.api import BuildOptions, Outcome, OutputError, Settings, build_dataset, process

SETTINGS = {
    "default_landmark_sigma_m": 0.02,
    "findings": {"frame_gap_s": 1.0, "pose_lag_s": 0.1, "scan_interval_s": 20.0},
    "labels": {"max_gap_s": 1.0, "max_sigma_m": 0.5, "rule": "interpolate"},
    "local": {"max_step_m": 5.0},
    "smoother": {"allow_for_pose_lag": False, "sighting_range_m": 6.0},
    "strategy": "local",
    "visits": {"radius_m": 1.0},
}
"""As its ``run.json`` had them."""


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    return make_survey(tmp_path / "survey", devices=("LG",), seconds=60.0)


@pytest.fixture
def labels(survey: Path) -> Path:
    """An output folder with the run and the sessions' records of 0.1.0."""
    out = survey.parent / "labels"
    process(survey, out, Settings(strategy="local"), jobs=1)
    run = json.loads((out / "run.json").read_text(encoding="utf-8"))
    run |= {"settings": SETTINGS, "versions": {**run["versions"], "vislam2tag": "0.1.0"}}
    (out / "run.json").write_text(json.dumps(run), encoding="utf-8")
    for path in (out / "sessions").iterdir():
        record = json.loads(path.read_text(encoding="utf-8"))
        path.write_text(json.dumps({**record, "version": "0.1.0", "fingerprint": "0" * 64}), encoding="utf-8")
    return out


def test_a_data_set_is_built_of_older_labels(survey: Path, labels: Path, tmp_path: Path) -> None:
    built = build_dataset([labels], tmp_path / "set", options=BuildOptions(surveys=(survey,)), jobs=1)
    assert [source.version for source in built.info.sources] == ["0.1.0"]


def test_older_sessions_are_mapped_again_into_the_same_tables(survey: Path, labels: Path) -> None:
    before = bytes_of(labels / "trajectory")
    outcomes: list[Outcome] = []
    process(
        survey,
        labels,
        Settings(strategy="local"),
        jobs=1,
        progress=lambda outcome, total: outcomes.append(outcome),
    )
    assert [outcome.repeated for outcome in outcomes] == [True]
    assert bytes_of(labels / "trajectory") == before


def test_older_labels_of_another_strategy_are_refused_by_name(survey: Path, labels: Path) -> None:
    with pytest.raises(OutputError, match="contains labels of the strategy local"):
        process(survey, labels, Settings(strategy="global"), jobs=1)
