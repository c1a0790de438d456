from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.quality.evaluation.maps import floor_with
from tests.quality.evaluation.stations import BCS_T_STATION, CLOCK_NS, corridor_walk, measured
from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.tracks import Landmarks, Trajectory
from vislam2tag.quality.evaluation.press_truth import press_truth
from vislam2tag.quality.evaluation.station_frame import (
    CommonPoints,
    StationTrack,
    clock_by_speed,
    fit_frame,
    frame_findings,
    pressed_points,
    read_shots,
    read_station_track,
    shot_points,
)
from vislam2tag.site.model import ControlPoints


def test_reads_the_stations_file(tmp_path: Path) -> None:
    path = tmp_path / "tachy.csv"
    path.write_text("time;X;Y\n2022-01-14 16:01:04.250;1.5;-2\n2022-01-14 16:01:04.350;1.6;-2\n")
    track = read_station_track(path)
    assert np.diff(track.time_ns).tolist() == [100_000_000]
    assert track.time_ns[0] == np.datetime64("2022-01-14T16:01:04.250", "ns").astype(np.int64)
    np.testing.assert_array_equal(track.position[0], [1.5, -2])
    assert track.left_out == 0


def test_rows_that_cannot_be_used_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "tachy.csv"
    rows = [("04.2", "1;1"), ("04.2", "1;1"), ("04.1", "0;0"), ("04.3", ";2"), ("04.3", "2;2"), ("04.4", "NaN;2")]
    path.write_text("X;Y;time\n" + "".join(f"{xy};2022-01-14 16:01:{second}\n" for second, xy in rows))
    track = read_station_track(path)
    np.testing.assert_array_equal(track.position, [[1, 1], [2, 2]])
    assert track.left_out == 4


@pytest.mark.parametrize(
    "content", ["", "time,X,Y\n1,2,3\n", "time;X;Y\nnoon;1;2\n", "time;X;Y\n2022-01-14 16:01:04;1;2\n"]
)
def test_another_file_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "tachy.csv"
    path.write_text(content)
    with pytest.raises(SurveyError, match=r"tachy\.csv: expected"):
        read_station_track(path)


def test_a_missing_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"none\.csv: expected columns"):
        read_shots(tmp_path / "none.csv")


POINTS = ControlPoints(("0", "1"), np.array([[4.0, 3.0], [6.0, 3.0]]))


def landmarks() -> Landmarks:
    ids = ("9", "10", "9", "10")
    unknown = np.full(4, np.nan)
    position = np.array([[0.0, 0.0], [8.0, 0.0], [50.0, 5.0], [60.0, 5.0]])
    return Landmarks(ids, np.array([4, 4, 1, 1]), position, np.zeros((4, 2, 2)), unknown, unknown, unknown)


def shots(tmp_path: Path, text: str, name: str = "shots.csv") -> Path:
    (tmp_path / "tachymeter").mkdir(exist_ok=True)
    (tmp_path / "tachymeter" / name).write_text(text)
    return tmp_path


def test_published_file_shoots_landmarks_10_and_9(tmp_path: Path) -> None:
    station = BCS_T_STATION.inverse @ np.array([[1.0, 1.0], [8.0, 0.0], [0.0, 0.0]])
    rows = "".join(f"2022-02-14 00:0{i}:00;{x};{y}\n" for i, (x, y) in enumerate(station))
    frame = fit_frame(shot_points(shots(tmp_path, "time;X;Y\n" + rows), 4, landmarks()))
    assert frame.points.names == ("landmark 10", "landmark 9")
    assert frame.bcs_t_station.a == pytest.approx(BCS_T_STATION.a)
    assert frame.bcs_t_station.b == pytest.approx(BCS_T_STATION.b)
    assert frame.residual_m == pytest.approx(0, abs=1e-9)
    assert frame.scale == pytest.approx(1)


def test_named_shots_of_landmarks_and_control_points(tmp_path: Path) -> None:
    folder = shots(tmp_path, "landmark;point;X;Y\n9;;1;1\n;1;2;2\n;;3;3\n10;;;\n")
    points = shot_points(folder, 4, landmarks(), POINTS)
    assert points.names == ("landmark 9", "point 1")
    np.testing.assert_array_equal(points.station, [[1, 1], [2, 2]])
    np.testing.assert_array_equal(points.bcs, [[0, 0], [6, 3]])


def test_several_files_add_up(tmp_path: Path) -> None:
    shots(tmp_path, "landmark;X;Y\n9;1;1\n", "a.csv")
    assert len(shot_points(shots(tmp_path, "landmark;X;Y\n10;9;1\n", "b.csv"), 4, landmarks()).names) == 2


