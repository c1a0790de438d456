"""Poses of a person pass, and the same poses in another convention are named, with and without an IMU."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.intake.faults import Poses, exchanged, in_millimetres, inverted, left_handed, z_up
from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import InertialLog
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.intake.pose_conventions import pose_findings
from vislam2tag.intake.pose_evidence import CONVENTIONS, matrices
from vislam2tag.intake.pose_evidence import Poses as ThinnedPoses

TIME_S = np.arange(0, 120, 1 / 30)
CAMERA_Q_PHONE = Rotation.from_euler("xyz", (10, -20, 95), degrees=True)


def walked() -> FloatArray:
    """Poses (n, 7) of a walk round and round, the phone tilted by 25 degrees, swaying."""
    angle = 0.15 * TIME_S + 0.4 * np.sin(0.3 * TIME_S)
    position = np.column_stack((9 * np.cos(angle), 0.03 * np.sin(11 * TIME_S), -5 * np.sin(angle)))
    step = np.gradient(position, axis=0)
    yaw = np.arctan2(-step[:, 0], -step[:, 2]) + 0.1 * np.sin(5.5 * TIME_S)
    pitch = np.radians(-25 + 4 * np.sin(5 * TIME_S))
    turn = Rotation.from_euler("YX", np.column_stack((yaw, pitch)))
    return np.column_stack((position, turn.as_quat()))


def measured(poses: FloatArray) -> InertialLog:
    """What the phone's IMU measures on the way."""
    time_ns = (TIME_S * 1e9).astype(np.int64)
    camera = Rotation.from_quat(poses[:, 3:])
    rate = (camera[:-1].inv() * camera[1:]).as_rotvec() * 30
    force = camera.inv().apply((0, 9.81, 0))
    return InertialLog(
        time_ns,
        CAMERA_Q_PHONE.inv().apply(force),
        time_ns[1:],
        CAMERA_Q_PHONE.inv().apply(rate),
        time_ns[:0],
        np.empty((0, 4)),
    )


def seen_at(moments_s: Sequence[float]) -> tuple[LandmarkLog, Landmarks]:
    """Landmarks of a walk, each seen once from where it hangs, and where they were surveyed."""
    frame = (np.array(moments_s, dtype=np.float64) * 30).astype(np.int64)
    count, at = len(frame), walked()[frame, :3]
    ids = tuple(f"L{index}" for index in range(count))
    log = LandmarkLog(ids, np.arange(count), frame, at, np.tile((0, 0, 0, 1), (count, 1)), np.zeros(count, dtype=bool))
    unknown = np.full(count, np.nan)
    surveyed = np.tile(1e-4 * np.eye(2), (count, 1, 1))
    floor = np.zeros(count, dtype=np.int64)
    return log, Landmarks(ids, floor, at[:, (0, 2)] * (1, -1), surveyed, unknown, unknown, unknown)


def camera_of(poses: FloatArray, inertial: InertialLog | None = None, slower: float = 1.0) -> CameraTrack:
    """A log with these poses, of a walk that takes so many times as long."""
    status = np.zeros(len(poses), dtype=np.int8)
    time_ns = (TIME_S * 1e9 * slower).astype(np.int64)
    return CameraTrack(time_ns, poses[:, :3], poses[:, 3:], status, inertial=inertial)


def findings(poses: FloatArray, inertial: InertialLog | None = None) -> list[Finding]:
    """Of a log with these poses and no landmark."""
    return pose_findings(camera_of(poses, inertial), *seen_at([]), "poses.csv")


@pytest.mark.parametrize("with_imu", [False, True])
def test_a_walk_has_no_finding(with_imu: bool) -> None:
    assert findings(walked(), measured(walked()) if with_imu else None) == []


def x_and_y_exchanged(poses: FloatArray) -> FloatArray:
    return poses[:, (1, 0, 2, 3, 4, 5, 6)]


@pytest.mark.parametrize("with_imu", [False, True])
@pytest.mark.parametrize(
    ("change", "name"),
    [
        (x_and_y_exchanged, "x and y of the positions are exchanged"),
        (inverted, "poses map the world to the camera"),
        (exchanged, "y and z are exchanged"),
        (z_up, "the z axis points up"),
        (left_handed, "the frame is left-handed"),
        (in_millimetres, "lengths are in millimetres"),
    ],
)
def test_another_convention_is_named(change: Poses, name: str, with_imu: bool) -> None:
    (finding,) = findings(change(walked()), measured(walked()) if with_imu else None)
    assert finding.kind == "pose_convention"
    assert name in finding.message
    # Without an IMU, a camera that looks back may also be carried so.
    harmless = change is left_handed and not with_imu
    assert finding.severity == (Severity.WARNING if harmless else Severity.ERROR)


def test_quaternions_in_another_order_are_named_by_the_imu() -> None:
    poses = walked()
    (finding,) = findings(np.column_stack((poses[:, :3], poses[:, (6, 3, 4, 5)])), measured(poses))
    assert "quaternions begin with the real part w" in finding.message


def test_a_staircase_has_no_finding() -> None:
    poses = walked()
    poses[:, 0] *= 0.3
    poses[:, 2] *= 0.3
    way = np.cumsum(np.linalg.norm(np.gradient(poses[:, (0, 2)], axis=0), axis=1))
    poses[:, 1] += 0.55 * np.abs((way + 9) % 18 - 9)
    assert findings(poses) == []


def test_jumps_that_no_convention_explains_are_a_warning() -> None:
    poses = walked()
    poses[:, 0] += 8 * (np.floor(TIME_S / 0.5) % 2)
    (finding,) = findings(poses)
    assert (finding.kind, finding.severity) == ("implausible_poses", Severity.WARNING)


