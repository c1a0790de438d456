"""``survey-landmarks`` as its users meet it, and ``process --landmarks`` on what it wrote."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.pipeline.labels.test_landmark_survey import SURVEYED, few, rewritten
from tests.surveys import bytes_of, make_survey


@pytest.fixture(scope="module", name="survey")
def _survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six walks past 12 landmarks of which three are surveyed; only read."""
    folder = tmp_path_factory.mktemp("cli")
    whole = make_survey(folder / "whole", sessions=3, seconds=120.0, severity="default")
    return rewritten(whole, folder / "survey", few)


def test_three_surveyed_landmarks_and_the_walks_do_the_rest(survey: Path, tmp_path: Path) -> None:
    raw = bytes_of(survey)
    file, report = tmp_path / "completed.csv", tmp_path / "landmarks.json"
    done = vislam2tag("survey-landmarks", survey, "--out", file, "--report", report, "--jobs", "1")
    assert (done.returncode, done.stderr) == (0, "")
    assert "12 landmarks: 3 surveyed, " in done.stdout
    assert f"\nlandmarks: {file}\nnext: vislam2tag process " in done.stdout
    assert file.read_text().startswith("id,x,y,z,floor,sigma_m,heading_rad,heading_sigma_rad\n")
    told = json.loads(report.read_text())
    assert [row["landmark"] for row in told["landmarks"] if row["surveyed"]] == sorted(SURVEYED)
    assert all(session["used"] for session in told["sessions"])
    assert bytes_of(survey) == raw

    mapped = vislam2tag(
        "process", survey, "--out", tmp_path / "out", "--landmarks", file, "--strategy", "smoother", "--jobs", "1"
    )
    assert mapped.returncode == 0, mapped.stderr
    errors = [json.loads(path.read_text())["errors"] for path in (tmp_path / "out/sessions").glob("*.json")]
    labelled = sum(sum(row["errors"].values()) for one in errors for row in one["rows"])
    assert labelled > 0.9 * sum(one["points"] for one in errors)
    assert sum(row["sum_m"] for one in errors for row in one["rows"]) / labelled < 0.6


def test_walks_that_nothing_ties_are_1_and_named(survey: Path, tmp_path: Path) -> None:
    bare = rewritten(survey, tmp_path / "survey", lambda row: row if row[0] == "5" else [row[0], "", ""])
    done = vislam2tag("survey-landmarks", bare, "--out", tmp_path / "c.csv", "--jobs", "1")
    assert done.returncode == 1
    assert done.stdout.count("nothing ties it to the survey") == 6
    assert "12 landmarks: 1 surveyed, 0 estimated, 11 without a position; 0 of 6 sessions used" in done.stdout


def test_wrong_usage_is_2_with_one_line_and_nothing_written(survey: Path, tmp_path: Path) -> None:
    raw = bytes_of(survey)
    own = survey / "floor_0/marker_dict.csv"
    for arguments, message in (
        ((survey, "--out", own), "lies among the survey's own files; choose another name"),
        ((survey, "--out", tmp_path / "c.csv", "--report", own), "lies among the survey's own files"),
        ((survey, "--out", tmp_path / "c.csv", "--report", tmp_path / "c.csv"), "one file cannot hold both"),
        ((tmp_path / "gone", "--out", tmp_path / "c.csv"), "no such folder; expected a survey folder"),
        ((survey, "--out", tmp_path / "gone" / "c.csv"), "c.csv: cannot be written (there is no such folder)"),
        ((survey, "--out", tmp_path / "c.csv", "--floor", "7"), "--floor 7: the survey has no session of it"),
    ):
        assert message in the_error(vislam2tag("survey-landmarks", *arguments))
    assert bytes_of(survey) == raw
    assert bytes_of(tmp_path) == {}
