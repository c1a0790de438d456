"""Commands that find what is wrong with landmarks, or where they are: ``diagnose`` and ``survey-landmarks``."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.pipeline.labels.test_landmark_survey import SURVEYED, few, rewritten
from tests.surveys import bytes_of, make_survey
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import Climb
from vislam2tag.simulation.survey import WritingOptions, simulate


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("diagnose") / "survey", sessions=2, seconds=120)


def swap_rows(table: Path, one: str, other: str) -> None:
    header, *lines = table.read_text().splitlines()
    rows = dict(line.split(",", 1) for line in lines)
    rows[one], rows[other] = rows[other], rows[one]
    table.write_text("\n".join([header, *(f"{name},{place}" for name, place in rows.items())]) + "\n")


def labelled_share(out: Path) -> float:
    frames = json.loads((out / "summary.json").read_text())["frames"]
    return float(frames["ok"] / sum(frames.values()))


def test_a_swap_is_named_applied_and_reverted(sound: Path, tmp_path: Path) -> None:
    copy = tmp_path / "survey"
    shutil.copytree(sound, copy)
    swap_rows(copy / "floor_0" / "marker_dict.csv", "3", "6")
    (copy / "corrections.toml").write_bytes(b'# by hand\n[[exclude_landmark]]\nid = "12"  # gone')
    rows = dict(line.split(",", 1) for line in (copy / "floor_0" / "marker_dict.csv").read_text().splitlines())
    (copy / "floor_0" / "rooms.csv").write_text(f"name,x,y\nLab,{rows['6']}\n")
    before = bytes_of(copy)
    wrong = vislam2tag("process", copy, "--out", tmp_path / "wrong", "--jobs", "1")
    assert wrong.returncode == 0, wrong.stderr
    assert "wrong: landmarks 3 and 6 of floor 0 are interchanged" in wrong.stdout
    assert f"next: vislam2tag diagnose {copy}" in wrong.stdout
    assert "are interchanged" in (tmp_path / "wrong" / "report.html").read_text()

    said = vislam2tag("diagnose", copy, "--jobs", "1")
    assert said.returncode == 1, said.stderr
    for text in ("Landmarks 3 and 6 of floor 0 are interchanged", "[[swap_landmarks]]", "faults: 1 named"):
        assert text in said.stdout
    assert re.search(r"are interchanged \(3 in (room )?Lab\)\.", said.stdout), "where 6 is in the table"
    assert bytes_of(copy) == before

    assert vislam2tag("diagnose", copy, "--apply", "--jobs", "1").returncode == 0
    assert vislam2tag("diagnose", copy, "--jobs", "1").returncode == 0
    assert vislam2tag("process", copy, "--out", tmp_path / "right", "--jobs", "1").returncode == 0
    assert labelled_share(tmp_path / "right") > labelled_share(tmp_path / "wrong") + 0.1

    assert vislam2tag("diagnose", copy, "--revert").returncode == 0
    assert bytes_of(copy) == before


def test_a_sound_survey_has_no_fault(sound: Path) -> None:
    done = vislam2tag("diagnose", sound, "--json", "--jobs", "1")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["sessions"], found["faults"], found["failed"]) == (4, [], [])


def test_a_survey_half_a_metre_off_is_the_odd_one_out(sound: Path, tmp_path: Path) -> None:
    copy = tmp_path / "survey"
    shutil.copytree(sound, copy)
    table = copy / "floor_0" / "marker_dict.csv"
    table.write_text(re.sub(r"^3,([-.\d]+)", lambda row: f"3,{float(row[1]) + 0.5}", table.read_text(), flags=re.M))
    page = tmp_path / "conflicts.html"
    done = vislam2tag("diagnose", copy, "--json", "--conflicts", page, "--jobs", "1")
    assert done.returncode == 1, done.stderr
    found = json.loads(done.stdout)
    assert [(fault["kind"], fault["landmarks"], fault["corrections"]) for fault in found["faults"]] == [
        ("odd_reference", ["3"], [])
    ]
    (odd,) = (one for one in found["references"]["compared"] if one["verdict"] == "contradicts")
    assert (odd["landmark"], odd["session"]) == ("3", None)
    assert odd["offset_m"] == pytest.approx([0.5, 0], abs=0.15)
    assert "landmark 3 on floor 0" in page.read_text("utf-8")
    assert "is among" in the_error(vislam2tag("diagnose", copy, "--conflicts", table))
    (fault,) = found["faults"]
    place = {name: odd[name] for name in ("x_m", "y_m")}
    assert {name: fault["by_walks"][name] for name in place} == pytest.approx(place, abs=0.01)
    assert 0 < fault["by_walks"]["sigma_m"] < 0.2
    (copy / "corrections.toml").write_text(
        '[[ignore_fault]]\nkind = "odd_reference"\nlandmarks = ["3"]\nreason = "on a door"\n'
    )
    ignored = vislam2tag("diagnose", copy, "--jobs", "1")
    assert ignored.returncode == 0, ignored.stderr
    assert "ignored: on a door" in ignored.stdout
    assert "faults: nothing is wrong" in ignored.stdout
    assert ", 1 ignored" in ignored.stdout


def test_apply_and_revert_exclude_each_other(sound: Path) -> None:
    assert "use only one of the two" in the_error(vislam2tag("diagnose", sound, "--apply", "--revert"))


def test_one_id_on_two_floors_of_a_walk_is_told_and_corrected(tmp_path: Path) -> None:
    """Floor 1's sheet 111 gets the id 3, which floor 0 has, too; walks went to both floors."""
    survey = tmp_path / "survey"
    simulate(regular_survey(4, "none", (0, 1), ("LG",), 1, 150.0, climb=Climb.STAIRS), survey, WritingOptions())
    for path, mark in (
        (survey / "floor_1" / "marker_dict.csv", ","),
        *((at, ";") for at in survey.rglob("initPoses*")),
    ):
        path.write_text("\n".join(re.sub(f"^111{mark}", f"3{mark}", line) for line in path.read_text().split("\n")))
    refused = vislam2tag("process", survey, "--out", tmp_path / "labels", "--jobs", "1")
    assert refused.returncode == 3
    assert "Run `vislam2tag diagnose` to find which sheet it observed when" in refused.stderr
    said = vislam2tag("diagnose", survey, "--apply", "--jobs", "1")
    assert "passed the landmark 3 of floor 1, but another floor has one with this id" in said.stdout
    assert "effect of the correction: 0 % -> 100 % of frames labelled" in said.stdout
    assert vislam2tag("process", survey, "--out", tmp_path / "labels", "--jobs", "1").returncode == 0
    assert labelled_share(tmp_path / "labels") > 0.9


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


