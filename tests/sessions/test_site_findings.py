"""Presses and control points belong together."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.surveys import make_survey
from vislam2tag.sessions.registry import open_survey, read_session
from vislam2tag.sessions.site_findings import press_findings


@pytest.fixture(scope="module")
def survey(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_survey(tmp_path_factory.mktemp("presses") / "survey", devices=("LG",), seconds=20.0)


def kinds(root: Path, presses: str | None, points: str | None) -> list[str]:
    opened = open_survey(root)
    folder = opened.sessions[0].folder
    for file, text in ((folder / "refMarker.csv", presses), (folder.parents[1] / "refmarker.csv", points)):
        file.unlink(missing_ok=True)
        if text is not None:
            file.write_text(text)
    opened = open_survey(root)
    session = read_session(opened.sessions[0])
    return [finding.kind for finding in press_findings(session, opened.site.floors[0])]


@pytest.mark.parametrize(
    ("presses", "points", "expected"),
    [
        (None, None, []),
        ("0; 5\n", "1.0,2.0\n", []),
        ("0; 5\n1; 6\n", None, ["missing_control_points"]),
        (None, "1.0,2.0\n", ["missing_file"]),
        ("", "1.0,2.0\n", []),
    ],
)
def test_one_without_the_other_is_a_finding(
    survey: Path, presses: str | None, points: str | None, expected: list[str]
) -> None:
    assert kinds(survey, presses, points) == expected
