"""Walks over several floors: by stairs, which a tracker sees, and by lift, of which it sees nothing."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.simulation.building import make_building
from vislam2tag.simulation.model import (
    FloorTour,
    SimulatedFloor,
    TrackerLog,
    TrueWalk,
    floor_at,
    floor_tour_from,
    position_at,
    seen_from_first,
)
from vislam2tag.simulation.phones import make_device
from vislam2tag.simulation.radio import RadioSettings, make_radio_environment, mean_rss_dbm, simulate_wifi
from vislam2tag.simulation.settings import BuildingSettings, Climb, Locale, TrackerSettings, WalkSettings, stream
from vislam2tag.simulation.tracker import track
from vislam2tag.simulation.walk import make_walk

BUILDING = make_building(BuildingSettings(), 3, (0, 1, 2), distinct_ids=True)
ELEVATION = {floor.number: floor.elevation_m for floor in BUILDING.floors}
START = 1


@cache
def toured(climb: Climb, duration_s: float = 240.0, seed: int = 5) -> tuple[TrueWalk, FloorTour, SimulatedFloor]:
    tour = floor_tour_from(BUILDING, START, climb)
    floor = seen_from_first(tour)
    return make_walk(floor, duration_s, WalkSettings(), stream(seed, climb), tour=tour), tour, floor


@cache
def tracked(climb: Climb, severity: float, quantile: float = 0.9) -> TrackerLog:
    walk, _, floor = toured(climb)
    return track(walk, floor, TrackerSettings(severity=severity), stream(1, "tracker"), quantile)


@pytest.mark.parametrize("climb", list(Climb))
def test_walks_start_on_their_own_floor_and_visit_others_at_carrying_height(climb: Climb) -> None:
    walk, _, _ = toured(climb)
    assert walk.floor == START
    assert walk.floor_at[0] == START
    assert len(set(walk.floor_at.tolist())) > 1
    above = walk.position[:, 2] - np.array([ELEVATION[f] - ELEVATION[START] for f in walk.floor_at.tolist()])
    on_floor = np.abs(above - 1.37) < 0.2
    assert on_floor.mean() > 0.8
    assert np.abs(above - 1.37).max() < 0.5 * 3.6 + 0.1


@pytest.mark.parametrize("climb", list(Climb))
def test_climbing_is_smooth_and_no_faster_than_people_and_lifts_are(climb: Climb) -> None:
    walk, _, _ = toured(climb)
    velocity = np.diff(walk.position[:, 2]) * walk.rate_hz
    acceleration = np.diff(velocity) * walk.rate_hz
    assert np.abs(velocity).max() < 1.8
    assert np.abs(acceleration).max() < 8


@pytest.mark.parametrize("climb", list(Climb))
def test_landmarks_passed_hang_on_the_floor_where_the_walker_is(climb: Climb) -> None:
    walk, _, floor = toured(climb)
    assert len(set(walk.landmarks_passed.tolist())) >= 4
    for landmark in walk.landmarks_passed.tolist():
        assert np.linalg.norm(walk.position - floor.landmark_position[landmark], axis=1).min() < 0.95


def test_a_lift_is_ridden_standing_still_and_stairs_are_not() -> None:
    by_stairs, by_lift = toured(Climb.STAIRS)[0], toured(Climb.LIFT)[0]
    assert len(by_stairs.rides_ns) == 0
    assert not by_stairs.unseen_m.any()
    assert len(by_lift.rides_ns) >= 2
    for start_ns, stop_ns in by_lift.rides_ns.tolist():
        inside = (by_lift.time_ns >= start_ns) & (by_lift.time_ns <= stop_ns)
        assert by_lift.speed[inside].max() < 0.05
        assert abs(np.ptp(by_lift.position[inside, 2])) == pytest.approx(3.6, abs=0.1)


def _vertical_error(climb: Climb, severity: float) -> FloatArray:
    """How far the tracker's vertical axis is off the truth, at each frame, from the first frame on."""
    walk, log = toured(climb)[0], tracked(climb, severity)
    height = position_at(walk, log.exposure_ns)[:, 2]
    off = log.position_acs[:, 1] - (height - height[0])
    return np.asarray(off - off[0])


