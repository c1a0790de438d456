"""How far it is to walk from place to place around walls, and short orders of stops."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from networkx import from_numpy_array
from networkx.algorithms.approximation import greedy_tsp
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import KDTree, cKDTree

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.site.walkable.space import WalkableSpace

_STEP_M = 0.2
"""Distance of the places between which walks step; a multiple of the cells."""
_MOVES = ((0, 1), (1, 0), (1, 1), (1, -1), (1, 2), (2, 1), (1, -2), (2, -1))
"""Steps as the queen's and the knight's: ways are at most 2.8 % too long, 1.4 % in the mean over all directions."""
_ASIDE_M = 0.4
"""Who walks keeps so far off walls and posts of doors, where there is room."""
_OFFSETS_M = np.stack(np.meshgrid(*2 * (np.linspace(-_ASIDE_M, _ASIDE_M, 9),)), axis=-1).reshape(-1, 2)
_AROUND = _OFFSETS_M[np.argsort(np.hypot(*_OFFSETS_M.T), kind="stable")]
"""Places (c, 2) around a corner, the nearest first, metres."""


@dataclass(frozen=True)
class WalkingDistances:
    """Shortest ways over a walkable space; the first question takes longest, the rest is kept."""

    space: WalkableSpace

    def between(self, starts_m: FloatArray, stops_m: FloatArray, limit_m: float = np.inf) -> FloatArray:
        """Lengths (a, b) of the shortest ways from points (a, 2) to points (b, 2), metres; one row at a time.

        Infinite where nothing joins them within ``limit_m``.
        """
        first, first_off = self._nearest(starts_m)
        last, last_off = self._nearest(stops_m)
        rows = [np.asarray(dijkstra(self._steps, indices=one, limit=limit_m))[last] for one in first]
        lengths: FloatArray = np.array(rows).reshape(len(first), len(last)) + first_off[:, None] + last_off
        straight = np.linalg.norm(np.asarray(starts_m)[:, None] - np.asarray(stops_m), axis=2)
        return np.asarray(np.maximum(lengths, straight))

    def off_space_m(self, points_m: FloatArray) -> FloatArray:
        """How far (n,) each point (n, 2) is from the nearest place of the space, metres."""
        return self._nearest(points_m)[1]

    def to_nearest(self, points_m: FloatArray, targets_m: FloatArray, limit_m: float = np.inf) -> FloatArray:
        """Length (n,) of the shortest way from each point (n, 2) to the nearest of the targets (t, 2), metres.

        Infinite beyond ``limit_m``.
        """
        goals, _ = self._nearest(targets_m)
        lengths = np.asarray(dijkstra(self._steps, indices=np.unique(goals), min_only=True, limit=limit_m))
        nearest, off = self._nearest(points_m)
        return np.asarray(lengths[nearest] + off)

    def path(self, start_m: FloatArray, stop_m: FloatArray, limit_m: float = np.inf) -> FloatArray:
        """Corners (k, 2) of the shortest way from one point (2,) to another, both included, taut between walls.

        It is not longer than ``limit_m``, for which a length that is known spares looking further.
        """
        (first, last), _ = self._nearest(np.array((start_m, stop_m)))
        _, before = dijkstra(self._steps, indices=first, return_predecessors=True, limit=limit_m)
        steps = [int(last)]
        while steps[-1] != first:
            steps.append(int(before[steps[-1]]))
        way = np.vstack((start_m, self.places_m[steps[::-1]], stop_m))
        return self._taut(way)

    def off_walls(self, way: FloatArray) -> FloatArray:
        """Move corners of a way (k, 2) off walls, by :data:`_ASIDE_M` along each axis at most; its legs stay clear."""
        moved = way.copy()
        clearance_m = self.space.clearance_at(way)
        for k in np.flatnonzero(clearance_m < _ASIDE_M):
            around = way[k] + _AROUND
            room_m = np.minimum(self.space.clearance_at(around), _ASIDE_M)
            for neighbour in (*moved[k - 1 : k], *way[k + 1 : k + 2]):
                room_m[~self.space.clear_line(neighbour, around)] = 0
            best = int(np.argmax(room_m))  # the nearest of equals
            if room_m[best] > clearance_m[k]:
                moved[k] = around[best]
        return moved

    def _taut(self, way: FloatArray) -> FloatArray:
        """Leave out every corner of a way (k, 2) that is between two that see each other."""
        corners = [0]
        while corners[-1] < len(way) - 1:
            here = corners[-1]
            seen = np.flatnonzero(self.space.clear_line(way[here], way[here + 2 :]))
            corners.append(here + 2 + int(seen[-1]) if len(seen) else here + 1)
        return np.asarray(way[corners])

    @cached_property
    def _stride(self) -> int:
        return max(1, round(_STEP_M / self.space.area.cell_m))

    @cached_property
    def _cells(self) -> IntArray:
        """Cells (n, 2) from which walks step."""
        return np.argwhere(self.space.area.mask[:: self._stride, :: self._stride]) * self._stride

    @cached_property
    def places_m(self) -> FloatArray:
        """(n, 2) the places between which walks step: an even grid over the space, BCS metres."""
        return self.space.area.grid.centres_m(self._cells)

    @property
    def step_m(self) -> float:
        """Distance of neighbouring places, metres."""
        return self._stride * self.space.area.cell_m

    @cached_property
    def _tree(self) -> KDTree:
        return KDTree(self.places_m)

    @cached_property
    def _steps(self) -> csr_array:
        """Lengths of the steps between places (n, n), metres."""
        stride, mask = self._stride, self.space.area.mask
        number = np.full(mask.shape, -1, dtype=np.int64)
        number[self._cells[:, 0], self._cells[:, 1]] = np.arange(len(self._cells))
        first, last, length = [], [], []
        for move in _MOVES:
            ends = self._cells + np.array(move) * stride
            on = (ends >= 0).all(axis=1) & (ends < mask.shape).all(axis=1)
            start = np.flatnonzero(on)
            stop = number[ends[on, 0], ends[on, 1]]
            free = (stop >= 0) & _free_between(mask, self._cells[start], move, stride)
            first.append(start[free])
            last.append(stop[free])
            length.append(np.full(int(free.sum()), float(np.hypot(*move)) * stride * self.space.area.cell_m))
        one, other, metres = np.concatenate(first), np.concatenate(last), np.concatenate(length)
        both = (np.concatenate((one, other)), np.concatenate((other, one)))
        return csr_array((np.tile(metres, 2), both), shape=(len(self._cells), len(self._cells)))

    def _nearest(self, points_m: FloatArray) -> tuple[IntArray, FloatArray]:
        """Number of the place nearest to each point (n, 2), and how far off it is, metres."""
        off, place = self._tree.query(np.asarray(points_m, dtype=np.float64).reshape(-1, 2))
        return np.asarray(place, dtype=np.int64), np.asarray(off)


def _free_between(mask: BoolArray, cells: IntArray, move: tuple[int, int], stride: int) -> BoolArray:
    """Return (n,) for which cells the way to the one a move further crosses no wall."""
    free = np.ones(len(cells), dtype=np.bool_)
    checks = 2 * stride * max(abs(part) for part in move)
    for share in np.arange(1, checks) / checks:
        row, column = (cells + np.round(np.array(move) * stride * share + 1e-9).astype(np.int64)).T
        free &= mask[row, column]
    return free


WALKING_M_S = 1.0
"""Speed of the collectors in the paper (Table III: 0.92 to 0.99 m/s)."""
_EPSILON = 1e-9


def covering_stops(gaps_m: FloatArray, radius_m: float) -> IntArray:
    """Choose of gaps (g, d) some (indices) so that each is within the radius of one: the widest reach first."""
    reach = cKDTree(gaps_m).query_pairs(radius_m * (1 + _EPSILON), output_type="ndarray")
    own = np.arange(len(gaps_m))
    a, b = np.concatenate([reach, reach[:, ::-1], np.stack([own, own], axis=1)]).T
    reached = csr_array((np.ones(len(a)), (a, b)), shape=(len(own), len(own)))
    left, chosen = np.ones(len(own)), []
    while left.any():
        chosen.append(int(np.argmax(reached @ left)))
        left[reached[[chosen[-1]]].indices] = 0
    return np.array(chosen, dtype=np.int64)


def short_order(length_m: FloatArray, *, free: bool, tries: int = 8) -> IntArray:
    """Order (s,) of a short walk through places this far apart (s, s), metres; the first stays so unless ``free``.

    So many nearest-neighbour tours are tried, which begin at different places.
    """
    if free:
        # A place that is not a way from all others stands for the free beginning.
        length_m = np.pad(length_m, ((1, 0), (1, 0)))
    inner = np.arange(1, len(length_m))
    if len(inner) < 2:
        return (inner if free else np.arange(len(length_m))) - int(free)
    graph = from_numpy_array(length_m[1:, 1:])
    firsts = inner[:: -(-len(inner) // tries)] if free else inner[[int(np.argmin(length_m[0, 1:]))]]
    tours = [np.append(0, 1 + np.array(greedy_tsp(graph, source=int(first - 1))[:-1])) for first in firsts]
    best = min((_without_crossings(tour, length_m) for tour in tours), key=lambda tour: _length(tour, length_m))
    return best[1:] - 1 if free else best


def _without_crossings(order: IntArray, length_m: FloatArray) -> IntArray:
    """Reverse the stretch of the order (s,) that shortens the walk most, until none does; the first stays first."""
    while True:
        here, then = order[:-1], order[1:]
        after = np.append(then[1:], -1)
        # Reversing then[i] ... then[j] replaces the steps here[i]-then[i] and then[j]-after[j], where there is one.
        gain = length_m[here, then][:, None] - length_m[here[:, None], then]
        step = np.where(after >= 0, length_m[then, after], 0.0)
        gain = gain + step - np.where(after >= 0, length_m[then[:, None], after], 0.0)
        gain = np.triu(gain)
        i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if gain[i, j] <= _EPSILON:
            return order
        order = np.concatenate([order[: i + 1], order[i + 1 : j + 2][::-1], order[j + 2 :]])


def _length(order: IntArray, length_m: FloatArray) -> float:
    """Metres of a walk in this order (s,) through places this far apart (s, s)."""
    return float(length_m[order[:-1], order[1:]].sum())
