from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from tests.simulation.hand_made import START_NS, make_test_walk
from vislam2tag.simulation.model import continuous_signs, count_crossings, make_fields, orientation_at, position_at
from vislam2tag.simulation.settings import stream

CROSS = np.array([[[0.0, -1.0], [0.0, 1.0]], [[1.0, -1.0], [1.0, 1.0]], [[2.0, 5.0], [2.0, 6.0]]])


def test_counts_only_the_walls_between() -> None:
    start = np.array([[-1.0, 0.0], [-1.0, 0.0], [0.5, 0.5], [-1.0, 3.0]])
    end = np.array([[3.0, 0.0], [0.5, 0.0], [0.6, -0.5], [3.0, 3.0]])
    assert count_crossings(start, end, CROSS).tolist() == [2, 1, 0, 0]


def test_many_lines_are_counted_in_parts() -> None:
    start = np.tile([[-1.0, 0.0]], (10_000, 1))
    assert (count_crossings(start, start + np.array((4.0, 0.0)), CROSS) == 2).all()


coordinate = st.floats(-5, 5, allow_nan=False)


@given(st.tuples(coordinate, coordinate), st.tuples(coordinate, coordinate))
def test_is_the_same_in_both_directions(start: tuple[float, float], end: tuple[float, float]) -> None:
    first, second = np.array([start]), np.array([end])
    assert count_crossings(first, second, CROSS) == count_crossings(second, first, CROSS)


def test_no_walls() -> None:
    assert count_crossings(np.zeros((3, 2)), np.ones((3, 2)), np.empty((0, 2, 2))).tolist() == [0, 0, 0]


LENGTH_M = 3.0
PLACES = np.random.default_rng(0).uniform(0, 200, (4000, 3))


def test_has_the_given_spread_and_is_smooth() -> None:
    fields = make_fields([stream(1, i) for i in range(20)], sigma=4.0, length_m=LENGTH_M)
    values = np.stack([fields.at(PLACES, np.full(len(PLACES), i)) for i in range(20)])
    assert abs(values.std() - 4.0) < 0.3
    assert abs(values.mean()) < 0.3
    nearby = fields.at(PLACES + np.array((0.1, 0, 0)), np.zeros(len(PLACES), dtype=np.int64))
    assert np.abs(nearby - values[0]).max() < 1.0


def test_correlation_falls_with_distance_as_a_gaussian() -> None:
    fields = make_fields([stream(2, i) for i in range(200)], sigma=1.0, length_m=LENGTH_M)
    index = np.arange(200).repeat(20)
    here = fields.at(PLACES, index)
    for distance in (1.0, 3.0, 9.0):
        there = fields.at(PLACES + np.array((distance, 0, 0)), index)
        expected = np.exp(-(distance**2) / (2 * LENGTH_M**2))
        assert abs(np.mean(here * there) - expected) < 0.08


def test_fields_are_independent() -> None:
    fields = make_fields([stream(3, i) for i in range(2)], sigma=1.0, length_m=LENGTH_M)
    first, second = (fields.at(PLACES, np.full(len(PLACES), i)) for i in range(2))
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.1


def test_position_between_samples_and_beyond_the_ends() -> None:
    walk = make_test_walk()
    time_ns = START_NS + np.array([-1_000_000_000, 2_500_000, 7_501_234_567, 10**12])
    position = position_at(walk, time_ns)
    assert np.allclose(position[0], walk.position[0])
    assert np.allclose(position[1], walk.position[:2].mean(axis=0))
    assert abs(position[2, 0] - (1.0 + 7.501234567)) < 1e-9
    assert np.allclose(position[3], walk.position[-1])


def test_orientation_ignores_the_sign_of_quaternions() -> None:
    walk = make_test_walk()
    walk.orientation[::2] *= -1
    time_ns = START_NS + np.arange(0, 10_000_000_000, 3_333_333)
    found = Rotation.from_quat(orientation_at(walk, time_ns))
    seconds = (time_ns - START_NS) / 1e9
    yaw = 0.4 + 0.8 * np.sin(0.7 * seconds) + 0.3 * seconds
    pitch = 1.0 + 0.1 * np.sin(2 * np.pi * seconds)
    expected = Rotation.from_euler("zx", np.column_stack((yaw, pitch)))
    assert (found.inv() * expected).magnitude().max() < 2e-5


def test_signs_make_a_sequence_continuous() -> None:
    quaternion = np.tile([0.0, 0.0, 0.0, 1.0], (5, 1)) * np.array([1, -1, -1, 1, -1])[:, None]
    assert (continuous_signs(quaternion)[:, None] * quaternion == quaternion[0]).all()
