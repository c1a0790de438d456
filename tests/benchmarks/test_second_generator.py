"""The second generator's walks are sound, and it shares nothing with the simulator."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
import second_generator
from data_sets import second_generator as walks_with_truth
from hypothesis import given
from hypothesis import strategies as st
from second_generator import MadeWalk, Severity, iphone, make_walk, surveyed_in_two_frames
from second_generator.events import Event, Kind
from second_generator.floor import Floor, HungSheets, bent_grid, hang_sheets
from second_generator.gait import walk_route
from second_generator.habits import Drift, Gait, Habits, Kidnaps, Sheets, Sight, SightingErrors, Surveying, Updates
from second_generator.odometry import Odometry, dead_reckoning
from second_generator.route import draw_route
from second_generator.sightings import Pass, draw_errors, draw_passes
from second_generator.tracker import Logged, Tracker, World

from tests.test_layers import imported
from vislam2tag.core.arrays import ComplexArray, FloatArray
from vislam2tag.core.tracks import to_plane

FARTHEST_FROM_CORRIDOR_M = 2.0
FAULTLESS = Habits(
    gait=Gait(rate_hz=10.0, duration_s=120.0, speed_mps=1.0, pauses_per_min=1.0),
    sheets=Sheets(spacing_m=10.0, count=12, aside_m=(0.2, 0.8)),
    sight=Sight(reach_m=1.5, reach_spread_m=0.0),
    errors=SightingErrors(pass_bias_m=0.0, convention="arcore"),
    drift=Drift(heading_walk_rad_per_sqrt_s=0.0),
    surveying=Surveying(sigma_m=0.0),
    camera_yaw="acs",
)


@pytest.fixture(scope="module", params=get_args(Severity))
def walks(request: pytest.FixtureRequest) -> list[MadeWalk]:
    return [make_walk(seed, request.param) for seed in range(1, 9)]


class Scene:
    """A faultless walk over a floor, as far as the tracker's input."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.floor = bent_grid(FAULTLESS.sheets.spacing_m, rng)
        self.hung: HungSheets = hang_sheets(self.floor, FAULTLESS.sheets, rng)
        motion = walk_route(draw_route(self.floor, 200, rng), self.hung.place, FAULTLESS.gait, rng)
        sheets = np.broadcast_to(self.hung.place, (len(motion.time_s), len(self.hung.place)))
        self.world = World(motion, sheets, self.hung.along_wall)
        apart = np.abs(self.world.offsets)
        self.passes: list[Pass] = draw_passes(apart, [], FAULTLESS.gait, FAULTLESS.sight, rng)
        self.errors = draw_errors(self.passes, self.world.offsets, self.hung.along_wall, FAULTLESS.errors, rng)
        self.odometry: Odometry = dead_reckoning(motion, FAULTLESS.drift, rng)
        self.rng = rng

    def tracked(self, events: list[Event], habits: Habits = FAULTLESS) -> Logged:
        return Tracker(self.world, self.odometry, self.passes, self.errors, habits, self.rng).run(events)


def from_nearest_corridor(floor: Floor, place: ComplexArray) -> FloatArray:
    start, stop = floor.crossings[floor.corridors].T
    along = (stop - start) / abs(stop - start)
    local = (place[:, None] - start) / along
    apart: FloatArray = np.abs(local - local.real.clip(0, abs(stop - start)))
    return np.asarray(apart.min(axis=1))


def test_truth_stays_in_the_corridors(walks: list[MadeWalk]) -> None:
    for walk in walks:
        x, y = walk.truth_bcs.T
        assert from_nearest_corridor(walk.floor, x + 1j * y).max() < FARTHEST_FROM_CORRIDOR_M, walk.name


def test_truth_moves_as_people_do(walks: list[MadeWalk]) -> None:
    for walk in walks:
        seconds = np.diff(walk.camera.time_ns) * 1e-9
        assert np.all(seconds > 0), walk.name
        every = max(1, round(1 / float(np.median(seconds))))
        steps = np.linalg.norm(walk.truth_bcs[every:] - walk.truth_bcs[:-every], axis=1)
        pace = steps / ((walk.camera.time_ns[every:] - walk.camera.time_ns[:-every]) * 1e-9)
        assert 0.2 < np.median(pace) < 2.0, walk.name
        assert pace.max() < 5.0, walk.name


def test_rows_begin_with_the_first_sighting(walks: list[MadeWalk]) -> None:
    for walk in walks:
        met = [walk.landmarks.index[name] for name in walk.log.ids]
        first_rows = walk.log.frame[walk.log.offsets[:-1]]
        assert sorted(met) == np.flatnonzero(walk.seen.any(axis=0)).tolist()
        assert first_rows.tolist() == walk.seen[:, met].argmax(axis=0).tolist(), walk.name
        assert np.all(np.diff(first_rows) >= 0)


def test_rows_of_lost_tracking_repeat_the_camera(walks: list[MadeWalk]) -> None:
    for walk in walks:
        log = walk.log
        same = np.all(log.position_acs == walk.camera.position_acs[log.frame], axis=1)
        np.testing.assert_array_equal(same, log.lost)
        assert not walk.seen[log.frame[log.lost]].any(), walk.name


def test_only_landmarks_within_reach_are_sighted() -> None:
    scene = Scene(1)
    apart, lost = np.abs(scene.world.offsets), [(100, 400)]
    every = draw_passes(apart, lost, FAULTLESS.gait, FAULTLESS.sight, scene.rng)
    for one in every:
        assert np.all(apart[one.frames, one.sheet] < FAULTLESS.sight.reach_m)
        assert not np.any((one.frames >= 100) & (one.frames < 400))
    missed = np.ones(apart.shape, dtype=bool)
    missed[100:400] = False
    for one in every:
        missed[one.frames, one.sheet] = False
    assert np.all(apart[missed] >= FAULTLESS.sight.reach_m)


