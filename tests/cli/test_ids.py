"""Surveys whose landmarks are only planned, or whose ids are not those of the table, from the command line."""

from __future__ import annotations

import json
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
    assert "next: correct the problems above" in found["diagnose"][1]


@pytest.mark.parametrize(
    ("name", "pattern"),
    [
        (lambda number: f"LM{number:02d}", "other prefix or suffix"),
        (lambda number: f"{chr(96 + number)}x", "no simple pattern maps one set to the other"),
    ],
)
def test_ids_of_another_kind_are_named(clean: Path, tmp_path: Path, name: Callable[[int], str], pattern: str) -> None:
    survey = renamed(clean, tmp_path / "survey", name)
    found = said(survey, tmp_path / "out")
    assert [code for code, _ in found.values()] == [1, 3, 1]
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
    assert [found[command][0] for command in ("inspect", "process", "diagnose")] == [1, 3, 1]
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
    assert (
        vislam2tag(
            "plan", survey, "--out", tmp_path / "more", "--further", "0", "--write", "--ignore-existing"
        ).returncode
        == 0
    )
    found = said(
        survey,
        tmp_path / "out",
    )
    assert found["inspect"][0] == found["process"][0] == 0, "measured ones are used"
    assert "nothing is wrong" in found["diagnose"][1], "no walk saw the planned ones"


def planned_survey(clean: Path, to: Path) -> Path:
    """A copy whose landmarks are only planned: their sheets hang 1.5 m away."""
    shutil.copytree(clean, to)
    (table,) = to.glob("floor_*/marker_dict.csv")
    _, *rows = table.read_text().splitlines()
    at = [(name, f"{float(x) + 1.5:.3f}", f"{float(y):.3f}") for name, x, y in (row.split(",") for row in rows)]
    table.write_text("id,x,y,sigma_m\n" + "".join(f"{name},{x},{y},0.1\n" for name, x, y in at))
    states = "".join(f"{name},planned,plan,{x},{y}\n" for name, x, y in at)
    (table.parent / "landmark_states.csv").write_text("id,state,source,x,y\n" + states)
    return to


def test_a_copy_of_the_planned_table_is_no_survey_of_it(clean: Path, tmp_path: Path) -> None:
    survey = planned_survey(clean, tmp_path / "survey")
    (table,) = survey.glob("floor_*/marker_dict.csv")
    shutil.copy(table, tmp_path / "copy.csv")
    table.write_text("id,x,y\n")
    command = ("process", survey, "--out", tmp_path / "out", "--jobs", "1", "--landmarks", tmp_path / "copy.csv")
    done = vislam2tag(*command)
    assert done.returncode == 3
    assert "frames labelled: 0.0 %" in done.stdout
    assert "planned_landmarks" in done.stdout


def test_planned_landmarks_are_counted_once_and_are_not_corrected_by_diagnose(clean: Path, tmp_path: Path) -> None:
    survey = planned_survey(clean, tmp_path / "survey")
    (table,) = survey.glob("floor_*/marker_dict.csv")
    done = vislam2tag("run", survey, "--out", tmp_path / "out", "--jobs", "1")
    assert done.returncode == 3
    assert "wrong: the positions of landmarks" in done.stdout
    assert done.stdout.splitlines()[-1] == f"next: vislam2tag diagnose {survey}"
    summary = json.loads((tmp_path / "out/labels/summary.json").read_text())
    assert summary["site_findings"]["planned_landmarks"] == len(table.read_text().splitlines()) - 1
    assert (
        vislam2tag("diagnose", survey, "--jobs", "1").stdout.splitlines()[-1].startswith("next: correct the problems")
    )


def test_inspect_uses_planned_positions_if_the_survey_says_so(clean: Path, tmp_path: Path) -> None:
    survey = planned_survey(clean, tmp_path / "survey")
    assert vislam2tag("inspect", survey).returncode == 1
    assert vislam2tag("inspect", survey, "--use-planned").returncode == 0
    (survey / "vislam2tag.toml").write_text("survey.use_planned = true\n")
    done = vislam2tag("inspect", survey)
    assert done.returncode == 0
    assert "they are used as if measured" in done.stdout
    assert "they are not used" not in done.stdout
