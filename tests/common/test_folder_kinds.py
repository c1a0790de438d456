"""A path that a command cannot use is named."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from vislam2tag.common.folder_kinds import found_at, is_survey, kind_of, survey_around, written_by


@pytest.fixture
def root(tmp_path: Path) -> Path:
    for name, program in (("labels", "vislam2tag"), ("figures", "vislam2tag figures"), ("foreign", "other")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.json").write_text(json.dumps({"program": program}))
    (tmp_path / "set").mkdir()
    (tmp_path / "set" / "dataset.json").write_text(json.dumps({"made_by": "import"}))
    (tmp_path / "survey" / "floor_-1" / "Pixel" / "walk").mkdir(parents=True)
    (tmp_path / "survey" / "floor_-1" / "floorplan.jpg").touch()
    (tmp_path / "empty").mkdir()
    (tmp_path / "building.v2t").touch()
    (tmp_path / "notes.txt").touch()
    return tmp_path


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("labels", "the output of `vislam2tag process`"),
        ("figures", "the output of `vislam2tag figures`"),
        ("foreign", ""),
        ("set", "a data set"),
        ("survey", "a survey"),
        ("empty", "an empty folder"),
        ("building.v2t", "a model of `vislam2tag train`"),
        ("notes.txt", "a file"),
        ("none", "missing"),
    ],
)
def test_kinds(root: Path, name: str, kind: str) -> None:
    assert kind_of(root / name) == kind
    assert found_at(root / name) == (f"; it is {kind}" if kind else "")


def test_folders_of_a_survey_name_it(root: Path) -> None:
    survey = root / "survey"
    for inner in (survey / "floor_-1", survey / "floor_-1" / "Pixel", survey / "floor_-1" / "Pixel" / "walk"):
        assert survey_around(inner) == survey.resolve()
    assert kind_of(survey / "floor_-1" / "Pixel" / "walk") == f"a folder of the survey {survey.resolve()}"
    assert survey_around(survey) is None
    assert is_survey(survey)
    assert not is_survey(root)


def test_makers_are_read_from_records(root: Path) -> None:
    assert written_by(root / "set") == "vislam2tag import"
    assert written_by(root / "labels") == "vislam2tag process"
    (root / "labels" / "run.json").write_text("[")
    assert written_by(root / "labels") is None
