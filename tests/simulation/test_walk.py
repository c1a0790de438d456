"""True walks: duration, walls, landmarks in view, control points, smoothness."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.simulation.test_building import distance_to_walls
from vislam2tag.simulation.building import make_building
from vislam2tag.simulation.model import SimulatedFloor, TrueWalk
from vislam2tag.simulation.settings import BuildingSettings, WalkSettings, WalkStyle, stream, walk_settings
from vislam2tag.simulation.walk import make_walk

FLOOR = make_building(BuildingSettings(), 3, (4,)).floors[0]


def walk(duration_s: float, settings: WalkSettings, seed: int = 1, floor: SimulatedFloor = FLOOR) -> TrueWalk:
    return make_walk(floor, duration_s, settings, stream(seed, "walk"))


@pytest.mark.parametrize("duration_s", [20.0, 61.5, 960.0])
def test_duration_and_rate(duration_s: float) -> None:
    made = walk(duration_s, WalkSettings())
    assert (made.time_ns[-1] - made.time_ns[0]) / 1e9 == pytest.approx(duration_s)
    assert np.all(np.diff(made.time_ns) == 5_000_000)
    assert all(len(values) == len(made.time_ns) for values in (made.position, made.orientation, made.speed))


@pytest.mark.parametrize("style", list(WalkStyle))
def test_stays_off_walls_at_human_speed(style: WalkStyle) -> None:
    for seed in range(6):
        settings = BuildingSettings(dead_ends=seed % 5, cross_corridors=seed % 3)
        floor = make_building(settings, seed, (1,)).floors[0]
        made = walk(150.0, walk_settings(style), seed, floor)
        assert distance_to_walls(made.position[::20, :2], floor.walls).min() > 0.25
        assert 0.6 < made.speed.mean() < 1.3
        assert made.speed.max() < 2.2


def test_landmarks_are_passed_close_by_and_looked_at() -> None:
    made = walk(180.0, WalkSettings())
    assert len(set(made.landmarks_passed.tolist())) >= 5
    for landmark in set(made.landmarks_passed.tolist()):
        sheet = FLOOR.landmark_position[landmark]
        distance = np.linalg.norm(made.position - sheet, axis=1)
        nearest = int(np.argmin(distance))
        assert 0.4 < distance[nearest] < 0.95
        ahead = Rotation.from_quat(made.orientation[nearest]).apply([0.0, 0.0, -1.0])
        to_sheet = (sheet - made.position[nearest]) / distance[nearest]
        assert np.degrees(np.arccos(ahead @ to_sheet)) < 30


def test_phone_is_held_upright_along_the_way() -> None:
    made = walk(120.0, WalkSettings(look=False, rooms=0.0))
    up = Rotation.from_quat(made.orientation).apply([0.0, 1.0, 0.0])
    assert up[:, 2].min() > 0.8
    velocity = np.gradient(made.position[:, :2], 1 / made.rate_hz, axis=0)
    ahead = Rotation.from_quat(made.orientation).apply([0.0, 0.0, -1.0])[:, :2]
    moving = made.speed > 0.5
    cosine = (velocity * ahead).sum(axis=1)[moving] / np.linalg.norm(velocity, axis=1)[moving]
    assert np.median(cosine) > 0.9


def test_gait_bobs_twice_a_second() -> None:
    made = walk(100.0, WalkSettings(pauses_per_minute=0.0))
    up = made.position[2000:, 2] - made.position[2000:, 2].mean()
    frequency = np.fft.rfftfreq(len(up), 1 / made.rate_hz)
    assert 1.4 < frequency[np.argmax(np.abs(np.fft.rfft(up)))] < 2.4
    assert 0.02 < np.ptp(up) < 0.08


def test_acceleration_and_turn_rate_are_a_persons() -> None:
    made = walk(180.0, WalkSettings())
    acceleration = np.gradient(np.gradient(made.position, 1 / made.rate_hz, axis=0), 1 / made.rate_hz, axis=0)
    assert np.abs(acceleration).max() < 10
    turn = (Rotation.from_quat(made.orientation[:-1]).inv() * Rotation.from_quat(made.orientation[1:])).magnitude()
    assert turn.max() * made.rate_hz < 8


def test_presses_lie_at_their_control_points() -> None:
    made = walk(180.0, walk_settings(WalkStyle.CONTROL_POINTS))
    assert len(made.presses_ns) > 5
    at = np.searchsorted(made.time_ns, made.presses_ns)
    off = np.linalg.norm(made.position[at, :2] - FLOOR.control_points[made.pressed_point], axis=1)
    assert off.max() < 0.85
    assert len(walk(60.0, WalkSettings()).presses_ns) == 0


def test_running_and_people() -> None:
    made = walk(180.0, walk_settings(WalkStyle.SURVEY, runs=1, people=2))
    running_s = (made.speed > 1.7).sum() / made.rate_hz
    assert 2 < running_s < 15
    assert made.blocked_ns.shape == (2, 2)
    assert np.all((np.diff(made.blocked_ns, axis=1) > 1.9e9) & (np.diff(made.blocked_ns, axis=1) < 5.1e9))


def test_total_station_walk_keeps_to_one_corridor() -> None:
    made = walk(120.0, walk_settings(WalkStyle.TOTAL_STATION))
    assert np.ptp(made.position[:, 1]) < BuildingSettings().corridor_width_m
    assert made.speed.std() > 0.1
