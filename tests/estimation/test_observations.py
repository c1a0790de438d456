"""What a pass of a landmark is, and which rows of the log count as sightings.

A session reduced to odometry and passes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.drifting import about_vertical, camera_track, loops, nothing_logged, sheet_orientation
from tests.walks import camera_on, corridor_walk, log_of
from vislam2tag.core.tracks import CameraTrack, LandmarkLog
from vislam2tag.core.transforms import Similarity2
from vislam2tag.estimation.observations import Passes, WalkObservations, find_passes
from vislam2tag.estimation.odometry import continuous_odometry
from vislam2tag.estimation.tracker_errors import DriftSource

RANGE_M = 6.0


def passes_of(camera: CameraTrack, log: LandmarkLog, range_m: float = RANGE_M) -> Passes:
    return find_passes(camera, log, continuous_odometry(camera, log), range_m)


def test_each_pass_is_one_observation_at_its_nearest_approach() -> None:
    walk = loops(1, marks=5, laps=2, drifted=False)
    camera, log = walk.logged()
    passes = passes_of(camera, log)
    assert passes.landmark.tolist() == [0, 1, 2, 3, 4] * 2
    np.testing.assert_array_equal(np.sort(passes.at), passes.at)
    for at, landmark, distance in zip(passes.at, passes.landmark, passes.distance_m, strict=True):
        lap = slice(max(at - 100, 0), at + 100)
        assert np.argmin(np.abs(walk.truth[lap] - walk.place[landmark])) == at - lap.start
        assert distance == pytest.approx(abs(walk.truth[at] - walk.place[landmark]), abs=1e-4)
    np.testing.assert_allclose(walk.truth[passes.at] + passes.offset, walk.place[passes.landmark], atol=1e-4)
    np.testing.assert_allclose(passes.heading, np.exp(1j * walk.heading_rad)[passes.landmark], atol=1e-6)
    assert passes.spread_m.max() < 1e-4


def test_near_sightings_count_most_and_scatter_is_stated() -> None:
    walk = loops(1, marks=1, laps=1, drifted=False)
    camera, log = walk.logged()
    odometry = continuous_odometry(camera, log)
    away = log.plane_acs - camera.plane_acs[log.frame]
    seen = np.flatnonzero(np.linalg.norm(away, axis=1) < 2.5)
    off = np.where(np.arange(len(seen)) % 3 == 0, 0.3, 0.0) * np.linspace(0, 1, len(seen))
    log.position_acs[seen, 0] += off
    weight = 1 / (0.5**2 + np.linalg.norm(log.plane_acs[seen] - camera.plane_acs[log.frame[seen]], axis=1) ** 2)
    mean = np.average(log.plane_acs[seen], axis=0, weights=weight)
    passes = find_passes(camera, log, odometry, 2.5)
    (at,), (offset,) = passes.at, passes.offset
    np.testing.assert_allclose((offset.real, offset.imag), mean - camera.plane_acs[at], atol=1e-3)
    spread = np.sqrt(np.average(np.sum((log.plane_acs[seen] - mean) ** 2, axis=1), weights=weight) / 2)
    assert passes.spread_m == pytest.approx([spread], rel=0.01)


@pytest.mark.parametrize("steep_rad", [0.7, 1.3])
def test_a_sheet_that_hangs_askew_has_a_heading_unless_it_is_steep(steep_rad: float) -> None:
    walk = loops(7, marks=3, laps=1, drifted=False)
    camera, log = walk.logged()
    sheet = Rotation.from_quat(log.orientation_acs)
    log.orientation_acs[:] = (sheet * Rotation.from_rotvec([0, steep_rad, 0])).as_quat()
    expected = np.exp(1j * walk.heading_rad) if steep_rad < 1 else np.zeros(3)
    np.testing.assert_allclose(passes_of(camera, log).heading, expected, atol=1e-6)


def test_rows_that_repeat_the_last_sighting_do_not_count() -> None:
    walk = loops(2, marks=3, laps=1)
    camera, log = walk.logged()
    passes = passes_of(camera, log)
    in_sight = [np.sum(np.abs(walk.truth - place) < 2.5) for place in walk.place]
    assert passes.count.tolist() == in_sight
    assert len(log.frame) > 5 * passes.count.sum()


def test_sightings_from_too_far_do_not_count() -> None:
    camera, log = loops(3, marks=4, laps=1).logged()
    assert len(passes_of(camera, log, 0.5).at) == 0
    near = passes_of(camera, log, 1.5)
    assert near.landmark.tolist() == [0, 1, 2, 3]
    assert near.count.sum() < passes_of(camera, log).count.sum()


def test_a_log_without_rows_has_no_passes() -> None:
    camera, _ = loops(4, marks=1, laps=0.2).logged()
    assert len(passes_of(camera, nothing_logged()).at) == 0


def test_a_map_update_is_no_sighting_of_the_landmarks_that_it_moves() -> None:
    walk = loops(5, marks=6, laps=1)
    camera, log = walk.logged()
    before = passes_of(camera, log)
    late = np.arange(len(camera.time_ns)) > np.flatnonzero(np.abs(walk.truth - walk.place[3]) < 1.5)[0] - 60
    camera.position_acs[late] += (3.0, 0.0, 1.0)
    log.position_acs[late[log.frame]] += (3.0, 0.0, 1.0)
    after = passes_of(camera, log)
    assert after.landmark.tolist() == before.landmark.tolist()
    assert np.abs(after.count - before.count).max() <= 1  # the frame of the update itself
    np.testing.assert_allclose(after.offset, before.offset, atol=1e-3)


def test_a_break_amid_a_pass_does_not_displace_its_landmark() -> None:
    walk = loops(6, marks=3, laps=1, drifted=False)
    camera, log = walk.logged()
    late = np.arange(len(camera.time_ns)) >= int(np.argmin(np.abs(walk.truth - walk.place[1]))) + 10
    camera.position_acs[late] += (4.0, 0.0, 4.0)
    seen_after = late[log.frame] & (log.landmark > 0)
    log.position_acs[seen_after] += (4.0, 0.0, 4.0)
    passes = passes_of(camera, log)
    assert set(passes.landmark) == {0, 1, 2}
    np.testing.assert_allclose(passes.offset, (walk.place[passes.landmark] - walk.truth[passes.at]), atol=1e-3)


def test_lying_sheets_have_no_heading() -> None:
    camera, log = loops(7, marks=3, laps=1).logged()
    upright = np.array([[0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]])  # X axis straight up
    rows = log.landmark == 1
    log.orientation_acs[rows] = upright
    headings = passes_of(camera, log).heading
    assert (headings == 0).tolist() == [False, True, False]


def test_an_orientation_constant_over_several_landmarks_carries_no_heading() -> None:
    stations = {"a": (5.0, 0.6), "b": (15.0, -0.6), "c": (25.0, 0.6)}
    camera, log, _, _ = corridor_walk(Similarity2(np.exp(0.7j), 3j), stations)
    passes = passes_of(camera, log)
    assert len(passes.at) == 3
    assert np.all(passes.heading == 0)


def test_an_orientation_that_stays_while_its_landmark_moves_carries_no_heading() -> None:
    camera, log = loops(8, marks=1, laps=1).logged()
    log.orientation_acs[:] = (0.0, 0.0, 0.0, 1.0)
    assert np.all(passes_of(camera, log).heading == 0)


def test_one_landmark_that_never_moves_may_keep_its_orientation() -> None:
    camera, log, _, _ = corridor_walk(Similarity2.identity(), {"a": (5.0, 0.6)})
    log.orientation_acs[:] = sheet_orientation(np.array([1.1]))
    passes = passes_of(camera, log)
    np.testing.assert_allclose(np.angle(passes.heading), [1.1])


def test_poses_of_lost_tracking_do_not_make_a_constant_orientation_vary() -> None:
    stations = {"a": (5.0, 0.6), "b": (15.0, -0.6)}
    camera, log, _, truth = corridor_walk(Similarity2.identity(), stations)
    lost = (truth[:, 0] > 9) & (truth[:, 0] < 10)
    rows = lost[log.frame]
    log.lost[rows] = True
    log.position_acs[rows] = camera.position_acs[log.frame[rows]]
    log.orientation_acs[rows] = (0.0, 0.6, 0.0, 0.8)
    passes = passes_of(camera, log)
    assert len(passes.at) == 2
    assert np.all(passes.heading == 0)


@pytest.mark.parametrize(("unseen_s", "passes"), [(1.8, 1), (2.2, 2)])
def test_a_landmark_not_seen_for_two_seconds_is_passed_again(unseen_s: float, passes: int) -> None:
    time_s = np.arange(180) / 30
    camera = camera_on(np.column_stack((time_s, np.zeros(180))))
    log = log_of(camera, {"a": np.tile((2.5, 1.4, -1.0), (180, 1))})
    seen = (time_s <= 1) | (time_s >= 1 + unseen_s)
    assert len(passes_of(camera, replace(log, seen=seen)).at) == passes


def test_nodes_are_the_first_frame_one_of_each_pass_and_the_last() -> None:
    walk = loops(1, marks=4, laps=1.3)
    observations = WalkObservations.of(*walk.logged(), range_m=6.0)
    assert observations.ids == walk.ids
    assert observations.nodes[0] == 0
    assert observations.nodes[-1] == len(walk.truth) - 1
    np.testing.assert_array_equal(observations.nodes[1:-1], observations.passes.at)


def test_a_walk_past_nothing_has_two_nodes() -> None:
    observations = WalkObservations.of(
        camera_track(np.linspace(0, 5, 50).astype(np.complex128), np.arange(50) / 10), nothing_logged(), 6.0
    )
    assert observations.nodes.tolist() == [0, 49]


def test_drift_grows_with_the_way_and_a_little_with_time() -> None:
    time_s = np.arange(200) / 10
    path = np.asarray(10 * np.tanh(time_s / 5), dtype=np.complex128)  # slows down and stands
    observations = WalkObservations.of(camera_track(path, time_s), nothing_logged(), 6.0)
    for source in (DriftSource.POSITION, DriftSource.HEADING):
        variance = observations.step_variance[source]
        assert variance[:50].mean() > 5 * variance[-3:].mean() > 0
    assert not observations.step_variance[DriftSource.JUMP].any()


def test_turning_lets_the_heading_drift_but_not_the_position() -> None:
    straight, curved = (
        WalkObservations.of(*loops(2, marks=2, laps=1, size_m=size).logged(), range_m=6.0)
        for size in ((60.0, 59.0), (2.5, 2.4))
    )
    per_metre = {
        name: {source: steps.sum() / walk.odometry.step_length_m.sum() for source, steps in walk.step_variance.items()}
        for name, walk in (("straight", straight), ("curved", curved))
    }
    assert per_metre["curved"][DriftSource.HEADING] > 1.2 * per_metre["straight"][DriftSource.HEADING]
    np.testing.assert_allclose(
        per_metre["curved"][DriftSource.POSITION], per_metre["straight"][DriftSource.POSITION], rtol=0.01
    )


def test_a_radian_counts_as_four_metres_fifty_seconds_as_one_and_a_leap_of_the_heading_little() -> None:
    time_s = np.arange(501) / 10
    camera = camera_track(np.zeros(501, dtype=np.complex128), time_s)
    turned_rad = {"still": np.zeros(501), "turns": np.minimum(time_s, 1.0), "leaps": np.where(time_s < 1, 0.0, 2.0)}
    heading_m = {}
    for name, angle_rad in turned_rad.items():
        turning = replace(camera, orientation_acs=about_vertical(angle_rad))
        variance = WalkObservations.of(turning, nothing_logged(), 6.0).step_variance
        assert variance[DriftSource.POSITION].sum() == pytest.approx(1.0)
        heading_m[name] = variance[DriftSource.HEADING].sum()
    assert heading_m == pytest.approx({"still": 1.0, "turns": 1.0 + 4.0, "leaps": 1.0 + 4.0 * 0.3})