def test_what_cannot_be_used_is_said(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"row 1 is a shot of landmark 7, whose position on floor 4 is unknown"):
        shot_points(shots(tmp_path, "landmark;X;Y\n7;1;1\n"), 4, landmarks())
    with pytest.raises(SurveyError, match=r"shots\.csv: expected columns X and Y separated by ';'"):
        shot_points(shots(tmp_path, "landmark,X,Y\n9,1,1\n"), 4, landmarks())


@pytest.mark.parametrize(("count", "message"), [(0, "none is known"), (1, "only a is known")])
def test_a_frame_needs_two_points(count: int, message: str) -> None:
    points = CommonPoints(("a", "b")[:count], np.ones((count, 2)), np.ones((count, 2)))
    with pytest.raises(SurveyError, match=message):
        fit_frame(points)


@pytest.mark.parametrize("coincide", ["station", "bcs"])
def test_a_frame_needs_two_places(coincide: str) -> None:
    apart, together = np.array([[0.0, 0.0], [1.0, 0.0]]), np.ones((2, 2))
    station, bcs = (together, apart) if coincide == "station" else (apart, together)
    with pytest.raises(SurveyError, match="at different places"):
        fit_frame(CommonPoints(("a", "b"), station, bcs))


@given(st.floats(-3, 3), st.floats(-100, 100), st.floats(0.8, 1.2))
def test_metres_stay_metres(turn: float, shift: float, stretch: float) -> None:
    bcs = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 5.0]])
    matrix = stretch * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    frame = fit_frame(CommonPoints(("a", "b", "c"), bcs @ matrix.T + shift, bcs))
    assert frame.bcs_t_station.scale == pytest.approx(1)
    assert frame.scale == pytest.approx(1 / stretch)
    assert frame.bcs_t_station.rotation_rad == pytest.approx(-turn, abs=1e-9)


def test_a_point_that_does_not_fit_is_a_finding() -> None:
    bcs = np.array([[0.0, 0.0], [10.0, 0.0]])
    (finding,) = frame_findings(fit_frame(CommonPoints(("a", "b"), bcs * 1.06, bcs)))
    assert "differs by 0.30 m at a" in finding.message or "differs by 0.30 m at b" in finding.message
    assert frame_findings(fit_frame(CommonPoints(("a", "b"), bcs, bcs))) == []


PRESSED_POINTS = np.array([[3.0, 0.0], [9.0, 0.0], [15.0, 0.0]])


def pressed(walk: Trajectory, late_s: float = 0.0) -> IntArray:
    """Times at which the walk passes the points, first to last, pressed late."""
    x = walk.position_bcs[:, 0]
    passed = [int(np.argmax(x >= point)) for point in PRESSED_POINTS[:, 0]]
    return walk.time_ns[passed] + round(late_s * 1e9)


@pytest.mark.parametrize("clock_s", [-3.3, 0.0, 5000.0])
def test_speeds_tell_the_clock_in_any_frame(clock_s: float) -> None:
    walk = corridor_walk(noise_m=0.05)
    found = clock_by_speed(walk, measured(corridor_walk(), clock_s))
    assert (found - CLOCK_NS) * 1e-9 == pytest.approx(clock_s, abs=0.11)


def test_the_frame_from_presses() -> None:
    walks = [corridor_walk(1000.0 * (1 + seed), seed=seed) for seed in range(3)]
    floor = floor_with(PRESSED_POINTS)
    found = [pressed_points(w, measured(w, 7.0), press_truth(w, pressed(w), floor)) for w in walks]
    frame = fit_frame(CommonPoints.joined(found))
    assert len(frame.residual_m) >= 6
    assert np.abs(frame.bcs_t_station @ (BCS_T_STATION.inverse @ PRESSED_POINTS) - PRESSED_POINTS).max() < 0.6


def test_presses_the_station_did_not_see_do_not_count() -> None:
    walk = corridor_walk()
    track = measured(walk)
    moments = pressed(walk)
    blind = np.abs(track.time_ns - CLOCK_NS - moments[1]) < 1_500_000_000
    gappy = StationTrack(track.time_ns[~blind], track.position[~blind])
    assert pressed_points(walk, gappy, press_truth(walk, moments, floor_with(PRESSED_POINTS))).names == (
        "point 0",
        "point 2",
    )


def test_another_motion_is_refused() -> None:
    with pytest.raises(SurveyError, match="never move alike"):
        clock_by_speed(corridor_walk(duration_s=15.0), measured(corridor_walk()))
