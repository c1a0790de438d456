"""The shortest further walk that fills the gaps of a floor's coverage.

Stops are chosen so that each gap lies within a radius of one; ways between them are shortest paths over walkable cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, dijkstra

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.dataset.coverage.floor_coverage import FloorCoverage
from vislam2tag.walkable.walked.short_walk import WALKING_M_S, covering_stops, short_order

_EPSILON = 1e-9


@dataclass(frozen=True)
class GapWalk:
    """A walk over walkable cells of one floor; a floor whose walkable cells hang not together takes several."""

    points_m: FloatArray
    """Corners of the way (k, 2), BCS."""
    stops_m: FloatArray
    """Where it comes near each gap, in order (s, 2), BCS."""
    length_m: float
    gap_cells: int
    """Cells that it fills."""

    def minutes(self, speed_m_s: float = WALKING_M_S) -> float:
        """How long it takes."""
        return self.length_m / speed_m_s / 60


def gap_walks(
    coverage: FloorCoverage, radius_m: float = 2.0, start_m: tuple[float, float] | None = None
) -> tuple[GapWalk, ...]:
    """Plan the walks that come within ``radius_m`` of every gap, the one that fills most first.

    A walk begins at the walkable cell nearest to ``start_m`` where that is in its part of the floor, else anywhere.
    """
    if not coverage.gaps.any():
        return ()
    ways = _WalkGraph.of(coverage)
    _, part = connected_components(ways.graph, directed=False)
    gap = coverage.gaps[coverage.walkable]
    start = None if start_m is None else int(np.argmin(np.linalg.norm(ways.places_m - start_m, axis=1)))
    walks = []
    for own in np.unique(part[gap]):
        begin = start if start is not None and part[start] == own else None
        walks.append(_walk(ways, np.flatnonzero(gap & (part == own)), radius_m, begin))
    return tuple(sorted(walks, key=lambda walk: -walk.gap_cells))


@dataclass(frozen=True)
class _WalkGraph:
    """The walkable cells (n) as a graph whose edges are metres."""

    places_m: FloatArray
    """Centres (n, 2)."""
    graph: csr_array

    @classmethod
    def of(cls, coverage: FloorCoverage) -> _WalkGraph:
        """Join neighbours; a diagonal step needs both cells beside it, so that no corner is cut."""
        walkable, cell_m = coverage.walkable, coverage.grid.cell_m
        number = np.cumsum(walkable.ravel()).reshape(walkable.shape) - 1
        right, up = (walkable[:, :-1] & walkable[:, 1:]), (walkable[:-1] & walkable[1:])
        square = right[:-1] & right[1:] & up[:, :-1] & up[:, 1:]
        steps = (
            (number[:, :-1][right], number[:, 1:][right], cell_m),
            (number[:-1][up], number[1:][up], cell_m),
            (number[:-1, :-1][square], number[1:, 1:][square], np.sqrt(2) * cell_m),
            (number[:-1, 1:][square], number[1:, :-1][square], np.sqrt(2) * cell_m),
        )
        ends = [np.concatenate([step[side] for step in steps]) for side in (0, 1)]
        length = np.concatenate([np.full(len(step[0]), step[2]) for step in steps])
        size = int(walkable.sum())
        graph = csr_array((length, (ends[0], ends[1])), shape=(size, size))
        return cls(coverage.grid.centres_m(np.argwhere(walkable)), graph)

    def between(self, places: IntArray) -> tuple[FloatArray, IntArray]:
        """Lengths (s, s) of the shortest ways between places, and for each way back the place before (s, n)."""
        rows = [dijkstra(self.graph, directed=False, indices=place, return_predecessors=True) for place in places]
        return np.array([length[places] for length, _ in rows]), np.array([before for _, before in rows])


def _walk(ways: _WalkGraph, gaps: IntArray, radius_m: float, start: int | None) -> GapWalk:
    """Plan one walk past gaps (g,), from the cell ``start`` where it is given; cells are indices."""
    stops = gaps[covering_stops(ways.places_m[gaps], radius_m)]
    places = stops if start is None else np.append(start, stops)
    length_m, before = ways.between(places)
    order = short_order(length_m, free=start is None)
    legs = [_way(before[a], int(places[a]), int(places[b])) for a, b in pairwise(order)]
    cells = np.concatenate([places[order[:1]], *legs])
    return GapWalk(
        points_m=_corners(ways.places_m[cells]),
        stops_m=ways.places_m[places[order[0 if start is None else 1 :]]],
        length_m=float(length_m[order[:-1], order[1:]].sum()),
        gap_cells=len(gaps),
    )


def _way(before: IntArray, start: int, stop: int) -> IntArray:
    """Cells (k,) from ``start``, left out, to ``stop``; ``before`` (n,) is each cell's place before on the way."""
    way = []
    while stop != start:
        way.append(stop)
        stop = int(before[stop])
    return np.array(way[::-1], dtype=np.int64)


def _corners(points_m: FloatArray) -> FloatArray:
    """Leave out the points (k, 2) in which a way goes straight on."""
    if len(points_m) < 3:
        return points_m
    into, out = np.diff(points_m[:-1], axis=0), np.diff(points_m[1:], axis=0)
    turns = np.abs(into - out).max(axis=1) > _EPSILON
    corners: FloatArray = points_m[np.concatenate([[True], turns, [True]])]
    return corners