def test_walks_that_nothing_ties_are_3_and_named(survey: Path, tmp_path: Path) -> None:
    bare = rewritten(survey, tmp_path / "survey", lambda row: row if row[0] == "5" else [row[0], "", ""])
    done = vislam2tag("survey-landmarks", bare, "--out", tmp_path / "c.csv", "--jobs", "1")
    assert done.returncode == 3
    assert done.stdout.count("not related to the survey: ") == 6
    assert "12 landmarks: 1 surveyed, 0 estimated, 11 without a position; 0 of 6 sessions used" in done.stdout


def test_wrong_usage_is_2_with_one_line_and_nothing_written(survey: Path, tmp_path: Path) -> None:
    raw = bytes_of(survey)
    own = survey / "floor_0/marker_dict.csv"
    for arguments, message in (
        ((survey, "--out", own), "this path is among the survey's own files; choose another name"),
        ((survey, "--out", tmp_path / "c.csv", "--report", own), "this path is among the survey's own files"),
        (
            (survey, "--out", tmp_path / "c.csv", "--report", tmp_path / "c.csv"),
            "landmarks and report need two different files",
        ),
        ((tmp_path / "gone", "--out", tmp_path / "c.csv"), "no such folder; expected a survey folder"),
        ((survey, "--out", tmp_path / "gone" / "c.csv"), "c.csv: cannot be written (its folder does not exist)"),
        ((survey, "--out", tmp_path / "c.csv", "--floor", "7"), "--floor 7: the survey has no session with this floor"),
    ):
        assert message in the_error(vislam2tag("survey-landmarks", *arguments))
    assert bytes_of(survey) == raw
    assert bytes_of(tmp_path) == {}
