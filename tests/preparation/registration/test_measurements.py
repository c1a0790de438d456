from __future__ import annotations

from pathlib import Path

import pytest

from tests.site.site import write_survey
from vislam2tag.common.errors import SurveyError, UsageError
from vislam2tag.preparation.registration.names import NameRules
from vislam2tag.preparation.registration.network import KNOWN_HEIGHT
from vislam2tag.preparation.registration.record import RegistrationSettings
from vislam2tag.preparation.registration.register import known_points_of_site, read_known_points, read_stations
from vislam2tag.site.discover import read_site

SETTINGS, RULES = RegistrationSettings(), NameRules(landmarks="LM*")


def test_a_file_is_a_station_unless_a_column_says_so(tmp_path: Path) -> None:
    (tmp_path / "S1.csv").write_text("Point,E,N,H,Code\nLM7,1,2,3,M\nK,1,1,,F\n")
    (tmp_path / "S2.csv").write_text("Station;Point;E;N\nA;LM7;1,5;2\nB;LM8;3;4\n")
    shots, heights, _ = read_stations([tmp_path / "S1.csv", tmp_path / "S2.csv"], None, (), RULES, SETTINGS)
    assert [(one.station, one.point) for one in shots] == [("S1", "7"), ("S1", "tie K"), ("A", "7"), ("B", "8")]
    assert [(one.point, one.station, one.height_m) for one in heights] == [("7", "S1", 3)]


def test_other_codes_are_left_out_and_counted(tmp_path: Path) -> None:
    (tmp_path / "S1.csv").write_text("Point,E,N,H,Code\nLM7,1,2,3,M\nK,1,1,,F\n")
    shots, _, (finding,) = read_stations([tmp_path / "S1.csv"], None, ("M",), RULES, SETTINGS)
    assert [one.point for one in shots] == ["7"]
    assert (finding.kind, finding.lines) == ("other_code", (3,))


def test_two_files_of_one_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match="another file has the same name"):
        read_stations([tmp_path / "a/S1.csv", tmp_path / "b/S1.txt"], None, (), RULES, SETTINGS)


def test_known_points_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "known.csv"
    path.write_text("name,x,y,z,sigma_m\nA,1,2,0.5,0.001\nLM7,3,4,,\n")
    known, heights, _ = read_known_points(path, RULES, SETTINGS)
    assert [(one.point, one.place, one.sigma_m) for one in known] == [
        ("tie A", 1 + 2j, 0.001),
        ("7", 3 + 4j, SETTINGS.control_sigma_m),
    ]
    assert [(one.point, one.station, one.height_m) for one in heights] == [("tie A", KNOWN_HEIGHT, 0.5)]
    path.write_text("name,x,y\nLM7,1,2\nLM07,3,4\n")
    with pytest.raises(SurveyError, match=r"known\.csv:3: known point LM07 is there twice \(first: known\.csv:2\)"):
        read_known_points(path, RULES, SETTINGS)


def test_known_points_of_the_site(tmp_path: Path) -> None:
    site, _ = read_site(write_survey(tmp_path))
    known, _ = known_points_of_site(site, 1, ["all"], RULES, SETTINGS)
    assert {one.point: one.place for one in known} == {
        "10": 1.5 + 2.5j,
        "7": 30 + 4j,
        "control point 0": 1 + 2j,
        "control point 1": 3.5 + 4j,
    }
    chosen, _ = known_points_of_site(site, 1, ["LM7", "CP1"], RULES, SETTINGS)
    assert [one.point for one in chosen] == ["7", "control point 1"]
    with pytest.raises(UsageError, match="--known 99: floor 1 has no measured position of it"):
        known_points_of_site(site, 1, ["LM99"], RULES, SETTINGS)
