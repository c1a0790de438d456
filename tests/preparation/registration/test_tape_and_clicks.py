from __future__ import annotations

import math
from pathlib import Path

import pytest

from vislam2tag.common.errors import SurveyError
from vislam2tag.preparation.registration.record import RegistrationSettings
from vislam2tag.preparation.registration.tape_and_clicks import (
    HEADER,
    Target,
    click_sigma_m,
    read_clicks,
    read_distances,
    read_targets,
)

SETTINGS = RegistrationSettings()


def test_distances_with_and_without_header_and_sigma(tmp_path: Path) -> None:
    path = tmp_path / "tape.csv"
    path.write_text("Landmarke;nach;Strecke;sigma\n7;Ecke 1;3,25;\n7;8;12,5;0,05\n")
    found, findings = read_distances(path, SETTINGS)
    assert [(one.landmark, one.to, one.distance_m, one.sigma_m, one.decimals) for one in found] == [
        ("7", "Ecke 1", 3.25, SETTINGS.tape_sigma_m, 2),
        ("7", "8", 12.5, 0.05, 1),
    ]
    assert findings == []
    path.write_text("7,c1,3.25\n")
    assert len(read_distances(path, SETTINGS)[0]) == 1


def test_bad_distances_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "tape.csv"
    path.write_text("landmark,to,distance_m\n7,c1,3.25\n7,c2\n7,7,1.0\n7,c3,-1\n7,c4,999\n,c1,1\n7,c2,far\n")
    found, (finding,) = read_distances(path, SETTINGS)
    assert len(found) == 1
    assert (finding.kind, finding.count, finding.lines) == ("malformed_lines", 6, (3, 4, 5, 6, 7))
    path.write_text("landmark,to,distance_m\n")
    with pytest.raises(SurveyError, match=r"tape\.csv: contains no distance; expected rows"):
        read_distances(path, SETTINGS)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("landmark,to,distance_m\n1,south,1230\n", r"tape\.csv: line 2: 1230 m is too long for a tape; expected dist"),
        ("landmark,to,distance_m\n1,south,12,30\n", r"tape\.csv:2: 4 values under 3 columns; with decimal commas, sep"),
        ("1,south,12,30\n1,west,4,5\n", r"tape\.csv: contains no distance"),
    ],
)
def test_other_units_and_decimal_commas_are_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "tape.csv"
    path.write_text(text)
    with pytest.raises(SurveyError, match=message):
        read_distances(path, SETTINGS)


def test_points_and_walls(tmp_path: Path) -> None:
    path = tmp_path / "walls.csv"
    path.write_text("name,x,y,x2,y2,sigma_m\nc1,1,2,,,\nwest,0,0,0,8,0.01\n")
    found, findings = read_targets(path, SETTINGS)
    assert found == {
        "c1": Target("c1", 1 + 2j, None, SETTINGS.target_sigma_m),
        "west": Target("west", 0j, 8j, 0.01),
    }
    assert findings == []
    path.write_text("c1,1,2\nc2,3,4,0.1\nw,0,0,5,0\n")
    found, _ = read_targets(path, SETTINGS)
    assert [(one.stop, one.sigma_m) for one in found.values()] == [(None, 0.03), (None, 0.1), (5 + 0j, 0.03)]


def test_bad_targets_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "walls.csv"
    path.write_text("name,x,y\nc1,1,2\nc1,3,4\nw,5,5,5,5\nv,1,1,2\nu,1,1,2,,\n")
    found, findings = read_targets(path, SETTINGS)
    assert list(found) == ["c1", "v"]
    assert {one.kind: one.lines for one in findings} == {"malformed_lines": (4, 6), "duplicate_targets": (3,)}


def test_targets_with_decimal_commas_are_refused_or_read(tmp_path: Path) -> None:
    path = tmp_path / "targets.csv"
    path.write_text("name,x,y\nK1,0,5,1,5\nK2,10,5,0,5\n")
    with pytest.raises(SurveyError, match=r"targets\.csv:2: 5 values under 3 columns; with decimal commas"):
        read_targets(path, SETTINGS)
    path.write_text('name,x,y\nK1,"0,5","1,5"\n')
    assert read_targets(path, SETTINGS)[0]["K1"].start == 0.5 + 1.5j


def test_clicks_of_the_floor_with_their_sigma(tmp_path: Path) -> None:
    path = tmp_path / "clicks.csv"
    path.write_text(
        ",".join(HEADER) + "\n7,1,2.5,3.5,0.05,0.02\n8,2,1,1,0.05,0.02\n9,1,x,1,1,1\n7,1,2.6,3.5,0.05,0.02\n"
    )
    clicks, findings = read_clicks(path, 1, SETTINGS)
    assert clicks["7"].place == 2.6 + 3.5j
    assert clicks["7"].sigma_m == pytest.approx(math.sqrt((2 * 0.05) ** 2 + 0.02**2 / 12 + 0.1**2))
    assert {one.kind: one.lines for one in findings} == {
        "malformed_lines": (4,),
        "duplicate_landmarks": (5,),
        "other_floor": (3,),
    }


def test_another_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "clicks.csv"
    path.write_text("id,x,y\n7,1,2\n")
    with pytest.raises(SurveyError, match=r"clicks\.csv:1: expected the header id,floor,x,y"):
        read_clicks(path, 1, SETTINGS)


def test_zooming_in_makes_clicks_surer_but_not_surer_than_the_plan() -> None:
    assert click_sigma_m(0.2, 0.05, SETTINGS) > click_sigma_m(0.02, 0.05, SETTINGS) > SETTINGS.plan_sigma_m


def test_distances_and_walls_may_be_in_other_units(tmp_path: Path) -> None:
    (tmp_path / "tape.csv").write_text("landmark,to,distance [cm],sigma_mm\n1,south,1250,20\n2,south,13 m,20\n")
    found, _ = read_distances(tmp_path / "tape.csv", RegistrationSettings())
    assert [(one.distance_m, one.sigma_m) for one in found] == [(12.5, 0.02), (13.0, 0.02)]
    (tmp_path / "walls.csv").write_text("name;x;y;x2;y2\n;m;m;m;m\nsouth;0;0;1'200,5;0\n")
    targets, _ = read_targets(tmp_path / "walls.csv", RegistrationSettings())
    assert (targets["south"].start, targets["south"].stop) == (0, 1200.5)
