"""The direction of a walk by the rotation vector, for phones whose sensors have other axes than their camera."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.drifting import about_vertical, camera_track
from tests.estimation.floor_plan.plans import RATE_HZ, along, odometry_of
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import InertialLog
from vislam2tag.core.tracks import CameraTrack
from vislam2tag.estimation.floor_plan.compass import compass_turn_rad

PATH = along((0, 20, 20 + 15j, 5 + 15j))
ENU_FROM_ACS = Rotation.from_matrix([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
"""If the tracker's x axis points east: its y axis points up, so z points south."""


def walked(turn_rad: float | FloatArray, quarter: int = 0, away_ns: int = 0) -> CameraTrack:
    """A phone held upright and a little askew, whose tracker is turned by this (n,) to east and north."""
    heading = np.angle(np.gradient(PATH))
    held = Rotation.from_euler("xz", [-0.3, 0.1])
    orientation = Rotation.from_quat(about_vertical(heading)) * held
    camera = camera_track(PATH, np.arange(len(PATH)) / RATE_HZ)
    turned = Rotation.from_rotvec(np.multiply.outer(np.broadcast_to(turn_rad, len(PATH)), [0, 0, 1]))
    device = turned * ENU_FROM_ACS * orientation * Rotation.from_euler("z", -90 * quarter, degrees=True)
    no_ns, nothing = np.empty(0, dtype=np.int64), np.empty((0, 3))
    log = InertialLog(no_ns, nothing, no_ns, nothing, camera.time_ns + away_ns, device.as_quat())
    return replace(camera, orientation_acs=orientation.as_quat(), inertial=log)


@pytest.mark.parametrize("quarter", [0, 1, 2, 3])
@pytest.mark.parametrize("turn_rad", [0.7, -2.9])
def test_the_direction_follows_from_the_rotation_vector(turn_rad: float, quarter: int) -> None:
    camera = walked(turn_rad, quarter)
    assert compass_turn_rad(camera, odometry_of(PATH)) == pytest.approx(turn_rad, abs=1e-6)


def test_turns_of_the_trackers_map_are_taken_out() -> None:
    late = np.arange(len(PATH)) >= 200
    camera = walked(np.where(late, 0.4 - 1.1, 0.4))  # its map turned by 1.1 rad at a jump
    odometry = replace(odometry_of(PATH), turn=np.exp(-1j * np.where(late, 1.1, 0.0)))
    assert compass_turn_rad(camera, odometry) == pytest.approx(0.4, abs=1e-6)


def test_disturbed_readings_are_averaged_around_the_circle() -> None:
    swing = 0.3 * np.sin(np.arange(len(PATH)) / 7)
    found = compass_turn_rad(walked(np.pi - 0.01 + swing), odometry_of(PATH))
    assert found is not None
    assert abs(np.angle(np.exp(1j * (found - np.pi)))) < 0.05


def test_without_readings_the_direction_is_unknown() -> None:
    odometry = odometry_of(PATH)
    camera = walked(0.7)
    assert camera.inertial is not None
    assert compass_turn_rad(replace(camera, inertial=None), odometry) is None
    no_ns, nothing = np.empty(0, dtype=np.int64), np.empty((0, 4))
    silent = replace(camera.inertial, orientation_ns=no_ns, orientation=nothing)
    assert compass_turn_rad(replace(camera, inertial=silent), odometry) is None
    assert compass_turn_rad(walked(0.7, away_ns=10**12), odometry) is None, "readings of another time"


def test_axes_that_do_not_fit_show_no_direction() -> None:
    camera = walked(0.7)
    askew = Rotation.from_quat(camera.orientation_acs) * Rotation.from_euler("x", 50, degrees=True)
    assert compass_turn_rad(replace(camera, orientation_acs=askew.as_quat()), odometry_of(PATH)) is None
