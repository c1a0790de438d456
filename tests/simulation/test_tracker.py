"""The tracker: faithful at severity none, faults of each kind as the raw files show them, anchors on its map."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import AnchorLog
from vislam2tag.core.tracks import to_plane
from vislam2tag.core.transforms import Similarity2, as_complex, camera_to_bcs
from vislam2tag.simulation.building import make_building
from vislam2tag.simulation.model import MapMotion, TrackerLog, TrueWalk, orientation_at, position_at
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings, TrackerSettings, WalkStyle, stream, walk_settings
from vislam2tag.simulation.survey import walk_and_track
from vislam2tag.simulation.tracker import APART_M, FOLLOWED, set_anchors, track
from vislam2tag.simulation.walk import make_walk

FLOOR = make_building(BuildingSettings(landmarks=14), 3, (4,)).floors[0]


@cache
def true_walk(duration_s: float = 180.0, runs: int = 0, people: int = 0) -> TrueWalk:
    return make_walk(FLOOR, duration_s, walk_settings(WalkStyle.SURVEY, runs, people), stream(1, "walk"))


def logged(severity: float, quantile: float, walk: TrueWalk | None = None, seed: int = 2) -> TrackerLog:
    return track(walk or true_walk(), FLOOR, TrackerSettings(severity=severity), stream(seed, "tracker"), quantile)


def survey_rows(log: TrackerLog) -> IntArray:
    """Index on the floor of each landmark row's sheet."""
    return np.array([FLOOR.landmark_ids.index(name) for name in log.landmarks.ids])[log.landmarks.landmark]


def bcs_from_acs(log: TrackerLog) -> Similarity2:
    return Similarity2.fit(log.landmarks.plane_acs, FLOOR.landmark_position[survey_rows(log), :2])


def test_perfect_tracker_agrees_with_truth() -> None:
    log, walk = logged(0.0, 0.99), true_walk()
    assert log.events == ()
    assert not log.landmarks.lost.any()
    bcs_t_acs = bcs_from_acs(log)
    assert bcs_t_acs.scale == pytest.approx(1.0, abs=1e-3)
    sheets = FLOOR.landmark_position[survey_rows(log)]
    residual = np.linalg.norm(bcs_t_acs @ log.landmarks.plane_acs - sheets[:, :2], axis=1)
    assert residual.max() < 0.05
    true = position_at(walk, log.exposure_ns)
    assert np.linalg.norm(bcs_t_acs @ to_plane(log.position_acs) - true[:, :2], axis=1).max() < 0.03
    height = log.landmarks.position_acs[:, 1] - log.position_acs[log.landmarks.frame, 1]
    np.testing.assert_allclose(height, sheets[:, 2] - true[log.landmarks.frame, 2], atol=0.05)


def test_perfect_tracker_orientations() -> None:
    log, walk = logged(0.0, 0.5), true_walk()
    rotation = bcs_from_acs(log).rotation_rad
    turned = Rotation.from_quat(camera_to_bcs(log.orientation_acs, rotation))
    off = (turned.inv() * Rotation.from_quat(orientation_at(walk, log.exposure_ns))).magnitude()
    assert off.max() < 0.005
    sheet = Rotation.from_quat(log.landmarks.orientation_acs)
    right, out, down = (sheet.apply(axis) for axis in np.eye(3))
    heading = np.arctan2(-right[:, 2], right[:, 0]) + rotation
    expected = FLOOR.landmark_heading_rad[survey_rows(log)]
    assert np.abs(np.angle(np.exp(1j * (heading - expected)))).max() < 0.005
    np.testing.assert_allclose(down, np.broadcast_to([0.0, -1.0, 0.0], down.shape), atol=1e-9)
    to_camera = log.position_acs[log.landmarks.frame] - log.landmarks.position_acs
    first = np.unique(log.landmarks.landmark, return_index=True)[1]
    assert np.all((out * to_camera).sum(axis=1)[first] > 0)


def test_frames_and_stamps() -> None:
    log = logged(1.0, 0.9)
    settings = TrackerSettings()
    assert np.all(np.diff(log.time_ns) > 0)
    assert np.median(np.diff(log.time_ns)) / 1e9 == pytest.approx(1 / settings.frame_rate_hz, rel=0.02)
    lag = (log.time_ns - log.exposure_ns) / 1e9
    assert np.median(lag) == pytest.approx(settings.pose_lag_s, abs=1e-3)
    assert log.time_ns[-1] <= true_walk().time_ns[-1]
    np.testing.assert_allclose(np.linalg.norm(log.orientation_acs, axis=1), 1.0)


def test_landmark_rows_run_from_the_first_sighting_to_the_end() -> None:
    log = logged(1.0, 0.9).landmarks
    frames = len(logged(1.0, 0.9).time_ns)
    firsts = []
    for index in range(len(log.ids)):
        own = log.frame[log.rows_of(index)]
        np.testing.assert_array_equal(own, np.arange(own[0], frames))
        firsts.append(own[0])
    assert firsts == sorted(firsts)
    assert firsts[0] >= 30


def test_lost_frames_repeat_the_camera_exactly() -> None:
    log = logged(1.0, 0.9)
    marks = log.landmarks
    assert marks.lost.any()
    same = np.all(marks.position_acs == log.position_acs[marks.frame], axis=1)
    np.testing.assert_array_equal(same, marks.lost)
    np.testing.assert_array_equal(marks.orientation_acs[same], log.orientation_acs[marks.frame[same]])
    by_frame = np.bincount(marks.frame[marks.lost]), np.bincount(marks.frame)
    lost_frames = np.flatnonzero(by_frame[0])
    np.testing.assert_array_equal(by_frame[0][lost_frames], by_frame[1][lost_frames])
    events = [event.frame for event in log.events if event.kind in ("lost", "found")]
    assert len(events) >= 2


