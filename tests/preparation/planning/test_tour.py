"""Tours over all ways."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from tests.preparation.planning.floors import graph_of, ring, ways_with
from tests.preparation.planning.test_demands import floor_ways
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.preparation.planning.corridors import Corridors, corridors_of
from vislam2tag.preparation.planning.tour import plan_tour


def ways_walked(ways: Corridors, line: np.ndarray) -> float:
    return float(arc_lengths(line)[-1])


@settings(max_examples=80)
@given(floor_ways())
def test_a_tour_walks_every_way_and_meets_every_landmark(ways: Corridors) -> None:
    middle = ways.length_m / 2
    tour = plan_tour(ways, np.arange(len(ways.lines)), middle)
    assert set(tour.visit.tolist()) == set(range(len(ways.lines)))
    assert (np.diff(tour.visit_m) >= 0).all()
    walked = ways.length_m.sum() + tour.twice_m
    assert tour.twice_m <= ways.length_m.sum()
    assert tour.visit_m[-1] <= walked
    passes = np.bincount(tour.visit, minlength=len(ways.lines))
    assert passes.max() <= 2
    assert ways.length_m[passes == 2].sum() == pytest.approx(tour.twice_m)


def test_a_ring_is_walked_once_and_a_dead_end_twice() -> None:
    ways = corridors_of(ring()[1], 0.6)
    tour = plan_tour(ways, np.array([0, 2]), np.array([5.0, 5.0]))
    assert tour.length_m == pytest.approx(ways.length_m.sum())
    assert tour.twice_m == 0.0
    assert np.allclose(tour.line[0], tour.line[-1])
    crossing = corridors_of(graph_of([(0.0, 0.0), (9.0, 0.0), (20.0, 0.0), (9.0, 7.0)], [(0, 1), (1, 2), (1, 3)]), 0.6)
    assert plan_tour(crossing, np.array([0]), np.array([1.0])).length_m == pytest.approx(2 * 27.0)


def test_two_landmarks_are_met_early() -> None:
    ways = ways_with([40, 3, 3], [(0, 0), (0, 1), (1, 0)], 2)
    tour = plan_tour(ways, np.array([1, 2]), np.array([1.5, 1.5]))
    assert tour.first_m().tolist() == [1.5, 4.5]
    assert tour.duration_s(0.5) == pytest.approx(tour.length_m / 0.5 + 2 * 2.0)


def test_the_shorter_of_two_ways_is_walked_twice() -> None:
    ways = ways_with([30, 4, 9], [(0, 1), (0, 1), (0, 1)], 2)
    assert plan_tour(ways, np.array([0]), np.array([1.0])).twice_m == 4.0
