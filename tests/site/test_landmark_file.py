"""One landmark file for all floors, in place of the floors' own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.site.site import write_survey
from vislam2tag.common.errors import SurveyError
from vislam2tag.sessions.registry import open_survey

HEADER = "id,x,y,z,floor,sigma_m,heading_rad,heading_sigma_rad\n"


def completed(folder: Path, text: str) -> Path:
    path = folder / "completed.csv"
    path.write_text(text)
    return path


def test_it_replaces_the_floors_files_with_all_its_columns(tmp_path: Path) -> None:
    root = write_survey(tmp_path / "survey", {"floor_4/marker_dict.csv": None})
    file = completed(tmp_path, HEADER + "10,1.25,2,1.5,1,0.04,0.5,0.1\n10,9,8,,4,,,\n12,,,,4,,,\n")
    survey = open_survey(root, 0.05, file)
    marks = survey.site.landmarks
    assert survey.findings == ()
    assert list(zip(marks.floor.tolist(), marks.ids, strict=True)) == [(1, "10"), (4, "10"), (4, "12")]
    assert marks.position_bcs[:2].tolist() == [[1.25, 2.0], [9.0, 8.0]]
    np.testing.assert_allclose(marks.covariance_bcs[:, 0, 0], [0.04**2, 0.05**2, np.inf])
    np.testing.assert_array_equal(marks.z_m, [1.5, np.nan, np.nan])
    np.testing.assert_array_equal(marks.heading_rad, [0.5, np.nan, np.nan])
    assert marks.surveyed.tolist() == [True, True, False]
    assert marks.source == ("completed.csv:2", "completed.csv:3", "completed.csv:4")


def test_one_floor_needs_no_column_floor(tmp_path: Path) -> None:
    root = tmp_path / "survey"
    (write_survey(root) / "floor_4").rename(tmp_path / "elsewhere")
    marks = open_survey(root, landmark_file=completed(tmp_path, "id,x,y\n3,1,2\n")).site.landmarks
    assert (marks.ids, marks.floor.tolist()) == (("3",), [1])


def test_rows_that_cannot_be_used_are_findings_at_their_lines(tmp_path: Path) -> None:
    file = completed(tmp_path, "id,x,y,floor\n1,1,1,1\n2,1,1,\n3,1,1,one\n1,5,5,1\n4,1,inf,4\n")
    survey = open_survey(write_survey(tmp_path / "survey"), landmark_file=file)
    assert {(finding.kind, finding.file): finding.lines for finding in survey.findings} == {
        ("malformed_lines", "completed.csv"): (3, 4),
        ("duplicate_landmarks", "completed.csv"): (5,),
        ("non_finite_values", "completed.csv"): (6,),
    }
    assert survey.site.landmarks.ids == ("1",)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, r"completed\.csv: cannot be opened \(No such file or directory\); expected a landmark file"),
        ("", r"completed\.csv: the first line must be: id,x,y .*; it lacks x and y and is: empty"),
        ("id,x,y\n1,1,1\n", r"completed\.csv: there is no column floor, which .* several floors needs"),
        (HEADER, r"completed\.csv: holds no usable landmark of the survey's floors \(1, 4\)"),
        ("id,x,y,floor\n1,1,1,7\n2,a,b,1\n", r"holds no usable landmark of the survey's floors \(1, 4\)"),
    ],
)
def test_a_file_that_cannot_serve_is_refused(tmp_path: Path, text: str | None, message: str) -> None:
    file = tmp_path / "completed.csv" if text is None else completed(tmp_path, text)
    with pytest.raises(SurveyError, match=message):
        open_survey(write_survey(tmp_path / "survey"), landmark_file=file)