def test_same_seed_same_arrays(walks: list[MadeWalk], request: pytest.FixtureRequest) -> None:
    severity: Severity = request.node.callspec.params["walks"]
    for seed, one in enumerate(walks, start=1):
        again = make_walk(seed, severity)
        np.testing.assert_array_equal(one.truth_bcs, again.truth_bcs)
        np.testing.assert_array_equal(one.camera.position_acs, again.camera.position_acs)
        np.testing.assert_array_equal(one.camera.orientation_acs, again.camera.orientation_acs)
        np.testing.assert_array_equal(one.log.position_acs, again.log.position_acs)
        np.testing.assert_array_equal(one.log.orientation_acs, again.log.orientation_acs)
        np.testing.assert_array_equal(one.landmarks.position_bcs, again.landmarks.position_bcs)
    assert len({walk.truth_bcs.tobytes() for walk in walks}) == len(walks)


def test_without_drift_and_faults_the_log_is_the_truth_moved() -> None:
    scene = Scene(2)
    logged = scene.tracked([])
    turn = logged.turn[0]
    assert np.ptp(np.angle(logged.turn / turn)) < 1e-9
    path = scene.world.motion.place
    np.testing.assert_allclose(logged.camera - logged.camera[0], turn * (path - path[0]), atol=1e-9)
    for one in scene.passes:
        held = logged.landmarks[one.frames[0] :, one.sheet] - logged.camera[0]
        np.testing.assert_allclose(held, turn * (scene.hung.place[one.sheet] - path[0]), atol=1e-9)
        along = logged.along_wall[one.frames[0] :, one.sheet]
        np.testing.assert_allclose(along, turn * scene.hung.along_wall[one.sheet], atol=1e-9)


@given(seed=st.integers(0, 20), share=st.floats(0.3, 0.9))
def test_a_kidnap_moves_the_camera_alone(seed: int, share: float) -> None:
    scene = Scene(seed)
    frame = int(share * len(scene.world.motion.time_s))
    calm, kidnapped = scene.tracked([]), scene.tracked([Event(frame, Kind.KIDNAP)])
    np.testing.assert_array_equal(kidnapped.camera[:frame], calm.camera[:frame])
    jump = kidnapped.camera[frame:] - calm.camera[frame:]
    np.testing.assert_allclose(jump, jump[0], atol=1e-9)
    assert 0.7 * Kidnaps().size_m <= abs(jump[0]) <= 1.3 * Kidnaps().size_m
    away = np.abs(scene.world.offsets[frame]) >= FAULTLESS.sight.reach_m
    np.testing.assert_array_equal(kidnapped.landmarks[frame, away], calm.landmarks[frame, away])


@given(seed=st.integers(0, 20), share=st.floats(0.3, 0.9))
def test_an_even_update_moves_camera_and_landmarks_as_one(seed: int, share: float) -> None:
    scene = Scene(seed)
    frame = int(share * len(scene.world.motion.time_s))
    even = replace(FAULTLESS, updates=Updates(scale=0.0, uneven=0.0))
    calm, updated = scene.tracked([]), scene.tracked([Event(frame, Kind.UPDATE)], even)
    turn = updated.turn[frame] / calm.turn[frame]
    assert abs(updated.camera[frame] - calm.camera[frame]) > 0
    before, after = (one.landmarks[frame:] - one.camera[frame:, None] for one in (calm, updated))
    np.testing.assert_allclose(after, turn * before, atol=1e-9)


def test_sheets_face_the_corridor() -> None:
    scene = Scene(3)
    out_of_wall = scene.hung.place + 0.1 * (-1j) * scene.hung.along_wall
    nearer = from_nearest_corridor(scene.floor, out_of_wall) < from_nearest_corridor(scene.floor, scene.hung.place)
    assert nearer.mean() > 0.8  # near a crossing another corridor may be the nearest


def test_data_set_gives_the_truth_of_every_frame() -> None:
    (walk,) = walks_with_truth([5], "severe")
    made = make_walk(5, "severe")
    assert walk.truth is not None
    np.testing.assert_array_equal(walk.truth.position_bcs, made.truth_bcs)
    np.testing.assert_array_equal(walk.truth.time_ns, walk.camera.time_ns)
    assert len(walk.log.frame) == len(made.log.frame)
    assert np.isfinite(to_plane(walk.log.position_acs)).all()


def test_it_knows_of_the_package_only_what_strategies_get() -> None:
    folder = Path(second_generator.__file__).parent
    for path in folder.glob("*.py"):
        assert imported(path) <= {"core"}, path.name


def test_a_survey_in_two_frames_shifts_landmarks_and_truth_alike_beyond_a_line() -> None:
    for seed in range(1, 6):
        made = make_walk(seed, "default", iphone)
        parted = surveyed_in_two_frames(made, seed)
        shift, by = parted.truth_bcs - made.truth_bcs, parted.landmarks.position_bcs - made.landmarks.position_bcs
        moved = np.flatnonzero(np.abs(by).any(axis=1))
        assert 2 <= len(moved) <= len(by) - 2
        assert 0.3 <= np.hypot(*by[moved][0]) <= 1.0
        there = np.flatnonzero(np.abs(shift).any(axis=1))
        assert 0 < len(there) < len(shift)
        np.testing.assert_allclose(shift[there], np.broadcast_to(by[moved][0], shift[there].shape), atol=1e-9)
        np.testing.assert_allclose(by[moved], np.broadcast_to(by[moved][0], by[moved].shape), atol=1e-9)
