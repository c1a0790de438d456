"""Files of a site that a plan reads and adds to."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vislam2tag.common.errors import SurveyError
from vislam2tag.preparation.planning.records import PlannedLandmark, marker_text, read_forbidden
from vislam2tag.site.landmark_file import landmarks_from, read_landmark_file


def test_rectangles_are_read_by_floor(tmp_path: Path) -> None:
    path = tmp_path / "glass.csv"
    path.write_text("floor,x0,y0,x1,y1\n2,0,1,5.5,2\n\n-1,3,3,4,4\n2,7,7,8,8\n")
    found = read_forbidden(path)
    assert list(found) == [-1, 2]
    assert found[2].tolist() == [[0, 1, 5.5, 2], [7, 7, 8, 8]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("floor,x,y\n1,2,3\n", r"glass.csv: the first line must be floor,x0,y0,x1,y1"),
        ("floor,x0,y0,x1,y1\n1,0,0,1,1\n1,2,3\n", r"glass.csv:3: expected a floor's number and four numbers"),
        ("floor,x0,y0,x1,y1\nup,0,0,1,1\n", r"glass.csv:2: expected"),
        ("floor,x0,y0,x1,y1\n1,0,0,1,inf\n", r"glass.csv:2: expected"),
    ],
)
def test_what_cannot_be_used_is_told_by_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "glass.csv"
    path.write_text(text)
    with pytest.raises(SurveyError, match=message):
        read_forbidden(path)


def test_a_file_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="cannot be opened"):
        read_forbidden(tmp_path / "none.csv")


NEW = [
    PlannedLandmark(
        id=name, floor=1, x_m=x, y_m=2.5, z_m=1.4, heading_rad=0.5, sheet="A4", width_m=0.19, pass_m=0.4, visible_m=3.0
    )
    for name, x in (("7", 1.25), ("9", 8.0))
]


@pytest.mark.parametrize(
    "before",
    [
        "",
        "id,x,y\n1,4.0,5.0\n2,,\n",
        "marker;x\r\n",
        "\ufeffid,x,y,floor,note\r\n 01 ,4,5,1,beside the door\r\n2,6,7,1,",
        "id,y,x,z,sigma_m,heading_rad,heading_sigma_rad\n1,5.0,4.0,1.3,0.01,1.5,0.02\n",
    ],
)
def test_what_was_there_stays_to_the_letter_and_the_new_ones_are_read_back(before: str, tmp_path: Path) -> None:
    after = marker_text(before, NEW)
    old = before.splitlines()
    assert after.splitlines()[1 : len(old)] == old[1:]
    assert not old or after.splitlines()[0].startswith(old[0])
    folder = tmp_path / "floor_1"
    folder.mkdir()
    (folder / "marker_dict.csv").write_bytes(after.encode())
    if ";" in before:
        return
    rows, findings = read_landmark_file(tmp_path, folder, 1, 0.02, set())
    # without a file of states they look like those of a survey of 0.2
    assert [finding.kind for finding in findings] == ["perhaps_planned"]
    found = landmarks_from(rows)
    assert found.ids[-2:] == ("7", "9")
    assert found.position_bcs[-2:].tolist() == [[1.25, 2.5], [8.0, 2.5]]
    assert found.covariance_bcs[-1, 0, 0] == pytest.approx(0.1**2)
    assert found.heading_rad[-1] == 0.5
    if len(found.ids) > 2:
        assert found.position_bcs[0].tolist() == [4.0, 5.0]
        assert found.covariance_bcs[0, 0, 0] in (pytest.approx(0.02**2), pytest.approx(0.01**2))


def test_sheets_of_the_site_are_those_planned() -> None:
    text = marker_text("id,x,y,sheet\n1,4.0,5.0,A3\n", NEW[:1])
    assert text.splitlines()[0].endswith("heading_sigma_rad,width_m")
    assert text.splitlines()[2] == "7,1.25,2.5,A4,1.4,0.1,0.5,0.05,0.19"


def test_adding_twice_is_adding_both() -> None:
    once = marker_text("id,x,y\n1,4.0,5.0\n", NEW[:1])
    assert marker_text(once, NEW[1:]) == marker_text("id,x,y\n1,4.0,5.0\n", NEW)
    assert np.array_equal(once.splitlines()[0].split(",")[:3], ["id", "x", "y"])