def test_short_walks_are_not_judged() -> None:
    (finding,) = findings(inverted(walked()) * (0.001, 0.001, 0.001, 1, 1, 1, 1))
    assert (finding.kind, finding.severity) == ("poses_not_judged", Severity.INFO)


def led(step_m: FloatArray) -> FloatArray:
    """A walk that is led by steps (n, 3) in metres, looking where it goes or where it went last."""
    yaw = np.arctan2(-step_m[:, 0], -step_m[:, 2])
    turn = Rotation.from_euler("YX", np.column_stack((yaw, np.full(len(yaw), np.radians(-25)))))
    return np.column_stack((np.cumsum(step_m, axis=0), turn.as_quat()))


@pytest.mark.parametrize("rise", [0.55, 0.75])
def test_straight_stairs_and_back_have_no_finding(rise: float) -> None:
    way = np.where(TIME_S < 60, 1.0, -1.0)
    assert findings(led(np.column_stack((0.5 * way, rise * way, 1e-9 * way)) / 30)) == []


def test_a_lift_ride_has_no_finding() -> None:
    ahead, up = (TIME_S < 20) | (TIME_S > 100), (TIME_S > 40) & (TIME_S < 90)
    heading = np.where(TIME_S < 50, 0.1, 1.8)
    step = np.column_stack((ahead * np.sin(heading), 1.5 * up, ahead * np.cos(heading))) + 1e-9
    assert findings(led(step / 30)) == []


@pytest.mark.parametrize("speed", [4.3, 5.0, 6.5])
def test_vehicles_are_at_most_a_warning(speed: float) -> None:
    poses = walked()
    poses[:, :3] *= speed / 1.38
    found = findings(poses)
    assert {each.severity for each in found} <= {Severity.WARNING}


def test_vehicles_on_surveyed_floors_are_not_taken_for_feet() -> None:
    log, landmarks = seen_at([10, 20, 30, 50, 70])
    (finding,) = pose_findings(camera_of(walked(), slower=0.25), log, landmarks, "poses.csv")
    assert finding.kind == "implausible_poses"


@pytest.mark.parametrize("speed", [0.4, 1.0, 1.4])
def test_feet_are_named_by_the_distances_between_landmarks(speed: float) -> None:
    camera = camera_of(walked() / (0.3048, 0.3048, 0.3048, 1, 1, 1, 1), slower=1.38 / speed)
    log, landmarks = seen_at([10, 20, 30, 50, 70])
    (finding,) = pose_findings(camera, replace(log, position_acs=log.position_acs / 0.3048), landmarks, "poses.csv")
    assert finding.severity == Severity.ERROR
    assert "lengths are in feet" in finding.message


def test_jumps_of_the_tracker_between_landmarks_have_no_finding() -> None:
    poses = walked()
    poses[:, 0] += 60 * np.floor(TIME_S / 15)
    log, landmarks = seen_at([10, 20, 35, 50, 70])
    assert (
        pose_findings(camera_of(poses), replace(log, position_acs=poses[log.frame, :3]), landmarks, "poses.csv") == []
    )


def test_stop_and_go_has_no_finding() -> None:
    poses = walked()
    index = np.where((TIME_S % 40) < 3, (TIME_S // 40) * 90 + (TIME_S % 40) * 30, (TIME_S // 40 + 1) * 90).astype(int)
    still = poses[index]
    still[:, :3] += np.random.default_rng(1).normal(0, 2e-4, (len(still), 3))
    assert findings(still) == []


def test_a_phone_turned_on_the_way_has_no_finding_with_an_imu() -> None:
    poses = walked()
    upright = Rotation.from_euler("z", np.where(TIME_S < 60, 0, 90)[:, None], degrees=True)
    poses[:, 3:] = (Rotation.from_quat(poses[:, 3:]) * upright).as_quat()
    assert findings(poses, measured(poses)) == []


@settings(deadline=None)
@given(st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_reading_the_order_of_a_quaternion_four_times_is_reading_it_once(numbers: list[float]) -> None:
    quaternion = np.array([numbers]) / np.linalg.norm(numbers)
    poses = ThinnedPoses(np.zeros(1), np.zeros((1, 3)), matrices(quaternion))
    (order,) = [each for each in CONVENTIONS if "quaternions" in each.name]
    for _ in range(4):
        poses = order.read(poses)
    assert np.allclose(poses.rotation, Rotation.from_quat(quaternion).as_matrix(), atol=1e-7)


@pytest.mark.parametrize(("away_m", "severity"), [(8.0, None), (15.0, Severity.WARNING), (40.0, Severity.ERROR)])
def test_landmarks_seen_from_afar_may_be_large(away_m: float, severity: Severity | None) -> None:
    log, landmarks = seen_at([10, 20, 30, 50, 70])
    above = replace(log, position_acs=log.position_acs + np.array((0, away_m, 0)))
    found = pose_findings(camera_of(walked()), above, landmarks, "poses.csv")
    assert [each.severity for each in found] == ([] if severity is None else [severity])


def test_a_few_landmarks_that_would_be_near_if_inverted_are_an_error() -> None:
    """Two of five lie near the tracker's origin, where inverting moves them little."""
    poses = walked()
    poses[:, (0, 2)] += poses[0, (0, 2)] * -1
    log, landmarks = seen_at([0.1, 1, 15, 20, 25])
    inverse = replace(log, position_acs=-poses[log.frame, :3])
    (finding,) = pose_findings(camera_of(poses), inverse, landmarks, "poses.csv")
    assert (finding.kind, finding.severity) == ("far_landmarks", Severity.ERROR)
