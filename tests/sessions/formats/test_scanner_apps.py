"""Scanner apps."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.sessions.formats.app_recordings import APPS, POSITION, TIME_S, TURN, ios_logger, stray_scanner, tum
from tests.walks import landmarks_at
from vislam2tag.common.errors import SessionError
from vislam2tag.common.findings import Severity
from vislam2tag.intake.pose_conventions import pose_findings
from vislam2tag.sessions.apps import AppFormat
from vislam2tag.sessions.model import Session
from vislam2tag.sessions.registry import FORMATS, format_of, read_session
from vislam2tag.site.model import SessionKey, SessionRef


def read(folder: Path, name: str) -> Session:
    return read_session(SessionRef(SessionKey(1, "iPhone", "walk"), folder, name, "slug"))


@pytest.mark.parametrize("app", APPS)
def test_each_app_is_recognised_and_gives_the_same_track(app: str, tmp_path: Path) -> None:
    name, write = APPS[app]
    write(tmp_path)
    assert format_of(tmp_path) == name
    camera = read(tmp_path, name).camera
    assert camera.usable.all()
    np.testing.assert_allclose(camera.time_ns * 1e-9, TIME_S, atol=1e-6)
    np.testing.assert_allclose(camera.position_acs, POSITION, atol=1e-7)
    assert (Rotation.from_quat(camera.orientation_acs) * TURN.inv()).magnitude().max() < 1e-6


@pytest.mark.parametrize("app", APPS)
def test_without_landmarks_the_session_says_what_to_do(app: str, tmp_path: Path) -> None:
    name, write = APPS[app]
    write(tmp_path)
    (finding,) = (each for each in read(tmp_path, name).findings if each.kind == "no_sightings")
    app_format = FORMATS.named(name)
    assert isinstance(app_format, AppFormat)
    searchable = app_format.pictures(tmp_path) is not None
    assert ("vislam2tag sightings" in finding.message) is searchable


def test_sightings_in_the_cameras_frame_are_turned_into_the_acs(tmp_path: Path) -> None:
    stray_scanner(tmp_path)
    in_camera = np.array((0.2, -0.1, -2.0))
    rows = [f"7; {round(t * 1e9)}; 0.2; -0.1; -2.0; 0; 0; 0; 1; 0.02\n" for t in TIME_S[5:8].tolist()]
    (tmp_path / "sightings.csv").write_text("".join(rows), encoding="utf-8")
    log = read(tmp_path, "stray-scanner").landmarks
    assert log.ids == ("7",)
    assert log.seen is not None
    assert log.seen.all()
    np.testing.assert_allclose(log.position_acs, TURN[5:8].apply(in_camera) + POSITION[5:8], atol=1e-6)


@pytest.mark.parametrize(("scale", "kinds"), [(1.0, set()), (9.80665, set()), (0.2, {"unknown_unit"})])
def test_the_unit_of_accelerations_is_told_from_gravity(scale: float, kinds: set[str], tmp_path: Path) -> None:
    stray_scanner(tmp_path)
    _write_imu(tmp_path, Rotation.identity(), scale)
    session = read(tmp_path, "stray-scanner")
    assert {each.kind for each in session.findings} & {"unknown_unit", "not_level"} == kinds
    force = session.tables["sensors"].filter(sensor="ACC").select("v1", "v2", "v3").to_numpy()
    if not kinds:
        np.testing.assert_allclose(np.linalg.norm(force, axis=1), 9.80665, rtol=1e-4)


def test_a_frame_that_is_not_level_is_an_error(tmp_path: Path) -> None:
    stray_scanner(tmp_path)
    _write_imu(tmp_path, Rotation.from_euler("x", 20, degrees=True), 1.0)
    session = read(tmp_path, "stray-scanner")
    (finding,) = (each for each in session.findings if each.kind == "not_level")
    assert "tilted by 20 degrees" in finding.message
    others = {each.kind for each in session.findings if each.severity == Severity.ERROR}
    assert others == {"not_level"}, "no other check refuses it"


def _write_imu(folder: Path, tilt: Rotation, scale: float) -> None:
    """Accelerations of a phone whose frame is tilted, downwards as iOS counts them."""
    phone_q_camera = Rotation.from_euler("z", -90, degrees=True)
    up = phone_q_camera.apply(TURN.inv().apply(tilt.apply((0.0, 1.0, 0.0))))
    rows = [
        f"{t:.6f}, " + ", ".join(f"{value:.6f}" for value in (*force, 0, 0, 0))
        for t, force in zip(TIME_S, -scale * up, strict=True)
    ]
    header = "timestamp, a_x, a_y, a_z, alpha_x, alpha_y, alpha_z"
    (folder / "imu.csv").write_text("\n".join((header, *rows)) + "\n", encoding="utf-8")


def test_poses_of_an_unnamed_tracker_need_their_axes(tmp_path: Path) -> None:
    tum(tmp_path)
    (tmp_path / "poses.toml").unlink()
    with pytest.raises(SessionError, match="no poses"):
        read(tmp_path, "tum")
    (tmp_path / "poses.toml").write_text('camera = "sideways"\n', encoding="utf-8")
    with pytest.raises(SessionError, match='write camera = "y-up"'):
        read(tmp_path, "tum")


def test_lines_that_do_not_parse_are_counted_with_their_numbers(tmp_path: Path) -> None:
    stray_scanner(tmp_path)
    path = tmp_path / "odometry.csv"
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[4] = "half a line"
    lines[9] = lines[9].replace(lines[9].split(", ")[5], "nan")
    path.write_text("\n".join(lines), encoding="utf-8")
    found = {each.kind: each.lines for each in read(tmp_path, "stray-scanner").findings}
    assert found["malformed_lines"] == (5,)
    assert found["non_finite_values"] == (10,)


def test_a_matrix_that_is_no_rotation_is_not_used(tmp_path: Path) -> None:
    _, write = APPS["ARKit Data Logger"]
    write(tmp_path)
    path = tmp_path / "ARKit_camera_pose.txt"
    lines = path.read_text(encoding="utf-8").splitlines()
    lines[3] = " ".join((lines[3].split()[0], *("0.5",) * 12))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    session = read(tmp_path, "arkit-data-logger")
    assert np.flatnonzero(~session.camera.usable).tolist() == [2]
    assert {each.kind: each.lines for each in session.findings}["non_finite_values"] == (4,)


def test_a_frames_file_that_is_damaged_is_left_out(tmp_path: Path) -> None:
    _, write = APPS["3D Scanner App"]
    write(tmp_path)
    (tmp_path / "frame_00003.json").write_text('{"time": 1', encoding="utf-8")
    (tmp_path / "frame_00005.json").write_text("[]", encoding="utf-8")
    session = read(tmp_path, "scanner-3d-app")
    assert len(session.camera.time_ns) == len(TIME_S) - 2
    assert {each.kind: each.count for each in session.findings}["malformed_lines"] == 2


def test_readings_of_two_files_are_one_table(tmp_path: Path) -> None:
    ios_logger(tmp_path)
    rows = "".join(f"{t:.6f},0.0,-1.0,0.0\n" for t in TIME_S.tolist())
    (tmp_path / "Accel.txt").write_text(rows, encoding="utf-8")
    (tmp_path / "Gyro.txt").write_text(rows, encoding="utf-8")
    sensors = read(tmp_path, "ios-logger").tables["sensors"]
    assert dict(sensors.group_by("sensor").len().iter_rows()) == {"ACC": len(TIME_S), "GYRO": len(TIME_S)}
    assert sensors.filter(sensor="ACC")["v2"][0] == pytest.approx(9.80665)


def _long_walk(
    folder: Path, metre: float = 1.0, second: float = 1.0, camera: str = "y-up", frame: str = "y-up"
) -> None:
    """Round a block, looking ahead, as a TUM file in ARKit's axes."""
    along = np.arange(0, 60, 0.1)
    corner = np.array(((0, 0), (15, 0), (15, 10), (0, 10), (0, 0)), np.float64)
    at = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(corner, axis=0), axis=1))))
    x, z = (np.interp(along % at[-1], at, corner[:, i]) for i in (0, 1))
    heading = np.arctan2(-np.gradient(x), -np.gradient(z))
    turn = Rotation.from_rotvec(np.column_stack((0 * heading, heading, 0 * heading))).as_quat()
    rows = np.column_stack((along * second, metre * np.column_stack((x, 0.02 * np.sin(along), z)), turn))
    (folder / "poses.tum").write_text("".join(" ".join(f"{v:.6f}" for v in row) + "\n" for row in rows.tolist()))
    (folder / "poses.toml").write_text(f'camera = "{camera}"\nframe = "{frame}"\n', encoding="utf-8")


