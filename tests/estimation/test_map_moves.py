"""What the tracker says of itself, and the anchors that it holds: how mapping uses them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.drifting import sheet_orientation
from tests.walks import camera_on, log_of, to_acs
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.context import AnchorLog, TrackerState
from vislam2tag.core.status import EventKind
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.transforms import as_points
from vislam2tag.core.visits import frames_without_landmark
from vislam2tag.estimation.map_moves import map_moves
from vislam2tag.estimation.observations import find_passes
from vislam2tag.estimation.odometry import continuous_odometry
from vislam2tag.estimation.steps import lost_frames

FRAMES = 300
UPDATE = 150
SHIFT_M = np.array([0.8, -0.5])


def straight() -> FloatArray:
    return np.column_stack((np.arange(FRAMES) * 0.035, np.zeros(FRAMES)))


def told(tracking: BoolArray, word: str = "NONE") -> TrackerState:
    failure = np.where(tracking, 0, 1)
    return TrackerState(tracking, np.zeros(len(tracking), dtype=np.int64), ("NONE", word), failure)


def anchors_at(places: list[tuple[float, float]], moved: BoolArray, shift_m: FloatArray = SHIFT_M) -> AnchorLog:
    """Anchors at points of the ACS plane, shifted at the frames of a mask."""
    n, frames = len(places), np.arange(len(moved))
    plane = np.concatenate([np.array(place) + moved[:, None] * shift_m for place in places])
    return AnchorLog(
        np.repeat(np.arange(n), len(frames)),
        np.tile(frames, n),
        to_acs(plane, 1.4),
        np.tile([0.0, 0, 0, 1], (n * len(frames), 1)),
    )


def updated() -> tuple[CameraTrack, BoolArray, LandmarkLog]:
    """A straight walk past one landmark, whose map is shifted on the way; far from the landmark."""
    later = np.arange(FRAMES) >= UPDATE
    camera = camera_on(straight() + later[:, None] * SHIFT_M)
    place = np.where(later[:, None], np.array([0.5, 1.0]) + SHIFT_M, np.array([0.5, 1.0]))
    return camera, later, log_of(camera, {"1": to_acs(place, 1.4)})


def test_the_motion_of_the_map_is_the_best_fit_to_what_moved() -> None:
    camera = camera_on(straight())
    later = np.arange(FRAMES) >= UPDATE
    places = np.array([-9.0 + 8.0j, -12.0 + 2.0j, -10.0 + 14.0j])
    ends = (3 - 1j) + np.exp(0.3j) * places
    ends[2] += 0.6 * np.exp(0.3j)  # not quite rigid
    tracks = [np.where(later, end, place) for place, end in zip(places, ends, strict=True)]
    log = log_of(camera, {str(i): to_acs(as_points(track), 1.4) for i, track in enumerate(tracks)})
    moves = map_moves(camera, log, np.zeros(FRAMES - 1, dtype=bool))
    assert np.flatnonzero(moves.moved).tolist() == [UPDATE - 1]
    assert not moves.sighted.any()
    assert moves.points[UPDATE - 1] == 3
    to, by = (np.column_stack((as_points(part - part.mean()), np.zeros(3))) for part in (ends, places))
    rotation, _ = Rotation.align_vectors(to, by)
    turn_rad = rotation.as_rotvec()[2]
    assert np.angle(moves.turn[UPDATE - 1]) == pytest.approx(turn_rad, abs=1e-9)
    carried = moves.carry(np.full(FRAMES - 1, 1 + 1j))[UPDATE - 1]
    assert carried == pytest.approx(ends.mean() + np.exp(1j * turn_rad) * (1 + 1j - places.mean()))
    miss = ends - ends.mean() - np.exp(1j * turn_rad) * (places - places.mean())
    assert moves.misfit_m[UPDATE - 1] == pytest.approx(np.sqrt(np.mean(np.abs(miss) ** 2)))
    assert moves.turn[0] == 1


@pytest.mark.parametrize(("out_of_view", "in_view", "moved"), [(2, 2, True), (2, 3, False), (1, 0, False)])
def test_the_map_moved_where_half_of_what_it_holds_did_out_of_view(out_of_view: int, in_view: int, moved: bool) -> None:
    camera = camera_on(straight())
    later = np.arange(FRAMES) >= UPDATE
    far = {f"far{i}": np.where(later, 2.0, 0.0) - 9 + 6j * i for i in range(out_of_view)}
    near = {f"near{i}": np.full(FRAMES, 5.0 + 0.4j * i) for i in range(in_view)}
    log = log_of(camera, {name: to_acs(as_points(track), 1.4) for name, track in (far | near).items()})
    assert map_moves(camera, log, np.zeros(FRAMES - 1, dtype=bool)).moved[UPDATE - 1] == moved


def test_anchors_tell_a_map_update_that_no_landmark_tells() -> None:
    camera, later, log = updated()
    log = log.rows_kept(log.frame < 0)  # no landmark known at all
    alone = continuous_odometry(camera, log)
    assert [event.kind for event in alone.events if event.kind is not EventKind.LOSS] == [EventKind.BREAK]
    anchors = anchors_at([(0.0, 0.0), (5.0, 0.0)], later)
    with_anchors = continuous_odometry(replace(camera, anchors=anchors), log)
    assert [event.kind for event in with_anchors.events] == [EventKind.MAP_UPDATE]
    assert with_anchors.events[0].frame == UPDATE
    expected = straight() @ [1, 1j]
    np.testing.assert_allclose(with_anchors.path - with_anchors.path[0], expected - expected[0], atol=1e-6)


def test_anchors_that_stay_show_that_the_camera_alone_jumped() -> None:
    camera, later, log = updated()
    log = log.rows_kept(log.frame < UPDATE)
    anchors = anchors_at([(0.0, 0.0), (5.0, 0.0)], np.zeros_like(later))
    odometry = continuous_odometry(replace(camera, anchors=anchors, state=told(np.ones(FRAMES, dtype=bool))), log)
    assert [event.kind for event in odometry.events] == [EventKind.BREAK]


def test_anchors_of_frames_that_do_not_count_are_not_looked_at() -> None:
    camera, later, log = updated()
    status = camera.status.copy()
    status[UPDATE - 1] = 10
    anchors = anchors_at([(0.0, 0.0), (5.0, 0.0)], later)
    moves = map_moves(replace(camera, status=status, anchors=anchors), log, np.zeros(FRAMES - 2, dtype=bool))
    assert np.flatnonzero(moves.moved).tolist() == [UPDATE - 2]


def test_a_landmark_that_is_seen_far_off_does_not_show_a_rewritten_map() -> None:
    """Without the tracker's word two landmarks that change far away do."""
    camera = camera_on(straight())
    wander = np.where(np.arange(FRAMES)[:, None] == UPDATE, 0.02, 0.0)
    acs = {name: to_acs(np.array([60.0, y]) + wander, 1.4) for name, y in (("1", 5.0), ("2", 7.0))}
    log = log_of(camera, acs)
    suspicious = np.zeros(FRAMES - 1, dtype=bool)
    assert map_moves(camera, log, suspicious).moved.any()
    seen = replace(log, seen=np.ones(len(log.frame), dtype=bool))
    assert not map_moves(camera, seen, suspicious).moved.any()


