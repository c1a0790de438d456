from __future__ import annotations

import math
from pathlib import Path

import pytest

from vislam2tag.common.errors import SurveyError
from vislam2tag.preparation.registration.record import RegistrationSettings
from vislam2tag.preparation.registration.tape_and_clicks import HEADER, click_sigma_m, read_clicks

SETTINGS = RegistrationSettings()


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
