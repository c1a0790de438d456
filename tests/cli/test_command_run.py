"""``vislam2tag run`` as its users run it."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.surveys import bytes_of, make_survey
from vislam2tag.datasets.folder import open_dataset


def test_a_survey_becomes_a_data_set_and_what_is_unchanged_is_kept(tmp_path: Path) -> None:
    survey, out = make_survey(tmp_path / "campus"), tmp_path / "out"
    done = vislam2tag("run", survey, "--out", out, "--jobs", "1")
    assert (done.returncode, done.stderr) == (0, "")
    assert "2 sessions (0 failed); frames labelled: " in done.stdout
    assert "floor 0: mean error to expect 0." in done.stdout
    assert "kept" not in done.stdout
    assert done.stdout.splitlines()[-2:] == [
        f"page: {out / 'index.html'}",
        f"next: vislam2tag train {out / 'dataset'} --out building.v2t",
    ]
    assert open_dataset(out / "dataset").info.name == "campus"
    links = re.findall(r'href="([^"]+\.html)"', (out / "index.html").read_text())
    assert links == ["labels/report.html", "conflicts.html", "check/check.html", "dataset/report.html"]
    assert all((out / link).is_file() for link in links)
    before = bytes_of(out)
    made = (out / "dataset" / "dataset.json").stat().st_mtime_ns, (out / "check" / "check.json").stat().st_mtime_ns
    done = vislam2tag("run", survey, "--out", out, "--jobs", "1")
    assert "unchanged and kept: diagnosis, check, dataset" in done.stdout
    assert bytes_of(out) == before
    assert made == (
        (out / "dataset" / "dataset.json").stat().st_mtime_ns,
        (out / "check" / "check.json").stat().st_mtime_ns,
    )
    (out / "check" / "check.html").unlink()
    done = vislam2tag("run", survey, "--out", out, "--jobs", "1")
    assert "unchanged and kept: diagnosis, dataset" in done.stdout
    assert bytes_of(out) == before
    (out / "diagnosis.json").write_text('{"faults": ""}')
    done = vislam2tag("run", survey, "--out", out, "--jobs", "1")
    assert "unchanged and kept: check, dataset" in done.stdout
    assert bytes_of(out) == before
    (survey / "corrections.toml").write_text('[[exclude_session]]\ndevice = "LG"\nreason = "dropped"\n')
    done = vislam2tag("run", survey, "--out", out, "--jobs", "1")
    assert done.returncode == 0
    assert "kept" not in done.stdout
    assert len(open_dataset(out / "dataset").info.sources) == 1
    assert "1 sessions (0 failed); frames labelled: " in done.stdout


def test_folders_that_cannot_be_are_refused(tmp_path: Path) -> None:
    survey = make_survey(tmp_path / "campus", devices=("LG",))
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.txt").write_text("mine")
    assert "is not empty and was not made by vislam2tag run" in the_error(
        vislam2tag("run", survey, "--out", tmp_path / "full")
    )
    assert "not a survey" in the_error(vislam2tag("run", tmp_path / "full", "--out", tmp_path / "out"))
    assert not (tmp_path / "out").exists()


def test_results_come_as_json_too(tmp_path: Path) -> None:
    survey, labels = make_survey(tmp_path / "campus", devices=("LG",)), tmp_path / "labels"
    for command in (
        ("process", survey, "--out", labels),
        ("check", survey),
        ("evaluate", survey, "--out", tmp_path / "evaluation"),
        ("dataset", labels, "--out", tmp_path / "set"),
        ("run", survey, "--out", tmp_path / "out"),
    ):
        done = vislam2tag(*command, "--jobs", "1", "--json")
        assert done.returncode == 0, done.stderr
        assert isinstance(json.loads(done.stdout), dict), command


@pytest.mark.parametrize("own", [True, False])
def test_what_is_wrong_is_told_first(tmp_path: Path, own: bool) -> None:
    """Of the floors' own landmark files, and of one that is given in their place."""
    survey = make_survey(tmp_path / "campus", seconds=100.0)
    marks = survey / "floor_0" / "marker_dict.csv"
    head, *rows = marks.read_text().splitlines()
    feet = [",".join([name, *(f"{float(cell) / 0.3048:.4f}" for cell in cells)]) for name, *cells in csv.reader(rows)]
    given = tmp_path / "feet.csv"
    given.write_text("\n".join([f"{head},floor", *(f"{row},0" for row in feet)]) + "\n")
    if own:
        marks.write_text("\n".join([head, *feet]) + "\n")
    words = () if own else ("--landmarks", given)
    done = vislam2tag("run", survey, "--out", tmp_path / "out", "--jobs", "1", *words)
    faults = [line for line in done.stdout.splitlines() if line.startswith("wrong: ")]
    assert faults
    assert f"next: vislam2tag diagnose {survey} --apply" in done.stdout
    assert "What is wrong" in (tmp_path / "out" / "index.html").read_text()
