"""Changes of frames: estimated, written, turned back.

From the building frame to longitude and latitude, against PROJ.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from rasterio.warp import transform

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.transforms import Similarity2
from vislam2tag.site.frame_change import (
    FrameChange,
    FrameChanges,
    changed_landmarks_text,
    changed_points_text,
    changes_from,
    changes_text,
    estimated_changes,
    in_frame_of,
    read_changes,
)
from vislam2tag.site.georeference import Georeference, from_wgs84, to_wgs84
from vislam2tag.site.landmark_file import landmarks_from, read_landmark_file
from vislam2tag.site.landmark_states import SurveyedLandmark
from vislam2tag.site.model import ControlPoints, Floor, Site
from vislam2tag.site.site_file import Relation

changes = st.builds(
    FrameChange,
    number=st.just(1),
    x_m=st.floats(-500, 500),
    y_m=st.floats(-500, 500),
    angle_deg=st.floats(-360, 360),
    scale=st.floats(0.2, 5),
    rise_m=st.floats(-50, 50),
)
ROWS = "id,x,y,z,sigma_m,heading_rad,note\n1,3.5,4,1.4,0.05,3.1,by the door\n02,20,-7.25,,,,\n9,,,,,,not surveyed\n"


def site_of(folder: Path, rows: str, elevation_m: float | None = None) -> Site:
    (folder / "floor_1").mkdir(parents=True)
    (folder / "floor_1" / "marker_dict.csv").write_text(rows)
    found, findings = read_landmark_file(folder, folder / "floor_1", 1, 0.1, set())
    assert not findings
    points = ControlPoints((), np.empty((0, 2)))
    return Site((Floor(1, "One", None, None, elevation_m, None, points),), landmarks_from(found))


@given(change=changes)
def test_there_and_back(change: FrameChange) -> None:
    points = np.array([[0.0, 0.0], [120.0, -40.0], [3.25, 77.0]])
    back = change.inverse.new_T_old @ (change.new_T_old @ points)
    assert back == pytest.approx(points, abs=1e-8)
    assert change.inverse.rise_m == -change.rise_m
    assert change.new_T_old.scale == pytest.approx(change.scale)


@given(change=changes)
def test_what_is_written_is_read(tmp_path_factory: pytest.TempPathFactory, change: FrameChange) -> None:
    path = tmp_path_factory.mktemp("change") / "rebase.toml"
    whole = FrameChanges(floors=(change.model_copy(update={"residuals_m": {"a b": 0.01}}),))
    path.write_text(changes_text(whole))
    assert read_changes(path) == whole


@given(change=changes)
def test_landmark_files_there_and_back(tmp_path_factory: pytest.TempPathFactory, change: FrameChange) -> None:
    root = tmp_path_factory.mktemp("site")
    (root / "old.csv").write_text(ROWS)
    (root / "new.csv").write_text(changed_landmarks_text(root, root / "old.csv", {1: change}, 1))
    (root / "back.csv").write_text(changed_landmarks_text(root, root / "new.csv", {1: change.inverse}, 1))
    old, back = ((root / name).read_text().splitlines() for name in ("old.csv", "back.csv"))
    assert [row.split(",")[-1] for row in old] == [row.split(",")[-1] for row in back]
    for one, other in zip(old[1:], back[1:], strict=True):
        for text, again in zip(one.split(",")[1:6], other.split(",")[1:6], strict=True):
            assert (text == again) if text == "" else float(again) == pytest.approx(float(text), abs=1e-8)


def test_a_quarter_turn_of_files(tmp_path: Path) -> None:
    (tmp_path / "marker_dict.csv").write_text("id,x,y,floor,sigma_m,heading_rad\n1,2,0,1,0.1,3\n2,,,1,,\n")
    (tmp_path / "refmarker.csv").write_text("1,2\n0,0\n")
    change = FrameChange(number=1, x_m=10, y_m=20, angle_deg=90, scale=2, rise_m=7)
    text = changed_landmarks_text(tmp_path, tmp_path / "marker_dict.csv", {1: change}, None)
    first = text.splitlines()[1].split(",")
    assert [float(each) for each in first] == pytest.approx([1, 10, 24, 1, 0.2, 3 + np.pi / 2 - 2 * np.pi])
    assert text.splitlines()[2] == "2,,,1,,"
    points = changed_points_text(tmp_path, tmp_path / "refmarker.csv", change).splitlines()
    assert [[float(each) for each in row.split(",")] for row in points] == [[6, 22], [10, 20]]


@given(change=changes)
def test_a_change_is_found_by_landmarks(tmp_path_factory: pytest.TempPathFactory, change: FrameChange) -> None:
    folder = tmp_path_factory.mktemp("sites")
    rows = "id,x,y\n1,3.5,4\n2,20,-7.25\n3,11,19\n8,1,1\n"
    old = site_of(folder / "old", rows)
    (folder / "new.csv").write_text(rows.replace("8,1,1\n", "7,0,0\n"))
    new = site_of(folder / "new", changed_landmarks_text(folder, folder / "new.csv", {1: change}, 1))
    (found,) = estimated_changes(old, new).floors
    points = np.array([[0.0, 0.0], [30.0, 30.0]])
    assert found.new_T_old @ points == pytest.approx(change.new_T_old @ points, abs=1e-6)
    assert set(found.residuals_m) == {"1", "2", "3"}
    assert max(found.residuals_m.values()) < 1e-6


def test_what_was_moved_shows_and_can_be_left_out(tmp_path: Path) -> None:
    old = site_of(tmp_path / "old", "id,x,y,z\n1,0,0,1.4\n2,10,0,\n3,10,10,\n4,0,10,\n", 0.0)
    new = site_of(tmp_path / "new", "id,x,y,z\n1,0,0,1.5\n2,10,0,\n3,10,10,\n4,0,12,\n", 3.0)
    (found,) = estimated_changes(old, new, rigid=True).floors
    assert found.scale == 1.0
    assert max(found.residuals_m, key=lambda name: found.residuals_m[name]) == "4"
    (kept,) = estimated_changes(old, new, without=("4",)).floors
    assert kept.residuals_m == {"1": 0.0, "2": 0.0, "3": 0.0}
    assert kept.rise_m == pytest.approx(3.1)
    assert kept.scale == pytest.approx(1.0)


def test_a_rigid_change_keeps_the_middle(tmp_path: Path) -> None:
    old = site_of(tmp_path / "old", "id,x,y\n1,0,0\n2,10,0\n")
    new = site_of(tmp_path / "new", "id,x,y\n1,5,5\n2,5,17\n")
    (found,) = estimated_changes(old, new, rigid=True).floors
    assert found.new_T_old.scale == pytest.approx(1.0)
    assert found.new_T_old @ np.array([[5.0, 0.0]]) == pytest.approx(np.array([[5.0, 11.0]]))


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("id,x,y\n1,0,0\n9,1,1\n", "share 1 surveyed landmarks; two in different places"),
        ("id,x,y\n1,5,5\n2,5,6\n", None),
        ("id,x,y\n8,5,5\n9,5,6\n", "share 0 surveyed landmarks"),
    ],
)
def test_too_few_landmarks_in_common(tmp_path: Path, rows: str, message: str | None) -> None:
    old, new = site_of(tmp_path / "old", "id,x,y\n1,0,0\n2,0,1\n"), site_of(tmp_path / "new", rows)
    if message is None:
        assert estimated_changes(old, new).floors[0].new_T_old.b == pytest.approx(5 + 5j)
        return
    with pytest.raises(SurveyError, match=message):
        estimated_changes(old, new)


def test_landmarks_all_in_one_place(tmp_path: Path) -> None:
    old = site_of(tmp_path / "old", "id,x,y\n1,4,4\n2,4,4\n")
    with pytest.raises(SurveyError, match="share 2 surveyed landmarks, all in one place"):
        estimated_changes(old, site_of(tmp_path / "new", "id,x,y\n1,0,0\n2,0,1\n"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("id,x,y,floor\n1,a,3,1\n", r"old.csv:2: could not convert"),
        ("id,a,b\n", r"the first line must be: id,x,y"),
        ("id,x,y,floor\n1,2,3,7\n", r"old.csv:2: there is no change for floor 7; add it to rebase.toml"),
        ("id,x,y\n1,2,3\n", r"old.csv:2: floor 'None' is not a number"),
    ],
)
def test_files_that_cannot_be_changed(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "old.csv").write_text(text)
    with pytest.raises(SurveyError, match=message):
        changed_landmarks_text(tmp_path, tmp_path / "old.csv", {1: FrameChange.of(1, Similarity2.identity())}, None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[floors]]\nnumber = 1\nscale = 0\n", r"\[\[floors\]\] number 1, scale: "),
        ("[[floors]]\nnumber = 1\n[[floors]]\nnumber = 1\n", "floor 1 is given 2 times"),
        ("[[floors]]\nx_m = 1\n", "number: missing"),
    ],
)
def test_change_files_that_cannot_be(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "rebase.toml").write_text(text)
    with pytest.raises(SurveyError, match=message):
        read_changes(tmp_path / "rebase.toml")
    with pytest.raises(SurveyError, match="no such file"):
        read_changes(tmp_path / "gone.toml")


NAN = float("nan")
MARKS = landmarks_from(
    [
        SurveyedLandmark("a", 0, 1.0, 2.0, 1.4, 0.1, 0.5, 0.05, ""),
        SurveyedLandmark("b", 1, 3.0, 0.0, 1.4, 0.1, 0.5, 0.05, ""),
        SurveyedLandmark("c", 1, NAN, NAN, NAN, 0.1, NAN, NAN, ""),
    ]
)


def two_floors(relation: Relation) -> Site:
    floors = [
        Floor(number, "", None, None, None, None, ControlPoints((), np.empty((0, 2))), site_T_bcs=each.similarity())
        for number, each in enumerate((Relation(), relation))
    ]
    return Site(tuple(floors), MARKS)


def test_floors_that_share_a_frame_change_nothing() -> None:
    site = two_floors(Relation())
    assert changes_from(site, 0) == {}
    assert in_frame_of(MARKS, site, 0) is MARKS


def test_landmarks_of_the_other_floor_turn() -> None:
    site = two_floors(Relation(x_m=10.0, y_m=20.0, angle_deg=90.0))
    long = replace(MARKS, covariance_bcs=np.where(np.isinf(MARKS.covariance_bcs), np.inf, np.diag([4.0, 1.0])))
    turned = in_frame_of(long, site, 0)
    assert turned.position_bcs[:2] == pytest.approx(np.array([[1, 2], [10, 23]]))
    assert turned.covariance_bcs[1] == pytest.approx(np.diag([1.0, 4.0]))
    assert turned.heading_rad[:2] == pytest.approx([0.5, 0.5 + np.pi / 2])
    assert turned.surveyed.tolist() == [True, True, False]
    assert np.isposinf(turned.covariance_bcs[2]).any()
    back = in_frame_of(long, site, 1)
    assert back.position_bcs[1] == pytest.approx([3, 0])
    change = changes_from(site, 0)[1].new_T_old
    assert change @ np.array([10.0, 23.0]) == pytest.approx([3, 0])


@pytest.mark.parametrize(("latitude", "longitude"), [(50.78, 6.07), (-33.9, 151.2), (0.0, 179.999), (69.6, -18.9)])
def test_proj_says_the_same(latitude: float, longitude: float) -> None:
    position = np.array([[0.0, 0.0], [300.0, 0.0], [0.0, -250.0], [-120.5, 77.25]])
    ours = to_wgs84(position, Georeference(latitude_deg=latitude, longitude_deg=longitude))
    # Azimuthal equidistant: distances from the origin along the ellipsoid, as good as the plane this near.
    frame = f"+proj=aeqd +lat_0={latitude} +lon_0={longitude} +datum=WGS84 +units=m"
    theirs = np.array(transform(frame, "EPSG:4326", *position.T)).T
    difference = np.abs((ours - theirs + 180) % 360 - 180)
    assert difference.max() < 1e-8  # a millimetre


@given(bearing=st.floats(-720, 720), x=st.floats(-500, 500), y=st.floats(-500, 500))
def test_the_bearing_turns_clockwise(bearing: float, x: float, y: float) -> None:
    turn = np.radians(bearing)
    north_up = np.array([[x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)]])
    turned = to_wgs84(np.array([[x, y]]), Georeference(latitude_deg=48.0, longitude_deg=11.0, bearing_deg=bearing))
    straight = to_wgs84(north_up, Georeference(latitude_deg=48.0, longitude_deg=11.0))
    assert turned == pytest.approx(straight, abs=1e-11)


def test_the_plan_with_east_up() -> None:
    east_up = Georeference(latitude_deg=50.0, longitude_deg=6.0, bearing_deg=90.0)
    longitude, latitude = to_wgs84(np.array([[0.0, 100.0]]), east_up)[0]
    assert longitude > 6.001
    assert latitude == pytest.approx(50.0, abs=1e-7)


def test_no_place_on_earth() -> None:
    with pytest.raises(ValidationError):
        Georeference(latitude_deg=95.0, longitude_deg=6.0)


@given(
    latitude=st.floats(-89, 89),
    longitude=st.floats(-180, 180),
    bearing=st.floats(-360, 360),
    x=st.floats(-2000, 2000),
    y=st.floats(-2000, 2000),
)
def test_there_and_back_on_earth(latitude: float, longitude: float, bearing: float, x: float, y: float) -> None:
    frame = Georeference(latitude_deg=latitude, longitude_deg=longitude, bearing_deg=bearing)
    position = np.array([[x, y]])
    # Within 2 km the ellipsoid lies up to 0.3 m below the plane; seen from above that moves a point by 0.1 mm.
    assert from_wgs84(to_wgs84(position, frame), frame) == pytest.approx(position, abs=2e-4)