def test_a_perfect_tracker_sees_stairs_and_no_lift() -> None:
    assert np.abs(_vertical_error(Climb.STAIRS, 0.0)).max() < 0.05
    walk, log = toured(Climb.LIFT)[0], tracked(Climb.LIFT, 0.0)
    ridden = np.interp(log.exposure_ns - walk.time_ns[0], walk.time_ns - walk.time_ns[0], walk.unseen_m)
    assert np.abs(_vertical_error(Climb.LIFT, 0.0) + ridden).max() < 0.05
    assert not log.landmarks.lost.any()


def test_tracking_suffers_when_a_lift_is_left_and_the_vertical_axis_drifts_and_jumps() -> None:
    walk, log = toured(Climb.LIFT)[0], tracked(Climb.LIFT, 1.0)
    events = [event.frame for event in log.events if event.kind in ("lost", "break")]
    for end_ns in walk.rides_ns[:, 1]:
        frame = int(np.searchsorted(log.exposure_ns, end_ns))
        assert min(abs(frame - event) for event in events) < 90
    error = _vertical_error(Climb.STAIRS, 1.0)
    assert 0.1 < np.abs(error).max() < 10
    assert np.abs(np.diff(error)).max() > 0.1


def test_camera_and_landmarks_rise_together_at_a_map_update() -> None:
    log = tracked(Climb.STAIRS, 1.0)
    frame = next(event.frame for event in log.events if event.kind == "map_update" and 300 < event.frame < 3000)
    before, after = (log.landmarks.frame == f for f in (frame - 1, frame))
    known = np.intersect1d(log.landmarks.landmark[before], log.landmarks.landmark[after])
    steps = [
        float(np.diff(log.landmarks.position_acs[(log.landmarks.landmark == j) & (before | after), 1])[0])
        for j in known
    ]
    camera = float(log.position_acs[frame, 1] - log.position_acs[frame - 1, 1])
    assert np.median(steps) == pytest.approx(camera, abs=0.03)
    assert abs(camera) > 0.005


def test_radio_waves_are_those_of_the_floor_where_the_walker_is() -> None:
    walk = toured(Climb.STAIRS)[0]
    radio = make_radio_environment(BUILDING, RadioSettings(fading_sigma_db=0.0, miss_share=0.0), 1)
    receiver = make_device("LG", Locale.EN, 1).receiver
    log = simulate_wifi(radio, walk, receiver, stream(1, "wifi"))
    time_ns = log.time_us * 1000
    floors, place = floor_at(walk, time_ns), position_at(walk, time_ns)
    assert len(set(floors.tolist())) > 1
    for floor in set(floors.tolist()):
        here = floors == floor
        own = place[here] + (0.0, 0.0, ELEVATION[START] - ELEVATION[floor])
        mean = mean_rss_dbm(radio, floor, own, log.access_point[here], -120.0)
        assert np.abs(log.rss_dbm[here] - receiver.offset_db - mean).max() <= 0.51


def test_ids_differ_between_floors() -> None:
    ids = [name for floor in BUILDING.floors for name in floor.landmark_ids]
    assert len(set(ids)) == len(ids) == 36
    assert seen_from_first(floor_tour_from(BUILDING, START, Climb.MIXED)).landmark_ids[0] == "101"


def test_one_seed_same_walk() -> None:
    again = make_walk(
        toured(Climb.MIXED)[2], 240.0, WalkSettings(), stream(5, Climb.MIXED), tour=toured(Climb.MIXED)[1]
    )
    assert np.array_equal(again.position, toured(Climb.MIXED)[0].position)
