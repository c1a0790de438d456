"""The storey of each frame, by its height.

Height and floor of every frame on hand-made walks whose truth is known.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.walks import camera_on, landmarks_at, log_of, rows_of_log
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.context import PressureLog, Storeys, ToldFloors
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks
from vislam2tag.estimation.heights import estimate_heights, floor_of_heights, vertical_span_m
from vislam2tag.estimation.settings import HeightSettings

LEVELS = np.array([0.0, 3.5, 7.5])


@given(st.lists(st.floats(-5, 15), min_size=1, max_size=60), st.integers(0, 2))
def test_decided_heights_get_the_nearest_storey_and_others_a_neighbour(heights: list[float], start: int) -> None:
    height = np.array(heights)
    floor = floor_of_heights(height + 1.4, LEVELS, 1.4, start)
    apart = np.abs(height[:, None] - LEVELS)
    nearest = apart.argmin(axis=1)
    undecided = np.diff(np.sort(apart, axis=1)[:, :2], axis=1)[:, 0] < 2 * 0.5 + 1e-9
    assert np.array_equal(floor[~undecided], nearest[~undecided])
    assert set(floor.tolist()) <= {0, 1, 2}


def test_hovering_about_the_middle_changes_nothing() -> None:
    height = 1.4 + 1.75 + 0.2 * np.sin(np.arange(300))
    assert set(floor_of_heights(height, LEVELS, 1.4, 0).tolist()) == {0}
    assert set(floor_of_heights(height, LEVELS, 1.4, 1).tolist()) == {1}


def test_storeys_may_come_in_any_order() -> None:
    floor = floor_of_heights(np.array([1.4, 4.9, 8.9]), LEVELS[[2, 0, 1]], 1.4, 1)
    assert floor.tolist() == [1, 2, 0]


STOREY_M = 4.0
HUNG_M = {"a": 1.5, "b": 1.3, "c": 1.6, "d": 1.2}
STATIONS = {"a": (5.0, 1.0), "b": (15.0, 1.0), "c": (45.0, 1.0), "d": (55.0, 1.0)}
"""Landmarks along a walk of 60 m: two on floor 0, then 20 m without any, then two on floor 1."""


def walk_of(
    rise: FloatArray,
    tracked: FloatArray,
    lost: BoolArray | None = None,
    elevations: tuple[float, float] = (0.0, STOREY_M),
) -> tuple[CameraTrack, LandmarkLog, Landmarks]:
    """A walk at 3 cm a frame along x; camera truly at 1.4 m + ``rise``, the tracker says 1.4 m + ``tracked``.

    Landmarks are logged as the tracker has them when nearer than 2 m, and stay there.
    """
    n = len(rise)
    plane = np.column_stack((np.arange(n) * 0.03, np.zeros(n)))
    camera = camera_on(plane)
    camera.position_acs[:, 1] = 1.4 + tracked
    acs = {}
    for name, station in STATIONS.items():
        true_z = HUNG_M[name] + (STOREY_M if name in "cd" else 0.0)
        near = np.hypot(plane[:, 0] - station[0], 1.0) < 2
        logged = true_z - rise + tracked + 1e-6 * np.arange(n)
        first, last = np.flatnonzero(near)[[0, -1]]
        logged[last:] = logged[last]
        position = np.column_stack((np.full(n, station[0]), logged, np.full(n, -station[1])))
        position[:first] = np.nan
        acs[name] = position
    landmarks = replace(
        landmarks_at(STATIONS),
        floor=np.array([0, 0, 1, 1]),
        z_m=np.array([HUNG_M[name] for name in STATIONS]),
        storeys=Storeys(0, np.array([0, 1]), np.array(elevations)),
    )
    return camera, log_of(camera, acs, lost), landmarks


def ramp(n: int, start: int, stop: int, height: float) -> FloatArray:
    return np.interp(np.arange(n), (start, stop), (0.0, height))


N = 2000
STAIRS = ramp(N, 800, 1200, STOREY_M)


def test_stairs_give_height_and_one_change_of_floor_half_way_up() -> None:
    camera, log, landmarks = walk_of(STAIRS, STAIRS)
    heights = estimate_heights(camera, log, landmarks)
    assert np.abs(heights.z_m - (1.4 + STAIRS)).max() < 0.05
    (change,) = np.flatnonzero(np.diff(heights.floor))
    assert abs(change - 1000) < 30
    assert heights.floor[0] == 0
    assert heights.floor[-1] == 1


def test_drift_is_taken_out_by_the_landmarks() -> None:
    drift = 0.4 * np.arange(N) / N
    camera, log, landmarks = walk_of(STAIRS, STAIRS + drift)
    heights = estimate_heights(camera, log, landmarks)
    assert np.abs(heights.z_m - (1.4 + STAIRS)).max() < 0.15


def test_a_common_shift_of_camera_and_landmarks_changes_nothing() -> None:
    camera, log, landmarks = walk_of(STAIRS, STAIRS)
    before = estimate_heights(camera, log, landmarks)
    camera.position_acs[1500:, 1] += 0.08
    log.position_acs[log.frame >= 1500, 1] += 0.08
    after = estimate_heights(camera, log, landmarks)
    assert np.abs(after.z_m - before.z_m).max() < 0.005


def test_a_jump_of_the_camera_alone_is_no_climb() -> None:
    flat = np.zeros(N)
    jump = np.where(np.arange(N) >= 1000, 5.0, 0.0)
    camera, log, landmarks = walk_of(flat, jump)
    heights = estimate_heights(camera, log.select([0, 1]), landmarks)
    assert np.abs(np.diff(heights.z_m)).max() < 0.05
    assert set(heights.floor.tolist()) == {0}


def test_a_floor_that_the_walker_told_counts_where_no_landmark_of_it_is_seen() -> None:
    camera, log, landmarks = walk_of(STAIRS, STAIRS)
    below = log.select([log.ids.index(name) for name in "ab"])
    told = replace(camera, told_floors=ToldFloors(camera.time_ns[[1400]], np.array([1])))
    heights = estimate_heights(told, below, landmarks)
    (change,) = np.flatnonzero(np.diff(heights.floor))
    assert abs(change - 1000) < 60
    assert np.abs(heights.z_m - (1.4 + STAIRS)).max() < 0.5


def test_a_lift_ride_is_found_by_the_floor_that_the_walker_told_after_it() -> None:
    rise, camera, log, landmarks = _ride()
    below = log.select([log.ids.index(name) for name in "ab"])
    assert set(estimate_heights(camera, below, landmarks).floor.tolist()) == {0}
    told = replace(camera, told_floors=ToldFloors(camera.time_ns[[1400]], np.array([1])))
    heights = estimate_heights(told, below, landmarks)
    assert heights.floor[1000] == 0
    assert heights.floor[1400] == 1
    assert np.abs(heights.z_m[1400:] - (1.4 + rise[1400:])).max() < 0.5


def _ride() -> tuple[FloatArray, CameraTrack, LandmarkLog, Landmarks]:
    """Five seconds of ten, standing in a lift at x = 30 m, go up; the tracker sees nothing of it."""
    rise = ramp(N + 300, 1075, 1225, STOREY_M)
    camera, log, landmarks = walk_of(rise, np.zeros(N + 300))
    camera.position_acs[:, 0] -= np.interp(np.arange(N + 300), (1000, 1300), (0.0, 9.0))
    log.position_acs[log.position_acs[:, 0] > 30.0, 0] -= 9.0
    return rise, camera, log, landmarks


@pytest.mark.parametrize("elevations", [(0.0, STOREY_M), (np.nan, np.nan)])
def test_a_ride_in_a_lift_is_put_where_the_walker_stood(elevations: tuple[float, float]) -> None:
    rise, camera, log, landmarks = _ride()
    landmarks = replace(landmarks, storeys=Storeys(0, np.array([0, 1]), np.array(elevations)))
    heights = estimate_heights(camera, log, landmarks)
    (change,) = np.flatnonzero(np.diff(heights.floor))
    assert 1000 < change < 1300
    if np.isnan(elevations[0]):
        assert np.isnan(heights.z_m).all()
    else:
        assert np.abs(heights.z_m - (1.4 + rise)).max() < 0.3


def test_pressure_tells_of_a_ride_without_any_landmark_after_it() -> None:
    rise, camera, log, landmarks = _ride()
    log = log.select([0, 1])
    time_ns = camera.time_ns[0] + np.arange(0, 76 * 10**9, 10**8)
    seconds = (time_ns - camera.time_ns[0]) * 1e-9
    height = np.interp(seconds, (camera.time_ns - camera.time_ns[0]) * 1e-9, rise)
    hpa = 1002.0 * (1 - height / 44330.77) ** (1 / 0.190263) + np.random.default_rng(0).normal(0, 0.02, len(height))
    without = estimate_heights(camera, log, landmarks)
    assert set(without.floor.tolist()) == {0}
    heights = estimate_heights(replace(camera, pressure=PressureLog(time_ns, hpa)), log, landmarks)
    assert np.abs(heights.z_m - (1.4 + rise)).max() < 0.4
    (change,) = np.flatnonzero(np.diff(heights.floor))
    assert abs(change - 1150) < 45


def test_a_wrong_sighting_does_not_bend_the_walk() -> None:
    camera, log, landmarks = walk_of(STAIRS, STAIRS)
    rows = log.rows_of(1)
    log.position_acs[rows, 1] += 2.5
    heights = estimate_heights(camera, log, landmarks)
    assert np.abs(heights.z_m - (1.4 + STAIRS)).max() < 0.3


def test_unsurveyed_heights_of_landmarks_do() -> None:
    camera, log, landmarks = walk_of(STAIRS, STAIRS)
    heights = estimate_heights(camera, log, replace(landmarks, z_m=np.full(4, np.nan)))
    assert np.abs(heights.z_m - (1.4 + STAIRS)).max() < 0.3
    assert len(np.flatnonzero(np.diff(heights.floor))) == 1


def test_without_elevations_floors_are_told_and_heights_are_not() -> None:
    camera, log, landmarks = walk_of(STAIRS, STAIRS, elevations=(np.nan, np.nan))
    heights = estimate_heights(camera, log, landmarks)
    assert np.isnan(heights.z_m).all()
    (change,) = np.flatnonzero(np.diff(heights.floor))
    assert abs(change - 1000) < 60


def test_bobbing_on_a_landing_half_way_up_is_no_flicker() -> None:
    landing = np.interp(np.arange(N), (800, 900, 1100, 1200), (0.0, 2.0, 2.0, 4.0))
    bobbing = landing + 0.03 * np.sin(np.arange(N))
    heights = estimate_heights(*walk_of(bobbing, bobbing))
    assert len(np.flatnonzero(np.diff(heights.floor))) == 1


def test_one_floor_is_the_sessions_own_at_all_frames() -> None:
    camera, log, landmarks = walk_of(STAIRS, STAIRS)
    one = replace(landmarks, floor=np.full(4, 7), storeys=Storeys(7, np.array([7]), np.array([12.0])))
    heights = estimate_heights(camera, log, one)
    assert set(heights.floor.tolist()) == {7}
    assert abs(float(heights.z_m[0]) - 13.4) < 0.6
    assert heights.z_m[-1] - heights.z_m[0] == pytest.approx(STOREY_M, abs=0.3)


def test_no_storeys_no_heights() -> None:
    camera, log, landmarks = walk_of(STAIRS, STAIRS)
    heights = estimate_heights(camera, log, replace(landmarks, storeys=None))
    assert len(heights.floor) == 0
    assert np.isnan(heights.z_m).all()


def test_frames_that_cannot_be_used_have_no_height_but_a_floor() -> None:
    camera, log, landmarks = walk_of(STAIRS, STAIRS)
    camera.status[[0, 1500]] = 10
    heights = estimate_heights(camera, rows_of_log(log, ~np.isin(log.frame, (0, 1500))), landmarks)
    assert np.isnan(heights.z_m[[0, 1500]]).all()
    assert heights.floor[[0, 1500]].tolist() == [0, 1]


@pytest.mark.parametrize(("frames", "height_m"), [(0, []), (1, [np.nan]), (2, [4.4, 4.4])])
def test_tiny_sessions_pass_and_one_frame_has_no_height(frames: int, height_m: list[float]) -> None:
    camera = camera_on(np.zeros((frames, 2)))
    landmarks = replace(landmarks_at(STATIONS), storeys=Storeys(0, np.array([0]), np.array([3.0])))
    heights = estimate_heights(camera, _empty_log(), landmarks)
    assert heights.z_m == pytest.approx(np.array(height_m), nan_ok=True)
    assert heights.floor.tolist() == [0] * frames


def _empty_log() -> LandmarkLog:
    none = np.empty(0, dtype=np.int64)
    return LandmarkLog((), none, none, np.empty((0, 3)), np.empty((0, 4)), np.empty(0, dtype=bool))


def test_span_is_the_climb_without_the_jumps() -> None:
    jumps = STAIRS + np.where((np.arange(N) > 300) & (np.arange(N) < 400), 30.0, 0.0)
    camera, log, _ = walk_of(STAIRS, jumps)
    assert vertical_span_m(camera, log) == pytest.approx(STOREY_M, abs=0.1)


def test_a_phone_may_be_carried_higher_where_nothing_tells_its_height() -> None:
    camera, log, landmarks = walk_of(STAIRS, STAIRS)
    unmeasured = replace(landmarks, z_m=np.full(4, np.nan))
    usual, high = (
        estimate_heights(camera, log, unmeasured, settings) for settings in (None, HeightSettings(carried_m=1.8))
    )
    np.testing.assert_allclose(high.z_m - usual.z_m, 0.4, atol=0.02)
    np.testing.assert_array_equal(high.floor, usual.floor)
