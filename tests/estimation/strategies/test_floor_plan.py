"""Walks of the simulator placed on the plan of their floor, without landmarks and with some."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from tests.drifting import about_vertical, nothing_logged
from tests.estimation.floor_plan.plans import (
    SimulatedWalk,
    along,
    another_floor,
    area_of,
    camera_with,
    free_of,
    plans_with,
    simulated,
)
from tests.walks import landmarks_at, to_acs
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import FixLog, PlanOfFloor, Storeys
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.core.transforms import as_complex, as_points, multiply
from vislam2tag.core.wall_costs import FINE_M, WallCosts
from vislam2tag.estimation.settings import ON_PLAN, MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.simulation.model import position_at
from vislam2tag.simulation.scenario import regular_survey
from vislam2tag.simulation.settings import BuildingSettings, Climb
from vislam2tag.simulation.survey import walk_and_track

NONE = landmarks_at({})
SHORT_S = 45.0


@pytest.fixture(scope="module")
def walk() -> SimulatedWalk:
    """Three minutes with the tracker's usual faults."""
    return simulated(73)


def mapped(
    camera: CameraTrack, log: LandmarkLog | None = None, landmarks: Landmarks = NONE, strategy: str = ON_PLAN
) -> Trajectory:
    return strategy_named(strategy, MappingSettings()).map(camera, log or nothing_logged(), landmarks)


@cache
def on_its_plan() -> Trajectory:
    """The walk by its shape alone."""
    return mapped(simulated(73).camera())


def labelled(trajectory: Trajectory) -> float:
    return float(np.mean(trajectory.status == Status.OK))


def test_a_walk_of_three_minutes_is_labelled(walk: SimulatedWalk) -> None:
    found = on_its_plan()
    assert labelled(found) >= 0.65
    errors_m = walk.errors_m(found)[found.status == Status.OK]
    assert errors_m.mean() < 0.25
    assert errors_m.max() < 0.8
    assert found.placing is not None
    assert found.placing.reason is Status.OK
    assert found.placing.labelled_share == pytest.approx(labelled(found), abs=0.1)
    assert found.placing.scale == pytest.approx(1, abs=0.012)
    assert 0.001 < found.placing.scale_sigma < 0.02


def test_the_covariance_states_the_error(walk: SimulatedWalk) -> None:
    found = on_its_plan()
    ok = found.status == Status.OK
    sigma_m = np.sqrt(np.trace(found.covariance_bcs[ok], axis1=1, axis2=2) / 2)
    assert np.sqrt(np.mean((walk.errors_m(found)[ok] / sigma_m) ** 2) / 2) < 1.5
    assert np.median(sigma_m) < 0.5


def test_the_smoother_places_what_no_landmark_connects(walk: SimulatedWalk) -> None:
    camera = tapped(walk.camera(seconds=SHORT_S), 600, complex(walk.truth[600]))
    found, expected = mapped(camera, strategy="smoother"), mapped(camera)
    assert labelled(found) > 0.9
    np.testing.assert_array_equal(found.status, expected.status)
    np.testing.assert_array_equal(found.position_bcs, expected.position_bcs)
    assert found.placing is not None
    assert expected.placing is not None
    assert replace(found.placing, candidates=()) == replace(expected.placing, candidates=())


def test_without_a_plan_it_maps_as_the_smoother(walk: SimulatedWalk) -> None:
    log, landmarks = walk.log.landmarks, walk.landmarks(3)
    for plans in ((), plans_with(None), plans_with(None, 7)):
        found, expected = (mapped(walk.camera(plans), log, landmarks, name) for name in (ON_PLAN, "smoother"))
        np.testing.assert_array_equal(found.position_bcs, expected.position_bcs)
        assert found.placing is None
    alone = mapped(walk.camera(()), log)
    assert set(alone.status) == {Status.NO_MAPPING}
    assert alone.visits


