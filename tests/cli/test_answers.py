"""Commands distinguish nothing wrong, not looked at and could not judge, and end with 0 only if something was done."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from tests.cli.command import the_error, vislam2tag
from tests.locks import lock
from tests.surveys import make_survey
from vislam2tag.cli.app import app
from vislam2tag.datasets.folder import open_dataset

EXCLUDED = '[[exclude_session]]\nfloor = 0\nreason = "test"\n'


@pytest.fixture(scope="module")
def surveys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three surveys of the same walks: as they are, with all sessions excluded, and without any surveyed landmark."""
    folder = tmp_path_factory.mktemp("surveys")
    sound = make_survey(folder / "sound", sessions=2, seconds=120)
    for name in ("excluded", "unsurveyed"):
        shutil.copytree(sound, folder / name)
    (folder / "excluded" / "corrections.toml").write_text(EXCLUDED)
    table = folder / "unsurveyed" / "floor_0" / "marker_dict.csv"
    table.write_text(table.read_text().splitlines()[0] + "\n")
    for plan in (folder / "unsurveyed" / "floor_0").glob("floorplan.*"):
        plan.unlink()  # by which walks would be placed
    return folder


def answer_of(command: str, survey: Path) -> tuple[int, dict[str, Any]]:
    done = vislam2tag("-q", command, survey, "--json", *(() if command == "inspect" else ("--jobs", "1")))
    judgement: dict[str, Any] = json.loads(done.stdout)["judgement"]
    return done.returncode, judgement


@pytest.mark.parametrize("command", ["inspect", "diagnose", "check"])
def test_a_sound_survey_is_sound_in_what_was_looked_at(command: str, surveys: Path) -> None:
    code, judgement = answer_of(command, surveys / "sound")
    assert (code, judgement["answer"]) == (0, "nothing_wrong")
    assert judgement["looked_at"]


@pytest.mark.parametrize("command", ["inspect", "diagnose", "check"])
def test_excluded_sessions_were_not_looked_at(command: str, surveys: Path) -> None:
    code, judgement = answer_of(command, surveys / "excluded")
    assert (code, judgement["answer"], judgement["looked_at"]) == (3, "not_looked_at", "")
    said = vislam2tag("-q", command, surveys / "excluded").stdout
    assert "not looked at: " in said
    assert "vislam2tag inspect" in said.splitlines()[-1]
    assert "nothing is wrong" not in said


@pytest.mark.parametrize("command", ["diagnose", "check"])
def test_without_surveyed_landmarks_nothing_can_be_judged(command: str, surveys: Path) -> None:
    code, judgement = answer_of(command, surveys / "unsurveyed")
    assert (code, judgement["answer"]) == (3, "not_judged")
    assert judgement["why"]
    said = vislam2tag("-q", command, surveys / "unsurveyed", "--jobs", "1").stdout
    assert "could not be judged: " in said
    assert said.splitlines()[-1] == f"next: vislam2tag inspect {surveys / 'unsurveyed'}"


def test_pages_say_which_answer_it_is(surveys: Path, tmp_path: Path) -> None:
    for name, words in (("sound", "nothing is wrong (looked at: "), ("unsurveyed", "could not be judged: ")):
        out = tmp_path / name
        vislam2tag("-q", "check", surveys / name, "--out", out / "check", "--jobs", "1")
        assert f"Landmarks and known positions: {words}" in (out / "check" / "check.html").read_text()
        vislam2tag("-q", "process", surveys / name, "--out", out / "labels", "--jobs", "1")
        page = (out / "labels" / "report.html").read_text()
        assert f"Result for the survey: {words}" in page
        assert "no landmark contradicts the rest" not in page


@pytest.mark.parametrize("options", [(), ("--dry-run",)])
def test_process_without_a_session_to_map_is_no_success(
    surveys: Path, tmp_path: Path, options: tuple[str, ...]
) -> None:
    done = vislam2tag("-q", "process", surveys / "excluded", "--out", tmp_path / "labels", *options)
    assert done.returncode == 3
    assert done.stdout.splitlines()[-1] == f"next: vislam2tag inspect {surveys / 'excluded'}"


