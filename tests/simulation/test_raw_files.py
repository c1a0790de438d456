"""Simulated sessions and their site in the published layout."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from tests.simulation.worlds import sessions_of
from vislam2tag.simulation.building import make_building
from vislam2tag.simulation.imu import INERTIAL_TYPES
from vislam2tag.simulation.model import position_at
from vislam2tag.simulation.phones import DecimalMarks, SimulatedSession
from vislam2tag.simulation.raw_files import PAPER_NAMES, PUBLISHED_NAMES, session_text, site_text
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings, SiteColumn
from vislam2tag.simulation.survey import WritingOptions, simulate
from vislam2tag.simulation.traps import TABLE_TRAPS
from vislam2tag.site.discover import read_site

NUMBER = rb"-?\d+,\d{6}"
LINE = {
    "poses": rb"\d+(; NUMBER){7}",
    "landmarks": rb"\d+; \d+(; NUMBER){7}",
    "sensors": rb"\d+; [A-Z_]+(; NUMBER){6}",
    "wifi": rb"\d+; \d+; WLAN; [\w-]+; [0-9a-f:]{17}; -\d+",
}


@pytest.fixture(scope="module")
def session() -> SimulatedSession:
    return sessions_of("clean")[0]


@pytest.mark.parametrize("role", list(LINE))
def test_every_line_is_as_the_phone_app_writes_it(session: SimulatedSession, role: str) -> None:
    content = session_text(session)[role]
    pattern = re.compile(LINE[role].replace(b"NUMBER", NUMBER))
    lines = content.split(b"\n")
    assert lines.pop() == b""
    assert len(lines) > 100
    assert [line for line in lines if not pattern.fullmatch(line)] == []


def test_rows_and_times(session: SimulatedSession) -> None:
    text = session_text(session)
    rows = {role: [line.split(b"; ") for line in text[role].splitlines()] for role in LINE}
    assert [int(row[0]) for row in rows["poses"]] == session.tracker.time_ns.tolist()
    assert {row[1] for row in rows["landmarks"]} <= {row[0] for row in rows["poses"]}
    frames = [int(row[1]) for row in rows["landmarks"]]
    assert frames == sorted(frames)
    assert len(rows["landmarks"]) == len(session.tracker.landmarks.frame)
    assert {row[1].decode() for row in rows["sensors"]} == set(INERTIAL_TYPES)
    microseconds = np.array([int(row[1]) for row in rows["wifi"]])
    assert (microseconds * 1000 > session.walk.time_ns[0]).all()
    assert (microseconds * 1000 < session.walk.time_ns[-1]).all()


def test_decimal_marks_are_the_devices(session: SimulatedSession) -> None:
    assert session.marks == DecimalMarks(",", ",")
    comma = session_text(session)
    point = session_text(replace(session, marks=DecimalMarks(".", ".")))
    mixed = session_text(replace(session, marks=DecimalMarks(",", ".")))
    assert b"." not in comma["poses"] + comma["sensors"] + comma["landmarks"]
    assert comma["landmarks"].replace(b",", b".") == point["landmarks"]
    assert (mixed["poses"], mixed["sensors"]) == (comma["poses"], point["sensors"])


def test_lost_landmarks_have_the_cameras_text(session: SimulatedSession) -> None:
    text = session_text(TABLE_TRAPS["tracking_lost"](session))
    camera = dict(line.split(b"; ", 1) for line in text["poses"].splitlines())
    rows = [line.split(b"; ", 2)[1:] for line in text["landmarks"].splitlines()]
    assert sum(camera[time] == pose for time, pose in rows) > 50


def test_truth_is_the_walk_at_the_stamps(session: SimulatedSession) -> None:
    truth = pl.read_csv(session_text(session)["truth"])
    assert truth.columns == ["time_ns", "x", "y", "z", "floor"]
    time_ns = truth["time_ns"].to_numpy()
    assert time_ns.tolist() == session.tracker.time_ns.tolist()
    expected = position_at(session.walk, time_ns) + np.array((0.0, 0.0, session.floor.elevation_m))
    assert np.abs(truth.select("x", "y", "z").to_numpy() - expected).max() < 1e-4
    assert set(truth["floor"]) == {session.floor.number}


def test_presses_and_station_only_where_there_are_any() -> None:
    pressed, tracked = sessions_of("paper")
    assert "station" not in session_text(pressed)
    assert "presses" not in session_text(tracked)
    presses = [line.split(b"; ") for line in session_text(pressed)["presses"].splitlines()]
    assert [int(row[0]) for row in presses] == list(range(len(presses)))
    assert [int(row[1]) for row in presses] == pressed.presses_ns.tolist()


def test_station_times_are_on_its_wall_clock() -> None:
    tracked = sessions_of("paper")[1]
    assert tracked.station is not None
    table = pl.read_csv(session_text(tracked)["station"], separator=";", try_parse_dates=True)
    assert table.columns == ["time", "X", "Y"]
    assert table["time"].dtype.is_temporal()
    wall_ns = table["time"].cast(pl.Datetime("ns")).to_physical().to_numpy()
    offset_ns = wall_ns - tracked.station.time_ns
    assert np.abs(offset_ns - tracked.station_offset_ns).max() < 1e6
    assert str(table["time"][0])[:10] == "2022-01-14"


def test_names_differ_only_where_the_paper_says_so() -> None:
    differing = {role for role in PUBLISHED_NAMES if PUBLISHED_NAMES[role] != PAPER_NAMES[role]}
    assert differing == {"poses", "landmarks", "sensors", "wifi"}


ALL = frozenset(SiteColumn)


def test_site_files(session: SimulatedSession) -> None:
    files = site_text(session.building, control_points=True)
    assert set(files) == {"floor_dimensions.csv", "floor_0/marker_dict.csv", "floor_0/refmarker.csv"}
    assert files["floor_dimensions.csv"] == b"id,width,height\n0,60.0,32.0\n"
    markers = pl.read_csv(files["floor_0/marker_dict.csv"])
    assert markers.columns == ["id", "x", "y"]
    assert np.allclose(markers.select("x", "y").to_numpy(), session.floor.landmark_position[:, :2], atol=1e-4)
    points = pl.read_csv(files["floor_0/refmarker.csv"], has_header=False).to_numpy()
    assert np.allclose(points, session.floor.control_points, atol=1e-4)
    assert "floor_0/refmarker.csv" not in site_text(session.building, control_points=False)


def test_optional_columns_are_off_by_what_they_say(tmp_path: Path) -> None:
    building = make_building(BuildingSettings(landmarks=20), 1, tuple(range(12)))
    for name, text in site_text(building, False, ALL, seed=4).items():
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(text)
    marks = read_site(tmp_path)[0].landmarks
    place = np.vstack([floor.landmark_position for floor in building.floors])
    heading = np.concatenate([floor.landmark_heading_rad for floor in building.floors])
    sigma = np.sqrt(marks.covariance_bcs[:, 0, 0])
    assert len(set(sigma.tolist())) > 50
    assert np.std((marks.position_bcs - place[:, :2]) / sigma[:, None]) == pytest.approx(1.0, abs=0.15)
    assert np.std(marks.z_m - place[:, 2]) == pytest.approx(0.02, abs=0.005)
    turned = (marks.heading_rad - heading + np.pi) % (2 * np.pi) - np.pi
    assert np.std(turned / marks.heading_sigma_rad) == pytest.approx(1.0, abs=0.15)


def test_one_more_column_leaves_the_others_as_they_are(session: SimulatedSession) -> None:
    def table(columns: frozenset[SiteColumn]) -> pl.DataFrame:
        return pl.read_csv(site_text(session.building, False, columns, seed=4)["floor_0/marker_dict.csv"])

    assert table(ALL).select("id", "x", "y", "sigma_m").equals(table(frozenset({SiteColumn.SIGMA})))
    assert table(ALL).select("z").equals(table(frozenset({SiteColumn.Z})).select("z"))


def test_elevations_are_read_back(tmp_path: Path) -> None:
    scenario = regular_survey(1, "none", (0, 1), ("LG",), 1, 20.0)
    simulate(scenario, tmp_path, WritingOptions(columns=frozenset({SiteColumn.ELEVATION})))
    assert [floor.elevation_m for floor in read_site(tmp_path)[0].floors] == [0.0, 3.6]
