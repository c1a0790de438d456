from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import CellGrid
from vislam2tag.dataset.coverage.floor_coverage import FloorCoverage
from vislam2tag.dataset.coverage.gap_walk import GapWalk, _WalkGraph, gap_walks
from vislam2tag.dataset.model import Storey


def plan(*lines: str, cell_m: float = 1.0) -> FloorCoverage:
    """``.`` walkable and covered, ``o`` a gap, else no way; the last line is row 0."""
    letters = np.array([list(line) for line in lines[::-1]])
    grid = CellGrid((10.0, 20.0), cell_m, *letters.shape)
    return FloorCoverage(Storey("", 0), grid, {}, np.isin(letters, (".", "o")), letters == ".", 0)


def cells_along(walk: GapWalk, coverage: FloorCoverage) -> np.ndarray:
    """Every cell (k, 2) that a walk runs through."""
    points = []
    for a, b in itertools.pairwise(walk.points_m):
        points.append(a + (b - a) * np.linspace(0, 1, 200)[:, None])
    return coverage.grid.cells_of(np.concatenate([*points, walk.points_m]))


def test_from_the_middle_of_a_corridor_the_nearer_end_comes_first() -> None:
    (walk,) = gap_walks(plan("o......o"), 0.5, (13.4, 20.5))
    assert walk.length_m == pytest.approx(3 + 7)
    assert walk.points_m.tolist() == [[13.5, 20.5], [10.5, 20.5], [17.5, 20.5]]
    assert walk.stops_m.tolist() == [[10.5, 20.5], [17.5, 20.5]]
    assert walk.minutes(2.0) == pytest.approx(10 / 2 / 60)


def test_without_a_start_it_begins_where_the_walk_is_shortest() -> None:
    (walk,) = gap_walks(plan("..o..o.o"), 0.5)
    assert walk.length_m == pytest.approx(5)


def test_a_wall_is_walked_around_and_no_corner_cut() -> None:
    coverage = plan("o.#.o", "..#..", ".....")
    (walk,) = gap_walks(coverage, 0.5)
    # Straight down, along the lowest row below the wall, and up again: one diagonal step on either side.
    assert walk.length_m == pytest.approx(2 * (1 + np.sqrt(2)) + 2)
    assert coverage.walkable[tuple(cells_along(walk, coverage).T)].all()


def test_neighbouring_gaps_are_filled_from_one_stop() -> None:
    (walk,) = gap_walks(plan("...", ".oo", ".oo"), 2.0)
    assert len(walk.stops_m) == 1
    assert (walk.length_m, walk.gap_cells) == (0, 4)


def test_parts_that_hang_not_together_take_a_walk_each_and_the_larger_comes_first() -> None:
    walks = gap_walks(plan("o.#o.o"), 0.5, (10.5, 20.5))
    assert [walk.gap_cells for walk in walks] == [2, 1]
    assert [walk.length_m for walk in walks] == [2, 0]


def test_no_gap_takes_no_walk() -> None:
    assert gap_walks(plan("..", "..")) == ()


def test_metres_follow_the_cells() -> None:
    (walk,) = gap_walks(plan("o..o", cell_m=2.5), 1.0)
    assert walk.length_m == pytest.approx(7.5)


def best_length(length_m: FloatArray) -> float:
    orders = np.array(list(itertools.permutations(range(len(length_m)))))
    return float(length_m[orders[:, :-1], orders[:, 1:]].sum(axis=1).min())


@settings(max_examples=40)
@given(st.integers(0, 10_000))
def test_every_gap_is_reached_over_walkable_cells_on_nearly_the_shortest_way(seed: int) -> None:
    rng = np.random.default_rng(seed)
    letters = np.where(rng.random((9, 12)) < 0.2, "#", ".")
    letters[rng.integers(0, 9, 7), rng.integers(0, 12, 7)] = "o"
    coverage = plan(*("".join(line) for line in letters))
    gaps = coverage.grid.centres_m(np.argwhere(coverage.gaps))
    walks = gap_walks(coverage, 0.5)
    reached = np.concatenate([walk.stops_m for walk in walks])
    assert sorted(map(tuple, reached)) == sorted(map(tuple, gaps))
    ways = _WalkGraph.of(coverage)
    for walk in walks:
        assert coverage.walkable[tuple(cells_along(walk, coverage).T)].all()
        steps = np.linalg.norm(np.diff(walk.points_m, axis=0), axis=1)
        assert steps.sum() == pytest.approx(walk.length_m)
        places = [int(np.flatnonzero((ways.places_m == stop).all(axis=1))[0]) for stop in walk.stops_m]
        length_m = dijkstra(ways.graph, directed=False, indices=places)[:, places]
        assert walk.length_m <= 1.1 * best_length(length_m) + 1e-6