def test_people_in_the_view_lose_tracking() -> None:
    walk = true_walk(180.0, 0, 1)
    log = logged(1.0, 0.6, walk)
    start = int(np.searchsorted(log.exposure_ns, walk.blocked_ns[0, 0]))
    assert any(event.kind == "lost" and abs(event.frame - start) < 5 for event in log.events)


def steps_of(log: TrackerLog, frame: int) -> tuple[float, FloatArray]:
    """Step of the camera and of each known landmark from the frame before to this one, metres."""
    before, after = (log.landmarks.position_acs[log.landmarks.frame == f] for f in (frame - 1, frame))
    camera = float(np.linalg.norm(log.position_acs[frame] - log.position_acs[frame - 1]))
    return camera, np.linalg.norm(after[: len(before)] - before, axis=1)


def test_a_break_moves_only_the_camera() -> None:
    log = logged(1.0, 0.9, true_walk(180.0, 1, 0))
    broken = [event for event in log.events if event.kind == "break"]
    assert broken
    for event in broken:
        camera, landmarks = steps_of(log, event.frame)
        assert camera == pytest.approx(event.size_m, abs=0.3)
        assert landmarks.max() < 0.1


def test_a_map_update_keeps_what_is_relative() -> None:
    log = logged(1.0, 0.8)
    far = [event for event in log.events if event.kind == "map_update" and event.size_m > 10]
    assert far
    camera, landmarks = steps_of(log, far[0].frame)
    assert camera > 10
    assert landmarks.min() > 5
    spans = []
    for frame in (far[0].frame - 1, far[0].frame):
        known = log.landmarks.frame == frame
        spans.append(np.linalg.norm(log.landmarks.position_acs[known] - log.position_acs[frame], axis=1))
    np.testing.assert_allclose(spans[0], spans[1], atol=0.1)


def test_a_loop_correction_moves_landmarks_unevenly() -> None:
    log = logged(1.0, 0.3, true_walk(600.0))
    corrected = [event for event in log.events if event.kind == "loop_correction" and event.size_m > 0.15]
    assert corrected
    moved = [steps_of(log, event.frame)[1] for event in corrected]
    assert any(np.ptp(steps) > 0.02 for steps in moved)


def test_the_better_half_sees_no_faults() -> None:
    kinds = {event.kind for event in logged(1.0, 0.3).events}
    assert not kinds & {"lost", "break"}


def tracked(severity: str, seed: int) -> tuple[TrackerLog, MapMotion]:
    scenario = regular_survey(seed, severity, (0,), ("LG",), 1, 120.0)
    _, tracker = walk_and_track(scenario, scenario.sessions[0])
    assert tracker.motion is not None
    return tracker, tracker.motion


@pytest.fixture(scope="module", params=[("none", 3), ("severe", 4)], ids=["none", "severe"])
def walk(request: pytest.FixtureRequest) -> tuple[TrackerLog, MapMotion, AnchorLog]:
    tracker, motion = tracked(*request.param)
    return tracker, motion, set_anchors(tracker, motion, stream(1, "anchors"))


def test_an_anchor_is_set_at_the_camera_as_soon_as_it_is_far_from_the_newest(
    walk: tuple[TrackerLog, MapMotion, AnchorLog],
) -> None:
    tracker, motion, log = walk
    camera = tracker.position_acs.astype(np.float32)
    first = [int(log.frame[log.anchor == number].min()) for number in np.unique(log.anchor)]
    assert len(first) > 5
    for number, (start, stop) in enumerate(zip(first, [*first[1:], len(camera)], strict=True)):
        rows = (log.anchor == number) & (log.frame < stop)
        assert log.frame[rows].tolist() == list(range(start, stop))
        np.testing.assert_array_equal(log.position_acs[rows][0], camera[start])
        apart = np.linalg.norm(log.position_acs[rows] - camera[start:stop], axis=1)
        assert (apart[~motion.lost[start:stop]] < APART_M).all()
        assert not motion.lost[start]


def test_the_newest_are_followed(walk: tuple[TrackerLog, MapMotion, AnchorLog]) -> None:
    _, _, log = walk
    for frame in np.unique(log.frame)[::200].tolist():
        here = np.sort(log.anchor[log.frame == frame])
        assert here.tolist() == list(range(max(0, here[-1] - FOLLOWED + 1), here[-1] + 1))


def test_anchors_stand_still_on_a_faultless_walk() -> None:
    tracker, motion = tracked("none", 3)
    log = set_anchors(tracker, motion, stream(1, "anchors"))
    same = log.anchor[1:] == log.anchor[:-1]
    np.testing.assert_allclose(np.diff(log.position_acs, axis=0)[same], 0, atol=1e-5)


def test_a_map_update_moves_anchors_with_camera_and_landmarks() -> None:
    tracker, motion = tracked("default", 11)
    log = set_anchors(tracker, motion, stream(1, "anchors"))
    updates = [event.frame for event in tracker.events if event.kind == "map_update"]
    disturbed = {carry.frame for carry in motion.carries}
    compared = 0
    for frame in (
        frame for frame in updates if frame not in disturbed and not motion.lost[frame - 1 : frame + 1].any()
    ):
        ratio = motion.factor[frame] / motion.factor[frame - 1]
        before, after = (log.frame == frame - 1, log.frame == frame)
        both = np.intersect1d(log.anchor[before], log.anchor[after])
        old, new = (
            as_complex(to_plane(log.position_acs[rows & np.isin(log.anchor, both)])) for rows in (before, after)
        )
        moved = ratio * (old - motion.shift[frame - 1]) + motion.shift[frame]
        np.testing.assert_allclose(new, moved, atol=1e-4)
        compared += len(both)
    assert compared > 0