def test_a_mirrored_plan_is_refused(walk: SimulatedWalk) -> None:
    found = mapped(walk.camera(plans_with(walk.mirrored_costs)), walk.log.landmarks)
    assert set(found.status) <= {Status.FITS_MIRROR, Status.FITS_NOWHERE}
    assert np.isnan(found.position_bcs).all()
    assert np.isnan(found.covariance_bcs).all()
    assert found.placing is not None
    assert found.placing.mirror < -5
    assert found.placing.labelled_share == 0
    assert found.visits, "what it passed is known all the same"


def test_the_plan_of_another_building_is_refused(walk: SimulatedWalk) -> None:
    found = mapped(walk.camera(plans_with(another_floor(74))))
    assert not labelled(found)


def tapped(camera: CameraTrack, frame: int, place: complex) -> CameraTrack:
    """A camera whose walker tapped a place at a frame."""
    return replace(camera, fixes=FixLog(camera.time_ns[[frame]], as_points(np.array([place])), ("tap",)))


def test_one_tap_settles_a_short_walk(walk: SimulatedWalk) -> None:
    camera = walk.camera(seconds=SHORT_S)
    vague = mapped(camera)
    assert set(vague.status) <= {Status.TOO_SHORT, Status.AMBIGUOUS}
    assert vague.placing is not None
    assert len(vague.placing.candidates) > 1
    frame = vague.placing.best_tap
    assert frame is not None
    settled = mapped(tapped(camera, frame, complex(walk.truth[frame]) + 0.4j))
    assert labelled(settled) > 0.9
    assert np.nanmax(walk.errors_m(settled)) < 1


def test_a_plan_with_only_an_open_hall_is_too_open() -> None:
    hall = WallCosts.of(area_of([(1, 1, 24, 17)], (25, 18)))
    found = mapped(camera_with(along((3 + 3j, 12 + 3j, 12 + 12j, 5 + 12j, 5 + 6j)), hall))
    assert set(found.status) == {Status.PLAN_TOO_OPEN}


def turned_by_jumps(camera: CameraTrack, jumps: dict[int, tuple[float, complex]]) -> CameraTrack:
    """Turn and shift the tracker's map at some frames, as a relocalisation does."""
    plane, orientation = as_complex(camera.plane_acs), camera.orientation_acs
    for frame, (turn_rad, shift) in jumps.items():
        late = np.arange(len(plane)) >= frame
        plane = np.where(late, plane * np.exp(1j * turn_rad) + shift, plane)
        turned = multiply(about_vertical(np.array([turn_rad])), orientation)
        orientation = np.where(late[:, None], turned, orientation)
    return replace(
        camera,
        position_acs=to_acs(as_points(plane), camera.position_acs[:, 1]),
        orientation_acs=orientation,
    )


def test_jumps_of_the_tracker_are_undone_with_their_turn(walk: SimulatedWalk) -> None:
    jumps = {1500: (0.6, 3 - 2j), 2700: (-1.4, 20j), 4000: (2.5, -4 + 1j)}
    found = mapped(turned_by_jumps(walk.camera(), jumps))
    assert len(found.events) >= 3
    assert labelled(found) > 0.65
    errors_m = walk.errors_m(found)[found.status == Status.OK]
    assert errors_m.mean() < 0.35
    assert errors_m.max() < 1.5


def test_one_surveyed_landmark_helps_the_plan(walk: SimulatedWalk) -> None:
    camera = walk.camera(seconds=SHORT_S)
    found = mapped(camera, before(walk.log.landmarks, camera), walk.landmarks(1))
    assert labelled(found) > 0.9
    assert np.nanmax(walk.errors_m(found)) < 1
    assert {visit.landmark for visit in found.visits} >= set(walk.landmarks(1).ids)


def before(log: LandmarkLog, camera: CameraTrack) -> LandmarkLog:
    """The rows of the frames that a camera has."""
    return log.rows_kept(log.frame < len(camera.time_ns))


def test_two_landmarks_keep_positions_where_the_plan_is_not_certain(walk: SimulatedWalk) -> None:
    camera = walk.camera(plans_with(walk.mirrored_costs))
    log, landmarks = walk.log.landmarks, walk.landmarks(3)
    found, alone = mapped(camera, log, landmarks), mapped(walk.camera(()), log, landmarks, "smoother")
    assert found.placing is not None
    assert found.placing.labelled_share == 0
    assert labelled(found) == labelled(alone) == 1
    np.testing.assert_array_equal(found.position_bcs, alone.position_bcs)


