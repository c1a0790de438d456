"""The tracker's vertical axis made continuous."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.walks import camera_on, log_of
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.estimation.odometry import continuous_odometry
from vislam2tag.estimation.vertical import VerticalTrack, vertical_track

N = 400
STAIRS = np.interp(np.arange(N), (100, 300), (0.0, 3.0))


def walked(
    camera_m: FloatArray, landmark_m: FloatArray, lost: tuple[int, int] = (0, 0)
) -> tuple[CameraTrack, LandmarkLog]:
    """A walk with these logged heights of the camera (n,) and of two landmarks (n,)."""
    camera = camera_on(np.column_stack((np.arange(N) * 0.03, np.zeros(N))))
    camera.position_acs[:, 1] = camera_m
    place = np.column_stack((np.full(N, 50.0), landmark_m, np.zeros(N)))
    gone = (np.arange(N) >= lost[0]) & (np.arange(N) < lost[1])
    return camera, log_of(camera, {"a": place, "b": place + np.array((1.0, 0.3, 0.0))}, gone)


def track_of(camera: CameraTrack, log: LandmarkLog) -> VerticalTrack:
    return vertical_track(camera, log, continuous_odometry(camera, log))


def test_stairs_stay_as_they_are() -> None:
    track = track_of(*walked(STAIRS, np.zeros(N)))
    assert track.height_m == pytest.approx(STAIRS)
    assert not track.shift_m.any()
    assert np.all(np.diff(track.variance_m2) > 0)


@given(st.integers(20, N - 20), st.floats(-30, 30))
def test_a_step_that_all_landmarks_make_is_taken_out_and_costs_nothing(frame: int, size_m: float) -> None:
    step = np.where(np.arange(N) >= frame, size_m, 0.0)
    track = track_of(*walked(STAIRS + step, step))
    assert track.height_m == pytest.approx(STAIRS, abs=0.04)
    assert track.variance_m2[-1] < 0.105**2


@given(st.integers(20, N - 20), st.floats(0.5, 30), st.sampled_from((-1, 1)))
def test_a_jump_of_the_camera_alone_is_replaced_and_frees_the_height(frame: int, size_m: float, sign: int) -> None:
    jump = np.where(np.arange(N) >= frame, sign * size_m, 0.0)
    track = track_of(*walked(STAIRS + jump, np.zeros(N)))
    assert track.height_m == pytest.approx(STAIRS, abs=0.05)
    gained = np.sqrt(np.diff(track.variance_m2))
    assert int(np.argmax(gained)) == frame - 1
    assert gained.max() == pytest.approx(min(size_m, 2.0), abs=0.05)


def test_while_tracking_is_lost_the_height_may_change() -> None:
    sure = track_of(*walked(STAIRS, np.zeros(N)))
    lost = track_of(*walked(STAIRS, np.zeros(N), lost=(150, 240)))
    gained = np.sqrt(lost.variance_m2[-1] - sure.variance_m2[-1])
    assert gained == pytest.approx(0.2 * 3.0, abs=0.05)


def test_speed_leaves_jumps_out() -> None:
    camera, log = walked(STAIRS, np.zeros(N))
    camera.position_acs[200:, 0] += 20.0
    assert track_of(camera, log).speed_m_s[50:-50] == pytest.approx(0.9, abs=0.05)


def test_frames_that_cannot_be_used_are_left_out() -> None:
    camera, log = walked(STAIRS, np.zeros(N))
    camera.status[150] = 10
    camera.position_acs[150, 1] = np.nan
    keep = log.frame != 150
    track = track_of(
        camera,
        LandmarkLog(
            log.ids,
            log.landmark[keep],
            log.frame[keep],
            log.position_acs[keep],
            log.orientation_acs[keep],
            log.lost[keep],
        ),
    )
    assert 150 not in track.frame
    assert track.height_m == pytest.approx(np.delete(STAIRS, 150))
