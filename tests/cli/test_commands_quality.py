"""Commands that measure how good labels are: ``check`` and ``evaluate``."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.surveys import bytes_of, make_survey

LONG = "Laboratory for Wireless Communication and Localisation West"


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("quality") / "survey", devices=("LG",), sessions=2, seconds=120)


def test_a_check_has_tables_and_files(survey: Path, tmp_path: Path) -> None:
    before = bytes_of(survey)
    done = vislam2tag("check", survey, "--out", tmp_path / "out", "--jobs", "1")
    assert done.returncode == 0, done.stderr
    for text in (
        "estimated",
        "90 % interval",
        "Labels: estimated mean error 0.",
        "landmarks and known positions: ",
        "Best places for another landmark",
        "sessions: 2 (0 failed)",
    ):
        assert text in done.stdout
    assert f"page: {tmp_path / 'out' / 'check.html'}\n" in done.stdout
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["check.html", "check.json"]
    assert bytes_of(survey) == before


def test_what_was_walked_is_measured_against_the_plan_and_rooms_have_names(
    survey: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    own = shutil.copytree(survey, tmp_path / "survey")
    header, first, *_ = (own / "floor_0" / "marker_dict.csv").read_text().splitlines()
    landmark = dict(zip(header.split(","), first.split(","), strict=True))  # its wall is that of some room or corridor
    (own / "floor_0" / "rooms.csv").write_text(f"name,x,y\nLab,left,2\n{LONG},{landmark['x']},{landmark['y']}\n")
    done = vislam2tag("check", own, "--out", tmp_path / "out", "--jobs", "1")
    assert done.returncode == 0, done.stderr
    (floor,) = json.loads((tmp_path / "out" / "check.json").read_text())["walked"]
    rooms = [area for area in floor["areas"] if area["room"]]
    assert 0 < floor["scanned"] <= floor["walked"] < 0.9
    assert len(rooms) > 10
    assert not all(room["entered"] for room in rooms)
    assert floor["walk"]["length_m"] > 50
    assert f"{sum(room['entered'] for room in rooms)} of {len(rooms)}" in done.stdout
    assert "Rooms and corridors with the largest unwalked area" in done.stdout
    (said,) = json.loads(vislam2tag("check", own, "--json", "--jobs", "1").stdout)["walked"]
    assert said == floor, "the same without --out"
    assert "floor_0/rooms.csv: these rows have no name, or no x and y in metres" in done.stdout
    page = (tmp_path / "out" / "check.html").read_text()
    assert "walkable, but not walked" in page
    assert ", but not room " in page
    assert "room at (" in page
    assert LONG in {area["name"].removeprefix("room ") for area in floor["areas"]}
    assert f'"text":["{LONG}"]' in page
    tables = [line for line in done.stdout.splitlines() if line.startswith(" ")]
    assert len(tables) > 20
    assert max(map(len, tables)) <= 80
    assert "…" not in done.stdout


def test_a_floor_without_a_plan_says_so(survey: Path, tmp_path: Path) -> None:
    own = shutil.copytree(survey, tmp_path / "survey")
    (own / "floor_0" / "floorplan.jpg").unlink()
    done = vislam2tag("check", own, "--out", tmp_path / "out", "--jobs", "1")
    assert done.returncode == 0, done.stderr
    assert "floor 0: not measured against the plan: floor 0: has no plan" in done.stdout


def test_without_out_nothing_is_written(survey: Path, tmp_path: Path) -> None:
    done = vislam2tag("check", survey, "--floor", "0", "--device", "LG", "--max-sigma-m", "inf", "--jobs", "1")
    assert done.returncode == 0, done.stderr
    assert "sigma at most inf m" in done.stdout
    assert "page:" not in done.stdout


def test_a_session_that_cannot_be_checked_is_exit_code_1(survey: Path, tmp_path: Path) -> None:
    copy = tmp_path / "survey"
    shutil.copytree(survey, copy)
    next((copy / "floor_0" / "LG").glob("*/poses.csv")).unlink()
    done = vislam2tag("check", copy, "--jobs", "1")
    assert done.returncode == 1
    assert "failed" in done.stderr
    assert "fewer than 2 usable camera frames" in done.stderr
    assert "sessions: 2 (1 failed)" in done.stdout


def test_a_check_is_not_written_into_a_file(survey: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert "a file, not a folder" in the_error(vislam2tag("check", survey, "--out", tmp_path / "file"))


def test_an_evaluation_has_tables_and_files(survey: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    chosen = ("--strategy", "local", "--strategy", "smoother")
    done = vislam2tag("evaluate", survey, "--out", out, *chosen, "--jobs", "1")
    assert done.returncode == 0, done.stderr
    for text in (
        "Error at dense truth, over walks, metres",
        "without faults",
        "Labels of smoother: mean error 0.",
        "labelled, relative to local",
        "2 (0 failed)",
    ):
        assert text in done.stdout
    assert "global" not in done.stdout
    assert f"page: {out / 'report.html'}\nnext: vislam2tag dataset" in done.stdout
    written = {path.name for path in out.iterdir()}
    tables = {"errors.csv", "errors.tex", "sessions.csv", "dense.csv"}
    assert written == tables | {"evaluation.json", "report.html", ".vislam2tag-files", "run.json", "trajectories"}


def test_a_session_that_cannot_be_evaluated_is_exit_code_1(survey: Path, tmp_path: Path) -> None:
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


def test_a_survey_of_which_nothing_can_be_compared_is_exit_code_3(survey: Path, tmp_path: Path) -> None:
    copy = tmp_path / "survey"
    shutil.copytree(survey, copy)
    for truth in copy.rglob("truth.csv"):
        truth.write_text("nothing\n")
    done = vislam2tag("evaluate", copy, "--out", tmp_path / "out", "--strategy", "local", "--jobs", "1")
    assert done.returncode == 3
    assert done.stderr.count("no truth floor 0 / LG") >= 2
    assert "no session could be compared" in done.stderr