def test_landmarks_and_a_plan_together_are_better_than_either(walk: SimulatedWalk) -> None:
    log, landmarks = walk.log.landmarks, walk.landmarks(3)
    alone = mapped(walk.camera(()), log, landmarks, "smoother")
    found = mapped(walk.camera(), log, landmarks)
    assert labelled(found) == 1
    assert walk.errors_m(found).mean() < 0.7 * walk.errors_m(alone).mean()
    assert walk.errors_m(found).mean() < walk.errors_m(on_its_plan()).mean()


def test_the_smoother_does_not_look_at_the_plan_where_landmarks_connect_a_walk(walk: SimulatedWalk) -> None:
    log, landmarks = walk.log.landmarks, walk.landmarks(3)
    with_plan, without = (mapped(camera, log, landmarks, "smoother") for camera in (walk.camera(), walk.camera(())))
    np.testing.assert_array_equal(with_plan.position_bcs, without.position_bcs)
    assert with_plan.placing is None


def test_the_walk_shows_that_a_plan_is_too_large(walk: SimulatedWalk) -> None:
    larger = WallCosts.of(WalkableArea(walk.free, (0.0, 0.0), 1.03 * FINE_M))
    found = mapped(walk.camera(plans_with(larger)))
    assert found.placing is not None
    assert labelled(found) > 0.65
    assert 1.01 < found.placing.scale < 1.035
    assert np.nanmean(np.abs(as_complex(found.position_bcs[:, :2]) - 1.03 * walk.truth)) < 0.5


def test_a_walk_of_a_few_frames_is_not_placed(walk: SimulatedWalk) -> None:
    found = mapped(walk.camera(seconds=0.02))
    assert set(found.status) == {Status.NO_MAPPING}
    still = mapped(camera_with(np.zeros(100, dtype=np.complex128), walk.costs))
    assert set(still.status) == {Status.NO_MAPPING}


def test_unusable_frames_keep_their_own_status(walk: SimulatedWalk) -> None:
    camera = walk.camera(seconds=SHORT_S)
    camera.status[400:403] = Status.INVALID
    camera.position_acs[400:403] = np.nan
    found = mapped(tapped(camera, 600, complex(walk.truth[600])))
    assert found.status[398:405].tolist() == [0, 0, *[Status.INVALID] * 3, 0, 0]
    assert np.isnan(found.position_bcs[400:403]).all()


def test_a_walk_up_the_stairs_is_laid_over_the_plans_of_both_floors() -> None:
    scenario = regular_survey(7, "default", (0, 1), ("LG",), 1, 260.0, BuildingSettings(), climb=Climb.STAIRS)
    tour, log = walk_and_track(scenario, scenario.sessions[0])
    floors = scenario.building.floors
    costs = [WallCosts.of(WalkableArea(free_of(floor), (0.0, 0.0), FINE_M)) for floor in floors]
    plans = tuple(PlanOfFloor(number, partial(costs.__getitem__, number)) for number in (0, 1))
    status = np.zeros(len(log.time_ns), dtype=np.int8)
    camera = CameraTrack(log.time_ns, log.position_acs, log.orientation_acs, status, plans=plans)
    storeys = Storeys(0, np.array([0, 1]), np.array([floor.elevation_m for floor in floors]))
    found = mapped(camera, landmarks=replace(NONE, storeys=storeys))
    assert set(found.floor) == {0, 1}
    assert labelled(found) > 0.65
    off_m = np.abs(as_complex(found.position_bcs[:, :2]) - as_complex(position_at(tour, log.exposure_ns)[:, :2]))
    assert np.nanmean(off_m) < 0.4
    assert np.nanmax(off_m) < 1.5
    alone = mapped(replace(camera, plans=plans[:1]), landmarks=replace(NONE, storeys=storeys))
    assert labelled(alone) == 0
