from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.cli.command import vislam2tag
from tests.locks import lock
from tests.site.site import write_survey
from vislam2tag.cli.app import app
from vislam2tag.common.errors import SurveyError


def test_tables_and_findings_of_a_survey(tmp_path: Path) -> None:
    write_survey(tmp_path, {"floor_1/floorplan.jpg": None})
    with (tmp_path / "floor_1/One Plus/walk/sensors.csv").open("a") as file:
        file.write("cut o")
    result = CliRunner().invoke(app, ["inspect", str(tmp_path)])
    assert result.exit_code == 0, result.output
    for text in ("60 m x 32.5 m", "none (metric grid)", "One Plus", "2 of 2 surveyed", "30.0 Hz"):
        assert text in result.output
    assert "partial_last_line sensors.csv lines 301: the last line is cut off" in result.output
    assert "missing_control_points 3 x floor 4 has no control points" in result.output
    assert "sessions: 3, findings: 6\n" in result.output
    assert "nothing is wrong, 1 warning (looked at: the site's files and 3 sessions, not mapped)\n" in result.output
    assert "next: vislam2tag run " in result.output


def test_json_is_one_document(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["inspect", str(write_survey(tmp_path)), "--json"])
    document = json.loads(result.stdout)
    assert result.exit_code == 0
    assert [session["frames"] for session in document["sessions"]] == [60, 60, 60]
    assert document["findings"] == []


def test_a_session_without_poses_is_exit_code_1(tmp_path: Path) -> None:
    write_survey(tmp_path)
    (tmp_path / "floor_1/LG/2022-01-14T16:35:30/poses.csv").unlink()
    result = CliRunner().invoke(app, ["inspect", str(tmp_path)])
    assert result.exit_code == 1
    assert "no camera poses" in result.output


def test_a_folder_that_is_no_survey_raises_our_error(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="not a survey"):
        CliRunner().invoke(app, ["inspect", str(tmp_path)], catch_exceptions=False)


def test_warnings_make_nothing_wrong_and_errors_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = write_survey(tmp_path)
    path = root / "floor_1/One Plus/walk/sensors.csv"
    path.write_text(path.read_text() + "not a row\n")
    warned = CliRunner().invoke(app, ["inspect", str(root), "--json"])
    judgement = json.loads(warned.stdout)["judgement"]
    assert (warned.exit_code, judgement["answer"], judgement["warnings"]) == (0, "nothing_wrong", 1)
    (root / "floor_4/refmarker.csv").write_text("id,x,y\n1,1,1\n")
    lock(monkeypatch, root / "floor_4/refmarker.csv")
    wrong = CliRunner().invoke(app, ["inspect", str(root)])
    assert "unreadable_file floor_4/refmarker.csv" in wrong.output
    assert "something is wrong, 1 warning (looked at: " in wrong.output
    assert wrong.exit_code == 1
    assert "next: correct what is named above" in wrong.output


def test_a_header_that_cannot_be_understood_is_told_and_its_walks_lack_landmarks(tmp_path: Path) -> None:
    root = write_survey(tmp_path / "survey", {"floor_1/marker_dict.csv": "\nmarke,links,oben\n10,1,2\n7,3,4\n"})
    done = vislam2tag("inspect", root)
    assert done.returncode == 1
    assert "floor_1/marker_dict.csv" in done.stdout
    assert "the first line must be: id,x,y (then optional columns" in done.stdout
    assert "it lacks x and y and is: id,links,oben" in done.stdout
    done = vislam2tag("process", root, "--out", tmp_path / "out", "--jobs", "1")
    assert "warning: floor_1/marker_dict.csv:2: the first line must be: id,x,y" in done.stderr
