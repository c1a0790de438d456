"""The smoother as a strategy, from logs as a phone writes them to positions with their covariances."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import Drifting, loops
from tests.walks import rows_of_log
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.core.status import EventKind, Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.core.transforms import as_points, level_view
from vislam2tag.estimation.settings import MappingSettings, SmootherSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.estimation.tracker_errors import NoiseLevels

TYPICAL = NoiseLevels(position_m=0.016, heading_rad=0.003, scale=0.002, sighting_m=0.09, sheet_rad=0.03)


def mapped(camera: CameraTrack, log: LandmarkLog, landmarks: Landmarks) -> Trajectory:
    return strategy_named("smoother", MappingSettings()).map(camera, log, landmarks)


def errors_m(walk: Drifting, trajectory: Trajectory) -> FloatArray:
    return np.asarray(np.linalg.norm(trajectory.position_bcs[:, :2] - as_points(walk.truth), axis=1))


def shifted(camera: CameraTrack, log: LandmarkLog, first: int, by: tuple[float, float, float]) -> None:
    """Move camera and landmarks together from a frame on, in place."""
    camera.position_acs[first:] += by
    log.position_acs[log.frame >= first] += by


@pytest.mark.parametrize("rate_hz", [2.0, 10.0, 30.0, 60.0])
def test_a_perfect_tracker_is_mapped_exactly_at_any_frame_rate(rate_hz: float) -> None:
    walk = loops(1, marks=8, laps=1, rate_hz=rate_hz, drifted=False)
    trajectory = mapped(*walk.logged(), walk.landmarks())
    assert set(trajectory.status) == {Status.OK}
    assert errors_m(walk, trajectory).max() < 5e-3
    assert trajectory.events == ()
    assert trajectory.contradictions == ()
    assert np.all(np.isfinite(trajectory.sigma_m))


def test_a_drifting_tracker_is_mapped_well_and_visits_are_told() -> None:
    walk = loops(2, TYPICAL, marks=8, laps=2, survey_m=0.02)
    trajectory = mapped(*walk.logged(), walk.landmarks())
    assert errors_m(walk, trajectory).mean() < 0.15
    assert [visit.landmark for visit in trajectory.visits] == [f"L{i}" for i in range(8)] * 2
    assert all(0.5 < visit.distance_m < 1.5 for visit in trajectory.visits)


def test_the_cameras_heading_is_that_of_the_walk() -> None:
    walk = loops(3, marks=6, laps=1)
    trajectory = mapped(*walk.logged(), walk.landmarks())
    x, y, z, w = trajectory.orientation_bcs.T
    right = np.column_stack((1 - 2 * (y * y + z * z), 2 * (x * y + z * w)))  # the camera's X axis, logged along the way
    way = as_points(np.gradient(walk.truth))
    np.testing.assert_allclose(np.sum(right * way, axis=1) / np.linalg.norm(way, axis=1), 1, atol=0.01)


@pytest.mark.parametrize("known", [[], [2]])
def test_too_few_landmarks_map_nothing_and_keep_what_was_seen(known: list[int]) -> None:
    walk = loops(5, TYPICAL, marks=4, laps=1)
    trajectory = mapped(*walk.logged(), walk.landmarks(known))
    assert set(trajectory.status) == {Status.NO_MAPPING}
    assert np.isnan(trajectory.position_bcs).all()
    assert np.isnan(trajectory.covariance_bcs).all()
    assert len(trajectory.visits) == 4
    assert "two surveyed landmarks" in strategy_named("smoother", MappingSettings()).needs


def test_landmarks_that_the_survey_does_not_know_count_as_unsurveyed() -> None:
    walk = loops(6, TYPICAL, marks=5, laps=2, survey_m=0.02)
    camera, log = walk.logged()
    survey = walk.landmarks()
    three = survey.select([0, 2, 4])
    plain, listed = mapped(camera, log, three), mapped(camera, log, walk.landmarks([0, 2, 4]))
    np.testing.assert_allclose(plain.position_bcs, listed.position_bcs, atol=1e-9)
    assert len(plain.visits) == 10
    stranger = replace(log, ids=tuple(f"other-{name}" for name in log.ids))
    assert set(mapped(camera, stranger, survey).status) == {Status.NO_MAPPING}


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (20.0, 0.0, 5.0)])
def test_after_a_minute_without_frames_nobody_is_sure_until_the_next_landmark(
    shift: tuple[float, float, float],
) -> None:
    walk = loops(5, TYPICAL, marks=8, laps=1)
    camera, log = walk.logged()
    late = np.arange(len(camera.time_ns)) >= 400
    camera = replace(camera, time_ns=camera.time_ns + 60 * 10**9 * late)
    camera.position_acs[late] += shift
    log.position_acs[late[log.frame]] += shift
    whole = mapped(camera, log, walk.landmarks())
    assert errors_m(walk, whole).mean() < 0.2
    forsaken = mapped(camera, rows_of_log(log, log.frame < 400), walk.landmarks())
    assert forsaken.sigma_m[399] < 1 < 20 < forsaken.sigma_m[400]


@pytest.mark.parametrize("apart_m", [0.0, 0.1, 0.3])
def test_landmarks_side_by_side_tell_no_heading_unless_a_sheet_does(apart_m: float) -> None:
    walk = loops(5, TYPICAL, marks=4, laps=1)
    walk.place[1] = walk.surveyed_at[1] = walk.place[0] + apart_m
    session = walk.logged()
    assert set(mapped(*session, walk.landmarks([0, 1])).status) == {Status.NO_MAPPING}
    headed = mapped(*session, walk.landmarks([0, 1], headed=[0]))
    assert np.mean(errors_m(walk, headed) < 3 * headed.sigma_m) > 0.9


def test_one_landmark_with_a_heading_but_a_constant_orientation_maps_nothing() -> None:
    walk = loops(8, TYPICAL, marks=1, laps=2)
    camera, log = walk.logged()
    log.orientation_acs[:] = (0.0, 0.0, 0.0, 1.0)
    assert set(mapped(camera, log, walk.landmarks([0], headed=[0])).status) == {Status.NO_MAPPING}


def test_a_constant_orientation_does_not_spoil_map_updates_or_drift() -> None:
    walk = loops(9, TYPICAL, marks=8, laps=2, survey_m=0.02)
    camera, log = walk.logged()
    told = errors_m(walk, mapped(camera, log, walk.landmarks())).mean()
    log.orientation_acs[:] = (0.0, 0.0, 0.0, 1.0)
    constant = errors_m(walk, mapped(camera, log, walk.landmarks())).mean()
    assert constant < 1.3 * told + 0.03


def test_a_map_update_is_reported_and_costs_nothing() -> None:
    walk = loops(12, TYPICAL, marks=8, laps=1, rate_hz=30.0, survey_m=0.02)
    logged = walk.logged()
    plain = mapped(*logged, walk.landmarks())
    camera, log = deepcopy(logged)
    shifted(camera, log, 1000, (40.0, 0.0, -25.0))
    trajectory = mapped(camera, log, walk.landmarks())
    assert [(event.kind, event.frame) for event in trajectory.events] == [(EventKind.MAP_UPDATE, 1000)]
    assert trajectory.events[0].size_m == pytest.approx(np.hypot(40, 25), abs=0.1)
    np.testing.assert_allclose(trajectory.position_bcs[:, :2], plain.position_bcs[:, :2], atol=0.01)


def test_a_break_spoils_only_the_stretch_that_it_lies_in() -> None:
    walk = loops(13, TYPICAL, marks=8, laps=1, rate_hz=30.0, survey_m=0.02)
    camera, log = walk.logged()
    away = np.abs(walk.truth[:, None] - walk.place)
    first = 900 + int(np.argmax(away[900:1150].min(axis=1)))
    assert away[first].min() > 3  # nothing in sight at the break
    camera.position_acs[first:] += (6.0, 0.0, 8.0)
    seen = away < 2.5
    seen[:first] = False
    again = np.where(seen.any(axis=0), seen.argmax(axis=0), len(walk.truth))
    log.position_acs[log.frame >= again[log.landmark]] += (6.0, 0.0, 8.0)  # where the tracker has them since
    trajectory = mapped(camera, log, walk.landmarks())
    assert [event.frame for event in trajectory.events] == [first]
    assert trajectory.events[0].size_m == pytest.approx(10.0, abs=0.2)
    error = errors_m(walk, trajectory)
    assert error.mean() < 0.2
    assert error.max() < 1.0


def test_a_contradicting_landmark_is_told_and_does_not_spoil_the_walk() -> None:
    walk = loops(14, TYPICAL, marks=8, laps=2, survey_m=0.02)
    session = walk.logged()
    clean = errors_m(walk, mapped(*session, walk.landmarks())).mean()
    survey = walk.landmarks()
    survey.position_bcs[6] += (2.0, 1.0)
    trajectory = mapped(*session, survey)
    assert [one.landmark for one in trajectory.contradictions] == ["L6"]
    assert trajectory.contradictions[0].size_m == pytest.approx(np.hypot(2, 1), abs=0.4)
    assert errors_m(walk, trajectory).mean() < 2 * clean


def test_unusable_frames_keep_their_own_status() -> None:
    walk = loops(15, marks=6, laps=1, drifted=False)
    camera, log = walk.logged()
    camera.status[400:403] = Status.INVALID
    camera.status[500] = Status.DUPLICATE
    camera.position_acs[400:403] = np.nan
    trajectory = mapped(camera, rows_of_log(log, camera.usable[log.frame]), walk.landmarks())
    assert trajectory.status[399:404].tolist() == [Status.OK, *[Status.INVALID] * 3, Status.OK]
    assert trajectory.status[500] == Status.DUPLICATE
    bad = ~camera.usable
    assert np.isnan(trajectory.position_bcs[bad]).all()
    assert np.isnan(trajectory.covariance_bcs[bad]).all()
    assert errors_m(walk, trajectory)[~bad].max() < 5e-3


@pytest.mark.parametrize("count", [0, 1, 2])
def test_hardly_any_frames(count: int) -> None:
    walk = loops(16, marks=2, laps=1)
    camera, log = walk.logged()
    columns = ("time_ns", "position_acs", "orientation_acs", "status")
    few = replace(camera, **{name: getattr(camera, name)[:count] for name in columns})
    trajectory = mapped(few, rows_of_log(log, log.frame < count), walk.landmarks())
    assert trajectory.status.tolist() == [Status.NO_MAPPING] * count
    assert trajectory.position_bcs.shape == (count, 3)


def test_a_walk_that_logged_no_landmark_is_not_mapped() -> None:
    walk = loops(17, marks=2, laps=1)
    camera, log = walk.logged()
    trajectory = mapped(
        camera, replace(rows_of_log(log, np.zeros(len(log.frame), dtype=bool)), ids=()), walk.landmarks()
    )
    assert set(trajectory.status) == {Status.NO_MAPPING}
    assert trajectory.visits == ()


def test_the_body_is_behind_the_camera_all_along_its_view() -> None:
    walk = loops(1, marks=8, laps=1, drifted=False)
    logged, landmarks = walk.logged(), walk.landmarks()
    own = mapped(*logged, landmarks)
    settings = MappingSettings(smoother=SmootherSettings(body_behind_camera_m=0.3))
    body = strategy_named("smoother", settings).map(*logged, landmarks)
    apart = own.position_bcs[:, :2] - body.position_bcs[:, :2]
    np.testing.assert_allclose(apart, 0.3 * level_view(own.orientation_bcs), atol=1e-12)
    assert np.hypot(*apart.T) == pytest.approx(0.3)
    np.testing.assert_array_equal(body.covariance_bcs, own.covariance_bcs)


def test_where_others_say_that_the_body_was_moves_no_walk_that_was_there() -> None:
    walk = loops(1, marks=8, laps=1, drifted=False)
    (camera, log), landmarks = walk.logged(), walk.landmarks()
    strategy = strategy_named("smoother", MappingSettings(smoother=SmootherSettings(body_behind_camera_m=0.3)))
    body = strategy.map(camera, log, landmarks)
    at = np.arange(20, len(camera.time_ns), 20)
    ties = PlaceTies(camera.time_ns[at], body.position_bcs[at, :2], np.eye(2 * len(at)) * 0.05**2)
    tied = strategy.map(replace(camera, ties=ties), log, landmarks)
    assert np.hypot(*(tied.position_bcs - body.position_bcs)[:, :2].T).max() < 0.02
