from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.surveys import make_survey

@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A survey that has nothing to do with the paper."""
    return make_survey(tmp_path_factory.mktemp("any") / "survey", devices=("LG",))


@pytest.mark.usefixtures("undrawn_figures")
def test_says_what_the_data_lacks(survey: Path, tmp_path: Path) -> None:
    done = vislam2tag("paper", survey, "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    assert "Table I: error at control points, over walks (metres): No walk over control points is in this data." in (
        done.stdout
    )
    assert "not drawn: Figure 9: labels of single scans: " in done.stdout
    assert "floor 4 / Galaxy / 2021-12-20T14:17:21 is not in this data" in done.stdout
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
    assert "left out: floor 0 / LG: the total station's frame needs two common points at least, none is known" in (
        done.stdout
    )


def test_a_folder_without_survey_is_one_line(tmp_path: Path) -> None:
    assert "not a survey" in the_error(vislam2tag("paper", tmp_path, "--out", tmp_path / "out"))
    assert not (tmp_path / "out").exists()
