import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.simulation.building.sight import count_crossings

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
