"""The storey of each frame, by its height."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.estimation.heights import floor_of_heights

LEVELS = np.array([0.0, 3.5, 7.5])


@given(st.lists(st.floats(-5, 15), min_size=1, max_size=60), st.integers(0, 2))
def test_decided_heights_get_the_nearest_storey_and_others_a_neighbour(heights: list[float], start: int) -> None:
    height = np.array(heights)
    floor = floor_of_heights(height + 1.4, LEVELS, 1.4, start)
    apart = np.abs(height[:, None] - LEVELS)
    nearest = apart.argmin(axis=1)
    undecided = np.diff(np.sort(apart, axis=1)[:, :2], axis=1)[:, 0] < 2 * 0.5 + 1e-9
    assert np.array_equal(floor[~undecided], nearest[~undecided])
    assert set(floor.tolist()) <= {0, 1, 2}


def test_hovering_about_the_middle_changes_nothing() -> None:
    height = 1.4 + 1.75 + 0.2 * np.sin(np.arange(300))
    assert set(floor_of_heights(height, LEVELS, 1.4, 0).tolist()) == {0}
    assert set(floor_of_heights(height, LEVELS, 1.4, 1).tolist()) == {1}


def test_a_climb_changes_once_in_the_middle() -> None:
    height = 1.4 + np.linspace(0, 3.5, 1001) + 0.1 * np.sin(np.arange(1001))
    floor = floor_of_heights(height, LEVELS, 1.4, 0)
    (change,) = np.flatnonzero(np.diff(floor))
    assert abs(change - 500) < 40


def test_storeys_may_come_in_any_order() -> None:
    floor = floor_of_heights(np.array([1.4, 4.9, 8.9]), LEVELS[[2, 0, 1]], 1.4, 1)
    assert floor.tolist() == [1, 2, 0]