def test_outputs_without_a_table_are_not_called_the_same(surveys: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        vislam2tag("-q", "process", surveys / "excluded", "--out", tmp_path / name)
    assert "nothing to compare" in the_error(vislam2tag("verify", tmp_path / "a", tmp_path / "b"))


def test_landmarks_of_no_session_are_no_success(surveys: Path, tmp_path: Path) -> None:
    done = vislam2tag("-q", "survey-landmarks", surveys / "excluded", "--out", tmp_path / "landmarks.csv")
    assert done.returncode == 3
    assert done.stdout.splitlines()[-1].startswith("next: vislam2tag inspect")


def test_a_fleet_of_excluded_sessions_is_no_success(surveys: Path, tmp_path: Path) -> None:
    assert vislam2tag("-q", "fleet", "add", tmp_path / "fleet", surveys / "excluded").returncode == 0
    for options in ((), ("--dry-run",)):
        done = vislam2tag("-q", "fleet", "process", tmp_path / "fleet", *options)
        assert done.returncode == (3 if options else 1)
        assert done.stdout.splitlines()[-1] == f"next: vislam2tag fleet list {tmp_path / 'fleet'}"


def test_a_set_without_positions_is_not_trained_on(surveys: Path, tmp_path: Path) -> None:
    made = vislam2tag("-q", "dataset", surveys / "unsurveyed", "--out", tmp_path / "set", "--jobs", "1")
    assert made.returncode == 3
    assert "train" not in made.stdout.splitlines()[-1]
    for command in (("split", tmp_path / "set"), ("figures", tmp_path / "set", "--out", tmp_path / "figures")):
        done = vislam2tag("-q", *command)
        assert done.returncode == 3, command
        assert done.stdout.splitlines()[-1].startswith(f"next: open {tmp_path / 'set' / 'report.html'}")
    plain, again = tmp_path / "plain", tmp_path / "again"
    assert vislam2tag("-q", "export", tmp_path / "set", "--format", "parquet", "--out", plain).returncode == 0
    taken = vislam2tag("-q", "import", plain, "--out", again)
    assert (open_dataset(again).labelled, taken.returncode) == (0, 3)
    assert taken.stdout.splitlines()[-1].startswith(f"next: open {again / 'report.html'}")


@pytest.mark.parametrize("command", ["check", "diagnose"])
def test_a_moved_landmark_is_an_answer_with_its_exit_code(command: str, surveys: Path, tmp_path: Path) -> None:
    own = shutil.copytree(surveys / "sound", tmp_path / "survey")
    table = own / "floor_0" / "marker_dict.csv"
    head, *rows = table.read_text().splitlines()
    columns = head.split(",")
    moved = []
    for row in rows:
        values = dict(zip(columns, row.split(","), strict=True))
        values["x"] = str(float(values["x"]) + (4.0 if values["id"] == "5" else 0.0))
        moved.append(",".join(values[name] for name in columns))
    table.write_text("\n".join([head, *moved]) + "\n")
    code, judgement = answer_of(command, own)
    assert (code, judgement["answer"]) == (1, "wrong")
    said = vislam2tag("-q", command, own, "--jobs", "1")
    assert said.returncode == 1
    assert said.stdout.splitlines()[-1].startswith(("next: vislam2tag diagnose", "next: correct the problems above"))


def test_what_is_wrong_with_a_site_is_an_exit_code(
    surveys: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = shutil.copytree(surveys / "sound", tmp_path / "survey")
    (own / "floor_0" / "floorplan.jpg").write_bytes(b"not a picture")
    lone = CliRunner().invoke(app, ["site", "show", str(own)])
    assert "site files: could not be judged" not in lone.output
    assert "site files: nothing is wrong, 2 warnings (looked at: " in lone.output
    assert lone.exit_code == 0
    lock(monkeypatch, own / "floor_0" / "marker_dict.csv")
    for options in ((), ("--json",)):
        done = CliRunner().invoke(app, ["site", "show", str(own), *options])
        assert done.exit_code == 1, done.output
    assert json.loads(done.stdout)["judgement"]["answer"] == "wrong"


def test_a_site_without_plans_says_what_could_not_be_judged(tmp_path: Path, surveys: Path) -> None:
    sound = vislam2tag("site", "show", surveys / "sound")
    assert "site files: nothing is wrong (looked at: 1 floor, 1 plan, 12 landmarks)" in sound.stdout
    assert json.loads(vislam2tag("site", "show", surveys / "sound", "--json").stdout)["judgement"]["answer"] == (
        "nothing_wrong"
    )
    (tmp_path / "site" / "floor_1").mkdir(parents=True)
    bare = vislam2tag("site", "show", tmp_path / "site")
    assert "positions of its landmarks could not be checked" in bare.stdout
    assert "vislam2tag plan" not in bare.stdout.splitlines()[-1]
