"""A studio as files shows nothing that links lead to outside the survey."""

from __future__ import annotations

import json
from collections.abc import Iterable
from contextlib import closing
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.linked import link_plan, move_out, private_pictures, survey_beside_private
from vislam2tag.common.errors import SurveyError
from vislam2tag.common.findings import Finding
from vislam2tag.pipeline.fleet.add import add_surveys
from vislam2tag.pipeline.fleet.process import process_fleet
from vislam2tag.pipeline.labels.process import process
from vislam2tag.settings import Settings
from vislam2tag.studio.export import ExportRecord, export_survey
from vislam2tag.studio.workspace import Workspace


@pytest.fixture
def survey(tmp_path: Path) -> Path:
    """A survey of two walks with labels, and a private picture beside it."""
    survey = survey_beside_private(tmp_path)
    process(survey, tmp_path / "survey-labels")
    return survey


def exported(survey: Path, out: Path, heard: list[Finding], *, follow_links: bool = False) -> ExportRecord:
    with closing(Workspace(survey, survey.with_name("survey-labels"), Settings())) as workspace:
        return export_survey(workspace, out, follow_links=follow_links, tell=heard.extend)


def texts_of(folder: Path) -> str:
    return "\n".join(path.read_text() for path in sorted(folder.rglob("*.json")))


def messages(heard: Iterable[Finding]) -> str:
    return "\n".join(finding.message for finding in heard)


def test_a_plan_from_outside_is_not_published(survey: Path, tmp_path: Path) -> None:
    link_plan(survey)
    done = vislam2tag("studio", survey, "--export", tmp_path / "page")
    assert done.returncode == 0, done.stderr
    assert private_pictures(tmp_path / "page") == []
    assert "floor_0/floorplan.png; pass --follow-links" in done.stderr
    assert json.loads((tmp_path / "page" / "export.json").read_text())["left_out"] == 1
    done = vislam2tag("studio", survey, "--export", tmp_path / "followed", "--follow-links")
    assert done.returncode == 0, done.stderr
    assert private_pictures(tmp_path / "followed") == ["followed/data/plans/0.png"]


def test_sessions_and_landmarks_from_outside_are_not_published(survey: Path, tmp_path: Path) -> None:
    first, second = sorted((survey / "floor_0" / "LG").iterdir())
    move_out(first / "wifi.csv", tmp_path / "wifi.csv")
    move_out(survey / "floor_0" / "marker_dict.csv", tmp_path / "marks.csv")
    heard: list[Finding] = []
    record = exported(survey, tmp_path / "page", heard)
    assert (record.sessions, record.left_out) == (1, 2)
    texts = texts_of(tmp_path / "page")
    assert first.name not in texts
    assert first.name.replace(":", "") not in texts
    assert second.name in texts
    assert json.loads((tmp_path / "page" / "data" / "survey.json").read_text())["landmarks"] == []
    assert first.name.replace(":", "") in messages(heard)
    assert "floor_0/marker_dict.csv" in messages(heard)
    whole = exported(survey, tmp_path / "whole", heard, follow_links=True)
    assert (whole.sessions, whole.left_out) == (2, 0)


@pytest.mark.parametrize("moved", ["floor_0/LG", "corrections.toml"])
def test_nothing_is_written_where_nothing_remains(survey: Path, tmp_path: Path, moved: str) -> None:
    (survey / "corrections.toml").touch()
    move_out(survey / moved, tmp_path / "moved")
    message = the_error(vislam2tag("studio", survey, "--export", tmp_path / "page"))
    assert "--follow-links" in message
    assert not (tmp_path / "page").exists()


def test_labels_with_links_are_not_published(survey: Path, tmp_path: Path) -> None:
    move_out(survey.with_name("survey-labels") / "trajectory", tmp_path / "moved")
    with pytest.raises(SurveyError, match="--follow-links"):
        exported(survey, tmp_path / "page", [])


def test_labels_of_a_session_that_was_outside_stay_private(survey: Path, tmp_path: Path) -> None:
    first = min((survey / "floor_0" / "LG").iterdir())
    move_out(first / "wifi.csv", tmp_path / "wifi.csv")
    process(survey, survey.with_name("survey-labels"))
    (first / "wifi.csv").unlink()
    (tmp_path / "wifi.csv").rename(first / "wifi.csv")
    assert exported(survey, tmp_path / "page", []).sessions == 2
    sessions = json.loads((tmp_path / "page" / "data" / "sessions.json").read_text())["sessions"]
    assert sum(bool(one["labelled_share"]) for one in sessions) == 1


def test_a_fleet_publishes_no_plan_from_outside(survey: Path, tmp_path: Path) -> None:
    fleet = tmp_path / "fleet"
    add_surveys(fleet, survey)
    link_plan(fleet / "surveys" / "survey")
    (fleet / "surveys" / "private.png").write_bytes((tmp_path / "private.png").read_bytes())
    process_fleet(fleet)
    assert private_pictures(fleet / "report") == []
    assert private_pictures(fleet / "labels") == []
    done = vislam2tag("studio", fleet, "--export", tmp_path / "page")
    assert done.returncode == 0, done.stderr
    assert private_pictures(tmp_path / "page") == []
    assert "floor_0/floorplan.png" in done.stderr
