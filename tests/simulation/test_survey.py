from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.simulation.worlds import hashes, paper_scenario
from vislam2tag.common.errors import OutputError
from vislam2tag.sessions.registry import open_survey
from vislam2tag.simulation.scenario import Scenario, regular_survey
from vislam2tag.simulation.settings import Locale
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.site.model import SessionKey


def tiny(seed: int = 5, devices: tuple[str, ...] = ("LG", "OnePlus"), sessions: int = 1) -> Scenario:
    return regular_survey(seed, "default", (0,), devices, sessions, 20.0)


def written(out: Path, scenario: Scenario, options: WritingOptions | None = None) -> dict[str, str]:
    simulate(scenario, out, options)
    return hashes(out)


def test_one_seed_same_bytes(tmp_path: Path) -> None:
    first, again = written(tmp_path / "a", tiny()), written(tmp_path / "b", tiny())
    assert first == again
    other = written(tmp_path / "c", tiny(seed=6))
    assert all(other[path] != digest for path, digest in first.items() if not path.endswith("dimensions.csv"))


def test_more_devices_and_sessions_leave_the_others_as_they_are(tmp_path: Path) -> None:
    few = written(tmp_path / "few", tiny(devices=("LG",)))
    many = written(tmp_path / "many", tiny(devices=("LG", "Galaxy"), sessions=2))
    assert len(many) > len(few)
    assert {path for path in few if few[path] != many[path]} == {"simulation.json"}


def test_layout(tmp_path: Path) -> None:
    done: list[SessionKey] = []
    scenario = tiny()
    simulate(scenario, tmp_path, progress=lambda key, _total: done.append(key))
    assert done == [planned.key for planned in scenario.sessions]
    survey = open_survey(tmp_path)
    assert [ref.key for ref in survey.sessions] == sorted(done)
    assert survey.findings == ()
    assert survey.site.floors[0].plan == tmp_path / "floor_0" / "floorplan.jpg"
    description = json.loads((tmp_path / "simulation.json").read_text())
    assert (description["seed"], description["severity"], description["traps"]) == (5, 1.0, [])
    names = {path.name for path in survey.sessions[0].folder.iterdir()}
    assert names == {"poses.csv", "initPoses.csv", "sensors.csv", "wifi.csv", "truth.csv"}


def test_paper_names_hold_the_same_text(tmp_path: Path) -> None:
    published = written(tmp_path / "a", tiny(devices=("LG",)))
    paper = written(tmp_path / "b", tiny(devices=("LG",)), WritingOptions(paper_names=True))
    folder = "floor_0/LG/" + tiny().sessions[0].key.session
    for name, paper_name in (("poses", "CameraPose"), ("initPoses", "LandmarkPose"), ("sensors", "Sensors")):
        assert published[f"{folder}/{name}.csv"] == paper[f"{folder}/{paper_name}.csv"]


@pytest.mark.parametrize(("locale", "marks"), [(Locale.DE, {",": 4}), (Locale.EN, {".": 4}), (Locale.MIXED, None)])
def test_locales(tmp_path: Path, locale: Locale, marks: dict[str, int] | None) -> None:
    simulate(tiny(), tmp_path, WritingOptions(locale=locale))
    files = [path for name in ("poses.csv", "sensors.csv") for path in sorted(tmp_path.rglob(name))]
    found = ["," if b"," in path.read_bytes() else "." for path in files]
    if marks is None:
        assert found == [",", ",", ",", "."]
    else:
        assert {mark: found.count(mark) for mark in found} == marks


def test_evaluation_survey(tmp_path: Path) -> None:
    simulate(paper_scenario(), tmp_path)
    assert len(list(tmp_path.rglob("refMarker.csv"))) == 1
    track = pl.read_csv(next(tmp_path.rglob("tachy.csv")), separator=";")
    assert track.height > 100
    shots = pl.read_csv(tmp_path / "floor_4" / "tachymeter" / "20220214_Tracking.csv", separator=";")
    assert shots.columns == ["time", "X", "Y"]
    markers = pl.read_csv(tmp_path / "floor_4" / "marker_dict.csv")
    surveyed = [markers.filter(pl.col("id") == number).select("x", "y").to_numpy()[0] for number in (10, 9)]
    measured = shots.select("X", "Y").to_numpy()[1:3]
    apart = [np.linalg.norm(pair[1] - pair[0]) for pair in (surveyed, measured)]
    assert apart[0] == pytest.approx(apart[1], abs=0.03)
    assert len(open_survey(tmp_path).site.floors[0].control_points.ids) > 5


def test_the_station_track_fits_the_truth(tmp_path: Path) -> None:
    """The reference landmarks turn the station's frame onto the BCS, on which it follows the true camera."""
    simulate(paper_scenario(), tmp_path)
    folder = next(tmp_path.rglob("tachy.csv")).parent
    shots = pl.read_csv(tmp_path / "floor_4" / "tachymeter" / "20220214_Tracking.csv", separator=";")
    markers = pl.read_csv(tmp_path / "floor_4" / "marker_dict.csv")
    local = (shots["X"].to_numpy() + 1j * shots["Y"].to_numpy())[1:3]
    first, second = (markers.filter(pl.col("id") == number).row(0)[1:3] for number in (10, 9))
    anchor, along = complex(*first), complex(*second) - complex(*first)
    track = pl.read_csv(folder / "tachy.csv", separator=";")
    points = track["X"].to_numpy() + 1j * track["Y"].to_numpy()
    mapped = anchor + (points - local[0]) * along / (local[1] - local[0])
    truth = pl.read_csv(folder / "truth.csv")
    path = truth["x"].to_numpy() + 1j * truth["y"].to_numpy()
    nearest = np.abs(mapped[:, None] - path).min(axis=1)
    assert np.median(nearest) < 0.03


def test_refuses_what_is_there(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("precious")
    with pytest.raises(OutputError, match="already exists and is not an empty folder"):
        simulate(tiny(), tmp_path)
    with pytest.raises(OutputError, match="already exists and is not an empty folder"):
        simulate(tiny(), tmp_path / "mine.txt")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_says_what_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        simulate(tiny(), tmp_path / "file" / "below")
