from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.simulation.hand_made import make_floor, make_test_walk
from vislam2tag.core.arrays import FloatArray
from vislam2tag.simulation.model import position_at
from vislam2tag.simulation.station import (
    StationSettings,
    StationSetup,
    TimedPoints,
    place_station,
    shoot_points,
    simulate_station,
)

FREE = StationSettings(blocked_share=0.0)
SETUP = StationSetup(np.array([0.5, 5.0]), 0.7)


def from_local(setup: StationSetup, local: FloatArray) -> FloatArray:
    turn = np.exp(1j * setup.heading_rad) * (local[:, 0] + 1j * local[:, 1])
    return np.column_stack((turn.real, turn.imag)) + setup.position_bcs


def tracked(settings: StationSettings, walls: FloatArray | None = None, duration_s: float = 30.0) -> TimedPoints:
    walk = make_test_walk(duration_s)
    return simulate_station(walk, make_floor(walls=walls), SETUP, settings, np.random.default_rng(3))


@given(st.floats(-3.2, 3.2), st.tuples(st.floats(-50, 50), st.floats(-50, 50)))
def test_local_frame_is_turned_and_shifted(heading: float, origin: tuple[float, float]) -> None:
    setup = StationSetup(np.array(origin), heading)
    points = np.array([[0.0, 0.0], [3.0, 1.0], [-2.0, 7.0]])
    local = setup.local(points)
    assert np.allclose(from_local(setup, local), points, atol=1e-9)
    assert np.allclose(setup.local(np.array([origin])), 0)


def test_track_follows_the_walk_to_millimetres() -> None:
    track = tracked(FREE)
    assert np.median(np.diff(track.time_ns)) == pytest.approx(1e8, rel=0.1)
    truth = position_at(make_test_walk(30.0), track.time_ns)[:, :2]
    error = from_local(SETUP, track.position) - truth
    assert error.std() == pytest.approx(FREE.noise_m, rel=0.15)


def test_walls_and_people_hide_the_prism() -> None:
    behind = np.array([[[15.0, 0.0], [15.0, 20.0]]])
    seen = from_local(SETUP, tracked(FREE, walls=behind).position)
    assert seen[:, 0].max() < 15.05
    gaps = np.diff(tracked(StationSettings(blocked_share=0.2), duration_s=60.0).time_ns) / 1e9
    assert gaps.max() > 1.5


def test_stands_where_it_sees_the_reference_corridor() -> None:
    floor = make_floor(walls=np.array([[[0.0, 8.0], [15.0, 8.0]], [[15.0, 8.0], [15.0, 20.0]]]))
    setup = place_station(floor, floor.landmark_position[:, :2], np.random.default_rng(0))
    assert setup.position_bcs[1] == 5.0


def test_shots_are_in_the_stations_frame() -> None:
    points = np.array([[1.0, 6.0], [39.0, 4.0]])
    shots = shoot_points(SETUP, points, FREE, np.random.default_rng(0))
    assert np.abs(from_local(SETUP, shots) - points).max() < 0.03
