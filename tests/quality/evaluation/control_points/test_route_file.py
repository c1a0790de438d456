from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import SurveyError
from vislam2tag.quality.evaluation.control_points.route_file import ROUTE_FILE, read_route

IDS = ("0", "1", "2")


@pytest.fixture
def session(tmp_path: Path) -> Path:
    folder = tmp_path / "floor_1" / "LG" / "a"
    folder.mkdir(parents=True)
    return folder


def test_the_sessions_route_counts_before_the_floors(tmp_path: Path, session: Path) -> None:
    assert read_route(tmp_path, session, IDS) is None
    (tmp_path / "floor_1" / ROUTE_FILE).write_text("point\n0\n1\n")
    found = read_route(tmp_path, session, IDS)
    assert found is not None
    assert found.tolist() == [0, 1]
    (session / ROUTE_FILE).write_text("\ufeffPoint\n2\n\n1\n2\n")
    found = read_route(tmp_path, session, IDS)
    assert found is not None
    assert found.tolist() == [2, 1, 2]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "expected the header 'point'"),
        ("0\n1\n", "expected the header 'point'"),
        ("point\n", "expected the header 'point'"),
        (
            "point\n0\n7\n",
            r"route\.csv:3: there is no control point '7' on this floor: refmarker.csv has 3 ids \(0, 1, 2\)",
        ),
    ],
)
def test_a_wrong_route_is_refused(tmp_path: Path, session: Path, content: str, message: str) -> None:
    (session / ROUTE_FILE).write_text(content)
    with pytest.raises(SurveyError, match=message):
        read_route(tmp_path, session, IDS)
