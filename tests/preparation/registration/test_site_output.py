from __future__ import annotations

from pathlib import Path

import pytest

from vislam2tag.common.errors import OutputError, SurveyError
from vislam2tag.preparation.registration.record import PositionSource, RegisteredPoint
from vislam2tag.preparation.registration.results import control_point_text, landmark_text
from vislam2tag.site.landmark_file import read_landmark_file


def point(name: str, x_m: float, y_m: float, **further: float) -> RegisteredPoint:
    known = RegisteredPoint(
        point=name,
        x_m=x_m,
        y_m=y_m,
        sigma_m=0.003,
        covariance_m2=((9e-6, 0), (0, 9e-6)),
        source=PositionSource.STATION,
        measurements=1,
        checked=0,
    )
    return known.model_copy(update=further)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "floor_1").mkdir()
    return tmp_path / "floor_1"


def text_of(folder: Path, *points: RegisteredPoint, replace: bool = False) -> str:
    return landmark_text(folder.parent, folder, 1, points, replace=replace)


def test_a_new_file_is_read_back(folder: Path) -> None:
    text = text_of(folder, point("7", 1.5, 2.25, z_m=1.4), point("8", 3, 4, heading_rad=1.0, heading_sigma_rad=0.01))
    assert text == (
        "id,x,y,z,sigma_m,heading_rad,heading_sigma_rad\n"
        "7,1.5000,2.2500,1.4000,0.00300,,\n"
        "8,3.0000,4.0000,,0.00300,1.000000,0.010000\n"
    )
    (folder / "marker_dict.csv").write_text(text)
    rows, findings = read_landmark_file(folder.parent, folder, 1, 0.02, set())
    assert [(row.landmark, row.x_m, row.sigma_m) for row in rows] == [("7", 1.5, 0.003), ("8", 3, 0.003)]
    assert findings == []


def test_rows_and_columns_of_others_stay(folder: Path) -> None:
    (folder / "marker_dict.csv").write_text("id,x,y,heading_rad,note\n7,,,1.5,hall\nbroken,x,y\n9,5,6,,\n")
    assert text_of(folder, point("7", 1, 2), point("10", 3, 4)) == (
        "id,x,y,heading_rad,note,sigma_m\n"
        "7,1.0000,2.0000,1.5,hall,0.00300\n"
        "broken,x,y,,,\n"
        "9,5,6,,,\n"
        "10,3.0000,4.0000,,,0.00300\n"
    )


def test_other_positions_are_replaced_only_where_asked_for(folder: Path) -> None:
    (folder / "marker_dict.csv").write_text("id,x,y\n7,1,2\n8,5,6\n")
    with pytest.raises(OutputError, match=r"other positions of landmark 7 \(floor_1/marker_dict\.csv:2\); pass --rep"):
        text_of(folder, point("7", 1.1, 2), point("8", 5, 6))
    assert "7,1.1000,2.0000,0.00300\n" in text_of(folder, point("7", 1.1, 2), replace=True)
    assert "7,1.0000,2.0000,0.00300\n" in text_of(folder, point("7", 1, 2))


def test_rows_of_other_floors_are_not_touched(folder: Path) -> None:
    (folder / "marker_dict.csv").write_text("id,x,y,floor\n7,1,2,2\n")
    assert text_of(folder, point("7", 5, 6)) == "id,x,y,floor,sigma_m\n7,1,2,2,\n7,5.0000,6.0000,1,0.00300\n"


def test_a_file_that_is_no_landmark_file_is_refused(folder: Path) -> None:
    (folder / "marker_dict.csv").write_text("what,ever\n1,2\n")
    with pytest.raises(SurveyError, match="the first line must be: id,x,y"):
        text_of(folder, point("7", 1, 2))


def test_control_points_go_to_their_numbers(folder: Path) -> None:
    path = folder / "refmarker.csv"
    points = [point("1", 3, 4), point("0", 1, 2)]
    assert control_point_text(folder.parent, folder, points, replace=False) == "1.0000,2.0000\n3.0000,4.0000\n"
    path.write_text("1,2\n9,9\n")
    with pytest.raises(OutputError, match=r"another position of control point 1 \(line 2\)"):
        control_point_text(folder.parent, folder, points, replace=False)
    assert control_point_text(folder.parent, folder, points[:1], replace=True) == "1,2\n3.0000,4.0000\n"
    with pytest.raises(OutputError, match="control point 2 is missing"):
        control_point_text(folder.parent, folder, [point("3", 1, 1)], replace=True)