def test_the_tracker_s_word_counts_for_losses_whatever_landmarks_do() -> None:
    camera = camera_on(straight())
    tracking = np.ones(FRAMES, dtype=bool)
    tracking[100:130] = False
    log = log_of(camera, {"1": to_acs(np.where(np.arange(FRAMES)[:, None] < 50, [[0.5, 1.0]], np.nan), 1.4)})
    frames = np.arange(FRAMES)
    assert lost_frames(camera, log, frames)[60:].all()  # nobody logs the landmark any more
    state = told(tracking, "INSUFFICIENT_LIGHT")
    said = replace(camera, state=state)
    np.testing.assert_array_equal(lost_frames(said, log, frames), ~tracking)
    odometry = continuous_odometry(said, log)
    losses = [event for event in odometry.events if event.kind is EventKind.LOSS]
    assert [(event.frame, event.reason) for event in losses] == [(100, "INSUFFICIENT_LIGHT")]


def test_landmarks_that_fall_silent_while_tracking_goes_on_split_nothing() -> None:
    camera = camera_on(straight())
    log = log_of(camera, {"1": to_acs(np.where((np.arange(FRAMES)[:, None] // 50) % 2, [[0.5, 1.0]], np.nan), 1.4)})
    tracking = np.ones(FRAMES, dtype=bool)
    tracking[200:210] = False
    unknown = frames_without_landmark(replace(camera, state=told(tracking)), log)
    assert np.flatnonzero(unknown).tolist() == [*range(50), *range(200, 210)]


def test_only_sightings_make_passes() -> None:
    camera = camera_on(straight())
    rng = np.random.default_rng(4)
    place = np.array([3.0, 1.0]) + 0.01 * rng.standard_normal((FRAMES, 2))
    log = log_of(camera, {"1": to_acs(place, 1.4)})
    seen = np.zeros(len(log.frame), dtype=bool)
    seen[100:120] = True
    said = replace(log, seen=seen)
    passes = find_passes(camera, said, continuous_odometry(camera, said), 6.0)
    assert passes.count.tolist() == [20]
    assert 100 <= passes.at[0] < 120


@pytest.mark.parametrize(("first", "after", "expected"), [(0, 4, "DARK"), (0, 2, ""), (2, 4, "DARK"), (3, 3, "")])
def test_the_commonest_reason_of_a_loss(first: int, after: int, expected: str) -> None:
    state = TrackerState(
        np.array([True, False, False, False]), np.zeros(4, dtype=np.int64), ("DARK", "NONE"), np.array([0, 1, 0, 0])
    )
    assert state.reason(first, after) == expected


@pytest.mark.parametrize(("away_m", "moved"), [(3.8, False), (4.2, True)])
def test_what_moves_four_metres_from_the_camera_was_not_seen(away_m: float, moved: bool) -> None:
    camera = camera_on(straight())
    shift = np.where(np.arange(FRAMES) >= UPDATE, 0.01, 0.0)
    beside = {str(y): np.column_stack((straight()[UPDATE, 0] + shift, np.full(FRAMES, y))) for y in (-away_m, away_m)}
    log = log_of(camera, {name: to_acs(place, 1.4) for name, place in beside.items()})
    moves = map_moves(camera, log, np.zeros(FRAMES - 1, dtype=bool))
    assert moves.moved[UPDATE - 1] == moved
    assert moves.sighted[UPDATE - 1] == (not moved)


def test_sheets_show_the_turn_of_the_map_as_well_as_places_a_metre_from_their_middle() -> None:
    camera = camera_on(straight())
    later = np.arange(FRAMES) >= UPDATE
    places = {str(y): np.column_stack((np.where(later, -9.0, -10.0), np.full(FRAMES, y))) for y in (-1.0, 1.0)}
    log = log_of(camera, {name: to_acs(place, 1.4) for name, place in places.items()})
    log.orientation_acs[:] = sheet_orientation(np.where(later[log.frame], 0.2, 0.0))
    turn = map_moves(camera, log, np.zeros(FRAMES - 1, dtype=bool)).turn[UPDATE - 1]
    assert np.angle(turn) == pytest.approx(0.1)  # places: not at all, sheets: 0.2
