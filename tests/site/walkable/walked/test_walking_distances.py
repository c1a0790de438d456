from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.site.walkable.hand_made import rectangles
from vislam2tag.site.walkable.walking_distances import WalkingDistances

EMPTY = WalkingDistances(rectangles(16, 16, (1, 1, 15, 15)))
BEND = WalkingDistances(rectangles(20, 20, (1, 1, 3, 19), (1, 17, 19, 19)))
INSIDE = st.tuples(st.floats(1.5, 14.5), st.floats(1.5, 14.5))


@settings(max_examples=30)
@given(INSIDE, INSIDE)
def test_ways_over_open_floor_are_straight(start: tuple[float, float], stop: tuple[float, float]) -> None:
    straight = float(np.hypot(start[0] - stop[0], start[1] - stop[1]))
    (walked,) = EMPTY.between(np.array([start]), np.array([stop]))[0]
    assert straight <= walked <= 1.03 * straight + 0.35


def test_ways_lead_around_corners() -> None:
    start, stop = np.array([2.0, 2.0]), np.array([18.0, 18.0])
    exact = float(np.hypot(1, 15) + np.hypot(15, 1))
    assert BEND.between(start[None], stop[None])[0, 0] == pytest.approx(exact, rel=0.02)
    way = BEND.path(start, stop)
    assert len(way) == 3
    assert float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum()) == pytest.approx(exact, rel=0.01)
    assert way[[0, -1]].tolist() == [start.tolist(), stop.tolist()]


def test_corners_are_moved_off_walls_and_the_way_stays_clear() -> None:
    way = BEND.path(np.array([2.0, 2.0]), np.array([18.0, 18.0]))
    moved = BEND.off_walls(way)
    assert BEND.space.clearance_at(way[1:2])[0] < 0.2
    assert BEND.space.clearance_at(moved)[1] >= 0.4
    assert np.abs(moved - way).max() <= 0.4 + 1e-9
    assert BEND.space.clear_line(moved[:-1], moved[1:]).all()
    assert moved[[0, -1]].tolist() == way[[0, -1]].tolist(), "there is room around them"


def test_the_nearest_of_several_targets_counts() -> None:
    targets = np.array([(2.0, 17.5), (18.0, 18.0)])
    points = np.array([(2.0, 8.0), (15.0, 18.0)])
    assert BEND.to_nearest(points, targets) == pytest.approx([9.5, 3.0], abs=0.4)


def test_distances_are_symmetric() -> None:
    points = np.array([(2.0, 2.0), (2.0, 15.0), (9.0, 18.0), (18.0, 18.0)])
    lengths = BEND.between(points, points)
    assert lengths == pytest.approx(lengths.T)
    assert np.diag(lengths) == pytest.approx(0.0, abs=0.3)