@pytest.mark.parametrize(
    ("wrong", "kind", "said"),
    [
        ({}, None, ""),
        ({"metre": 1000.0}, "pose_convention", "Probably lengths are in millimetres."),
        ({"second": 1000.0}, "pose_convention", "Probably times are in milliseconds."),
        ({"frame": "z-up"}, "pose_convention", "is not held level"),
        ({"camera": "y-down"}, "pose_convention", "looks backwards during the whole walk"),
    ],
)
def test_units_and_axes_that_cannot_be_a_walkers_are_named(
    wrong: dict[str, Any], kind: str | None, said: str, tmp_path: Path
) -> None:
    _long_walk(tmp_path, **wrong)
    session = read(tmp_path, "tum")
    found = pose_findings(session.camera, session.landmarks, landmarks_at({}), "poses.txt")
    assert [each.kind for each in found] == ([] if kind is None else [kind])
    assert all(said in each.message for each in found)


@pytest.mark.parametrize(("metadata", "pictures"), [("metadata", "rgbd"), ("EXR_RGBD/metadata.json", "EXR_RGBD/rgb")])
def test_record3d_is_refused_with_the_reason(metadata: str, pictures: str, tmp_path: Path) -> None:
    (tmp_path / pictures).mkdir(parents=True)
    (tmp_path / metadata).write_text('{"poses": [[0, 0, 0, 1, 0, 0, 0]]}', encoding="utf-8")
    assert format_of(tmp_path) == "record3d"
    with pytest.raises(SessionError, match="neither aligns its frame with gravity"):
        read(tmp_path, "record3d")


def test_a_video_without_its_lens_is_named(tmp_path: Path) -> None:
    stray_scanner(tmp_path)
    (tmp_path / "rgb.mp4").write_bytes(b"")
    known = FORMATS.named("stray-scanner")
    assert isinstance(known, AppFormat)
    with pytest.raises(SessionError, match=r"camera_matrix.csv: expected the camera's 3 x 3 matrix"):
        known.pictures(tmp_path)
