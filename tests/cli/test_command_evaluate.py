"""``vislam2tag evaluate`` as its users run it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.surveys import make_survey


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("quality") / "survey", devices=("LG",), sessions=2, seconds=120)


def test_tables_and_files(survey: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    chosen = ("--strategy", "local", "--strategy", "smoother")
    done = vislam2tag("evaluate", survey, "--out", out, *chosen, "--jobs", "1")
    assert done.returncode == 0, done.stderr
    for text in (
        "Error at dense truth, over walks, metres",
        "without faults",
        "kept of what local labels",
        "2 (0 failed)",
    ):
        assert text in done.stdout
    assert "global" not in done.stdout
    assert f"page: {out / 'report.html'}\nnext: vislam2tag dataset" in done.stdout
    written = {path.name for path in out.iterdir()}
    tables = {"errors.csv", "errors.tex", "sessions.csv", "dense.csv"}
    assert written == tables | {"evaluation.json", "report.html", ".vislam2tag-files", "run.json", "trajectories"}


def test_a_session_that_cannot_be_read_is_exit_code_1(survey: Path, tmp_path: Path) -> None:
    copy = tmp_path / "survey"
    shutil.copytree(survey, copy)
    next((copy / "floor_0" / "LG").glob("*/poses.csv")).unlink()
    done = vislam2tag("evaluate", copy, "--out", tmp_path / "out", "--strategy", "local", "--jobs", "1")
    assert done.returncode == 1
    assert "failed" in done.stderr
    assert "2 (1 failed)" in done.stdout


def test_a_truth_that_cannot_be_used_is_named(survey: Path, tmp_path: Path) -> None:
    copy = tmp_path / "survey"
    shutil.copytree(survey, copy)
    sorted(copy.rglob("truth.csv"))[0].write_text("nothing\n")
    done = vislam2tag("evaluate", copy, "--out", tmp_path / "out", "--strategy", "local", "--jobs", "1")
    assert done.returncode == 0
    assert "no truth floor 0 / LG" in done.stderr
    assert "truth.csv: expected" in done.stderr


def test_a_survey_of_which_nothing_can_be_compared_is_exit_code_1(survey: Path, tmp_path: Path) -> None:
    copy = tmp_path / "survey"
    shutil.copytree(survey, copy)
    for truth in copy.rglob("truth.csv"):
        truth.write_text("nothing\n")
    done = vislam2tag("evaluate", copy, "--out", tmp_path / "out", "--strategy", "local", "--jobs", "1")
    assert done.returncode == 1
    assert done.stderr.count("no truth floor 0 / LG") >= 2
    assert "no session could be compared" in done.stderr


def test_wrong_usage_is_one_line_and_exit_code_2(survey: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert "not a survey" in the_error(vislam2tag("evaluate", tmp_path, "--out", out))
    assert "no mapping strategy" in the_error(vislam2tag("evaluate", survey, "--out", out, "--strategy", "best"))
    assert "--max-step-m inf" in the_error(vislam2tag("evaluate", survey, "--out", out, "--max-step-m", "inf"))
    assert "is no folder" in the_error(vislam2tag("evaluate", survey, "--out", out, "--truth", tmp_path / "none"))
    assert not out.exists()
