"""Surveys whose landmarks are only planned, or whose ids are not those of the table, from the command line."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.command import vislam2tag
from tests.surveys import make_survey

pytestmark = pytest.mark.usefixtures("undrawn_figures")

ABOUT_IDS = ("other_ids", "shifted_ids", "planned_landmarks", "perhaps_planned")


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("ids") / "clean", seconds=90.0)


def said(survey: Path, out: Path, *options: str) -> dict[str, tuple[int, str]]:
    """Exit code and output of the commands that look at a survey."""
    commands: dict[str, tuple[str | Path, ...]] = {
        "inspect": ("inspect", survey),
        "process": ("process", survey, "--out", out, "--jobs", "1", *options),
        "diagnose": ("diagnose", survey, "--jobs", "1", *options),
    }
    done = {name: vislam2tag(*arguments) for name, arguments in commands.items()}
    return {name: (one.returncode, one.stdout + one.stderr) for name, one in done.items()}


def renamed(survey: Path, to: Path, name: Callable[[int], str]) -> Path:
    """A copy whose landmark table calls each landmark otherwise."""
    shutil.copytree(survey, to)
    (table,) = to.glob("floor_*/marker_dict.csv")
    head, *rows = table.read_text().splitlines()
    changed = [",".join((name(int(row.partition(",")[0])), row.partition(",")[2])) for row in rows]
    table.write_text("\n".join([head, *changed]) + "\n")
    return to


def test_a_clean_survey_gets_no_finding_about_ids(clean: Path, tmp_path: Path) -> None:
    for code, text in said(clean, tmp_path / "out").values():
        assert code == 0
        assert not any(kind in text for kind in ABOUT_IDS)


@pytest.mark.parametrize("by", [-1, 1])
def test_ids_shifted_by_one_are_named(clean: Path, tmp_path: Path, by: int) -> None:
    survey = renamed(clean, tmp_path / "survey", lambda number: str(number + by))
    found = said(survey, tmp_path / "out")
    assert [code for code, _ in found.values()] == [1, 1, 1]
    assert "shifted_ids" in found["inspect"][1]
    assert "shifted_ids" in found["process"][1]
    assert "logged are all shifted" in found["diagnose"][1]
    assert "nothing is wrong" not in found["diagnose"][1]
    assert "next: correct what is named above" in found["diagnose"][1]


@pytest.mark.parametrize(
    ("name", "pattern"),
    [
        (lambda number: f"LM{number:02d}", "other prefix or suffix"),
        (lambda number: f"{chr(96 + number)}x", "no single pattern maps one to the other"),
    ],
)
def test_ids_of_another_kind_are_named(clean: Path, tmp_path: Path, name: Callable[[int], str], pattern: str) -> None:
    survey = renamed(clean, tmp_path / "survey", name)
    found = said(survey, tmp_path / "out")
    assert [code for code, _ in found.values()] == [1, 1, 1]
    assert "other_ids" in found["inspect"][1]
    assert "other_ids" in found["process"][1]
    for command in ("inspect", "diagnose"):
        assert "none of them agree" in found[command][1]
        assert pattern in found[command][1]


def test_planned_positions_are_used_only_if_that_is_asked_for(clean: Path, tmp_path: Path) -> None:
    survey = tmp_path / "survey"
    shutil.copytree(clean, survey)
    (table,) = survey.glob("floor_*/marker_dict.csv")
    measured = table.read_text()
    table.unlink()
    planned = vislam2tag("plan", survey, "--out", tmp_path / "plan", "--further", "0", "--write")
    assert "as planned" in planned.stdout, planned.stderr
    assert (table.parent / "landmark_states.csv").is_file()
    ids = len(table.read_text().splitlines()) - 1
    found = said(survey, tmp_path / "out")
    assert found["inspect"][0] == found["process"][0] == found["diagnose"][0] == 1
    assert f"{ids} ({ids} planned)" in found["inspect"][1]
    assert "frames labelled: 0.0 %" in found["process"][1]
    assert "planned_landmarks" in found["process"][1]
    assert f"{ids} landmarks: {ids} planned" in found["diagnose"][1]
    assert "nothing is wrong" not in found["diagnose"][1]
    assert f"{ids} ({ids} planned)" in vislam2tag("site", "show", survey).stdout
    used = vislam2tag("process", survey, "--out", tmp_path / "used", "--jobs", "1", "--use-planned")
    assert "0 of" not in used.stdout
    assert "frames labelled: 0.0 %" not in used.stdout or "uncertain" in used.stdout

    states = table.parent / "landmark_states.csv"
    states.unlink()  # as 0.2 left it
    assert "perhaps_planned" in vislam2tag("inspect", survey).stdout

    table.write_text(measured)
    assert vislam2tag("plan", survey, "--out", tmp_path / "more", "--further", "0", "--write", "--anew").returncode == 0
    found = said(
        survey,
        tmp_path / "out",
    )
    assert found["inspect"][0] == found["process"][0] == 0, "measured ones are used"
    assert "nothing is wrong" in found["diagnose"][1], "no walk saw the planned ones"
