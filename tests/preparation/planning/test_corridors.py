"""The ways that a plan sees.

Walks for the prediction.

Tours over all ways.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

from tests.preparation.planning.floors import graph_of, ring, ways_with
from tests.preparation.planning.test_demands import floor_ways
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.preparation.planning.corridors import (
    STEP_M,
    WALK_M,
    Corridors,
    corridors_of,
    plan_tour,
    smooth_line,
    typical_walks,
)
from vislam2tag.site.walkable.graph import NodeKind


def test_straight_joints_are_joined_and_corners_are_ends() -> None:
    nodes = [(0.0, 0.0), (5.0, 0.0), (10.0, 0.0), (10.0, 6.0)]
    ways = corridors_of(graph_of(nodes, [(0, 1), (1, 2), (3, 2)]), 0.6)
    assert sorted(ways.length_m.tolist()) == [6.0, 10.0]
    assert len(ways.ends) == 3
    assert not ways.is_open.any()


def test_who_goes_on_never_turns_back_but_at_the_end() -> None:
    ways = corridors_of(graph_of([(0.0, 0.0), (8.0, 0.0), (8.0, 8.0), (16.0, 0.0)], [(0, 1), (1, 2), (1, 3)]), 0.6)
    into = next(half for half in range(6) if ways.ends[ways.stop(half)].tolist() == [8.0, 0.0])
    assert len(ways.onward(into)) == 2
    assert into ^ 1 not in ways.onward(into)
    assert ways.onward(into ^ 1) == (into,)


def test_rooms_are_ways_only_where_they_are_asked_for() -> None:
    graph = graph_of([(0.0, 0.0), (9.0, 0.0), (18.0, 0.0), (9.0, 7.0)], [(0, 1), (1, 2), (1, 3)], in_room=[0, 0, 1])  # type: ignore[list-item]
    assert corridors_of(graph, 0.6).length_m.tolist() == [18.0]
    assert sorted(corridors_of(graph, 0.6, rooms=True).length_m.tolist()) == [7.0, 9.0, 9.0]


def test_rooms_that_alone_connect_two_corridors_stay() -> None:
    nodes = [(0.0, 0.0), (9.0, 0.0), (12.0, 0.0), (12.0, 4.0), (15.0, 0.0), (24.0, 0.0)]
    edges = [(0, 1), (1, 2), (2, 3), (2, 4), (4, 5)]
    ways = corridors_of(graph_of(nodes, edges, in_room=[False, True, True, True, False]), 0.6)
    assert ways.length_m.sum() == 24.0
    assert set(plan_tour(ways, np.arange(len(ways.lines)), ways.length_m / 2).visit.tolist()) == {0}


def test_niches_are_left_out_and_the_way_past_them_is_one() -> None:
    graph = graph_of([(0.0, 0.0), (9.0, 0.0), (18.0, 0.0), (9.0, 4.0)], [(0, 1), (1, 2), (1, 3)])
    assert corridors_of(graph, 0.6, niche_m=5.0).length_m.tolist() == [18.0]
    assert len(corridors_of(graph, 0.6, niche_m=3.0).lines) == 3


def test_a_ring_without_any_turn_is_one_way() -> None:
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    nodes = [(float(x), float(y)) for x, y in 10 * np.column_stack((np.cos(angle), np.sin(angle)))]
    ways = corridors_of(graph_of(nodes, [(i, (i + 1) % 24) for i in range(24)]), 0.6)
    assert len(ways.lines) == 1
    assert ways.joined[0, 0] == ways.joined[0, 1]
    assert ways.length_m[0] == pytest.approx(24 * 20 * np.sin(np.pi / 24))


def test_places_of_open_areas_stay_ends() -> None:
    kinds = [NodeKind.JUNCTION, NodeKind.OPEN, NodeKind.OPEN]
    ways = corridors_of(graph_of([(0.0, 0.0), (9.0, 0.0), (15.0, 0.0)], [(0, 1), (1, 2)], kinds), 0.6)
    assert ways.is_open.sum() == 2
    assert ways.in_hall.tolist() == [False, True]


def test_points_and_directions_follow_the_line() -> None:
    ways = corridors_of(ring()[1], 0.6)
    middle = ways.length_m / 2
    for way, line in enumerate(ways.lines):
        point = ways.place(way, middle[way : way + 1])[0]
        assert np.linalg.norm(point - line[0]) == pytest.approx(middle[way])
        assert arc_lengths(line)[-1] == ways.length_m[way]
        assert np.linalg.norm(ways.direction(way, middle[way : way + 1])) == pytest.approx(1.0)


def test_walks_cover_all_ways_and_are_the_same_each_time() -> None:
    graph = ring()[1]
    walks = typical_walks(graph)
    assert all(np.array_equal(a, b) for a, b in zip(walks, typical_walks(graph), strict=True))
    everywhere = np.vstack(walks)
    for line in graph.polylines:
        for point in np.linspace(line[0], line[1], 20)[1:-1]:
            assert np.linalg.norm(everywhere - point, axis=1).min() < 0.5
    for walk in walks:
        assert WALK_M - 5 < np.linalg.norm(np.diff(walk, axis=0), axis=1).sum() < WALK_M + 40


def test_rooms_are_looked_into_now_and_then() -> None:
    nodes = [(float(x), 0.0) for x in range(0, 50, 5)] + [(float(x), 5.0) for x in range(5, 45, 5)]
    edges = [(i, i + 1) for i in range(9)] + [(i + 1, 10 + i) for i in range(8)]
    graph = graph_of(nodes, edges, in_room=[False] * 9 + [True] * 8)
    inside = np.concatenate([walk[:, 1] > 2.0 for walk in typical_walks(graph)])
    assert 0.02 < inside.mean() < 0.3


def test_lines_are_sampled_densely_with_round_corners() -> None:
    corner = smooth_line(np.array([(0.0, 0.0), (10.0, 0.0), (10.0, 10.0)]))
    assert np.linalg.norm(np.diff(corner, axis=0), axis=1).max() < 1.01 * STEP_M
    assert np.linalg.norm(corner - (10.0, 0.0), axis=1).min() > 0.1
    assert typical_walks(graph_of([(0.0, 0.0)], [])) == []


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
