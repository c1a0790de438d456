"""``vislam2tag join`` as its users run it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from tests.cli.command import the_error, vislam2tag
from tests.datasets.changing import Survey, bssid, surveyed, usual_places
from tests.datasets.factory import small_dataset
from vislam2tag.datasets.folder import write_dataset

@pytest.mark.usefixtures("undrawn_figures")
def test_a_later_survey_joins(tmp_path: Path) -> None:
    places = usual_places()
    del places[8]
    write_dataset(surveyed(Survey("base")), tmp_path / "base")
    write_dataset(surveyed(Survey("later", places=places)), tmp_path / "later")
    done = vislam2tag("join", tmp_path / "base", tmp_path / "later", "--out", tmp_path / "joined")
    assert (done.returncode, done.stderr) == (0, "")
    assert bssid(8) in done.stdout
    assert "wifi: access points: 23 unchanged, 1 vanished" in done.stdout
    assert "places are worth walking again" in done.stdout
    assert vislam2tag("verify", tmp_path / "joined", tmp_path / "joined").returncode == 0


@pytest.mark.usefixtures("undrawn_figures")
def test_a_survey_of_another_building_is_doubted(tmp_path: Path) -> None:
    write_dataset(surveyed(Survey("base")), tmp_path / "base")
    others = {100 + index: place for index, place in usual_places().items()}
    write_dataset(surveyed(Survey("later", places=others)), tmp_path / "later")
    done = vislam2tag("join", tmp_path / "base", tmp_path / "later", "--out", tmp_path / "joined")
    assert done.returncode == 0
    assert "most_changed: wifi: of 48 access points 48 changed; is the later survey of the same building" in done.stdout


def test_surveys_that_cannot_be_joined(tmp_path: Path) -> None:
    write_dataset(surveyed(Survey("base")), tmp_path / "base")
    floors = tuple(floor.model_copy(update={"width_m": 80.0}) for floor in small_dataset().info.floors)
    later = replace(small_dataset(), info=small_dataset().info.model_copy(update={"floors": floors}))
    write_dataset(later, tmp_path / "later")
    done = vislam2tag("join", tmp_path / "base", tmp_path / "later", "--out", tmp_path / "joined")
    assert "floor 0: width_m is 60 in the base and 80 in the later survey" in the_error(done)
