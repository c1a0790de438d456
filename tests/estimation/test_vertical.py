"""The tracker's vertical axis made continuous.

Rides that the tracker does not see.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.walks import camera_on, log_of, rows_of_log
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import PressureLog
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.estimation.odometry import continuous_odometry
from vislam2tag.estimation.vertical import (
    VerticalTrack,
    altitude_m,
    still_stretches,
    vertical_track,
    with_rides_by_landmarks,
    with_rides_by_pressure,
)

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
    track = track_of(camera, rows_of_log(log, log.frame != 150))
    assert 150 not in track.frame
    assert track.height_m == pytest.approx(np.delete(STAIRS, 150))


TIME_S = np.arange(0, 100, 0.1)
TIME_NS = (TIME_S * 1e9).astype(np.int64)
STILL = ((20.0, 23.0), (50.0, 62.0))


def level(speed: FloatArray | None = None) -> VerticalTrack:
    """A walk of which the tracker sees no vertical motion; it stands still twice."""
    still = np.any([np.abs(TIME_S - (start + stop) / 2) <= (stop - start) / 2 for start, stop in STILL], axis=0)
    n = len(TIME_S)
    walking = np.where(still, 0.0, 1.0) if speed is None else speed
    return VerticalTrack(np.arange(n), TIME_S, np.zeros(n), np.zeros(n), 1e-4 * TIME_S, walking)


def pressure_of(height: FloatArray, noise_hpa: float = 0.0) -> PressureLog:
    noise = noise_hpa * np.random.default_rng(1).standard_normal(len(height))
    return PressureLog(TIME_NS, 1005.0 * (1 - height / 44330.77) ** (1 / 0.190263) + noise)


def test_altitude_differences_are_heights() -> None:
    height = np.linspace(0, 20, len(TIME_S))
    altitude = altitude_m(pressure_of(height), TIME_NS)
    assert np.diff(altitude[[50, -50]]) == pytest.approx(np.diff(height[[50, -50]]), rel=0.01)


def test_pressure_gives_the_ride_and_leaves_the_rest() -> None:
    height = np.interp(TIME_S, (52, 57), (0, 4.0))
    track = with_rides_by_pressure(level(), TIME_NS, pressure_of(height, 0.02))
    assert np.abs(track.height_m - height).max() < 0.5
    assert not track.height_m[TIME_S < 45].any()
    assert np.sqrt(track.variance_m2[-1]) == pytest.approx(np.sqrt(0.4**2 + 1e-4 * 99.9), abs=0.01)


def test_weather_and_doors_are_no_ride() -> None:
    height = 0.02 * TIME_S + np.where(TIME_S > 40, 0.8, 0.0)
    track = with_rides_by_pressure(level(), TIME_NS, pressure_of(height, 0.02))
    assert not track.height_m.any()


def test_still_stretches_are_those_long_enough() -> None:
    found = TIME_S[still_stretches(level())]
    assert found == pytest.approx(np.array(STILL), abs=0.11)
    assert len(still_stretches(level(np.ones(len(TIME_S))))) == 0


def ridden(track: VerticalTrack, sighted: tuple[int, int], rise_m: float, seen_m: float) -> VerticalTrack:
    return with_rides_by_landmarks(track, np.array([sighted]), np.array([rise_m]), np.array([seen_m]))


def test_landmarks_put_the_ride_into_the_longest_still_stretch_between_them() -> None:
    track = ridden(level(), (100, 900), 4.0, 0.2)
    assert track.height_m[TIME_S < 50].max() == 0.0
    assert track.height_m[TIME_S > 62] == pytest.approx(3.8)
    assert track.height_m[560] == pytest.approx(1.9, abs=0.1)
    before = ridden(level(), (100, 400), -4.0, 0.0)
    assert before.height_m[TIME_S > 23] == pytest.approx(-4.0)
    assert not before.height_m[TIME_S < 20].any()


def test_without_standing_still_the_ride_is_spread_over_the_way() -> None:
    track = ridden(level(np.ones(len(TIME_S))), (100, 110), 4.0, 0.0)
    assert np.ptp(track.height_m[100:111]) == pytest.approx(4.0)
    assert not track.height_m[:100].any()


@pytest.mark.parametrize("seen_m", [2.5, 4.0, 6.0])
def test_a_rise_that_the_tracker_saw_is_no_ride(seen_m: float) -> None:
    assert not ridden(level(), (100, 900), 4.0, seen_m).height_m.any()
