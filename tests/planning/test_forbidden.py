"""Rectangles without landmarks."""

from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import SurveyError
from vislam2tag.planning.forbidden import read_forbidden


def test_rectangles_are_read_by_floor(tmp_path: Path) -> None:
    path = tmp_path / "glass.csv"
    path.write_text("floor,x0,y0,x1,y1\n2,0,1,5.5,2\n\n-1,3,3,4,4\n2,7,7,8,8\n")
    found = read_forbidden(path)
    assert list(found) == [-1, 2]
    assert found[2].tolist() == [[0, 1, 5.5, 2], [7, 7, 8, 8]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("floor,x,y\n1,2,3\n", r"glass.csv: the first line must be: floor,x0,y0,x1,y1"),
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
