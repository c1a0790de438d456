"""What a set of landmarks must fulfil, and the fewest stations that do (integer programme, HiGHS, a proven bound).

Demands are rows: of each row's stations one at least has a landmark. *Spacing*: a walk goes along the corridors and
turns round only where a corridor ends. Whenever it has gone ``spacing_m`` since a landmark it has passed another one.
Walks that are longer without a landmark contain a window of that length that begins just after a station, an end of a
corridor, or an open area. So a row for each such window covers all walks.

*Turns*: Between two critical turns (junctions, corners, dead ends, mouths of open areas) that are not close together
is a landmark. *Open areas* have a landmark within half the spacing of each of their places.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.preparation.planning.corridors import Corridors
from vislam2tag.preparation.planning.sheet_places import Stations

BOUND_TOLERANCE = 1e-6


BRANCHES = 2000
"""The search ends after so many branches; unlike a time limit this ends it at the same place on every machine."""


@dataclass(frozen=True)
class Cover:
    """``chosen`` (s,) stations; ``bound``: no set of stations with fewer than this fulfils the demands."""

    chosen: BoolArray
    bound: int
    cut_short: bool
    """Whether the time limit ended the search: on another machine it may end elsewhere."""

    @property
    def number(self) -> int:
        """How many stations are chosen."""
        return int(self.chosen.sum())


def cover(
    rows: Sequence[StationSet],
    fixed: BoolArray,
    more_rows: Callable[[BoolArray], set[StationSet]],
    allowed: BoolArray,
    time_limit_s: float,
) -> Cover:
    """Choose the fewest stations, the ``fixed`` (s,) among them, so that each row has one.

    Only ``allowed`` (s,) stations count; each row contains some of them.
    ``more_rows`` gives the further rows that a choice (s,) breaks; they are added and the search goes on. Rows that
    were left out can only make the bound lower, so that it holds for all.
    """
    used = list(dict.fromkeys(rows))
    bound, begun, cut_short = int(fixed.sum()), time.monotonic(), False
    while True:
        left_s = time_limit_s - (time.monotonic() - begun)
        chosen, proven, timed_out = _fewest(used, fixed, allowed, max(left_s, 1.0))
        cut_short |= timed_out
        bound = max(bound, proven)
        broken = sorted(more_rows(chosen) - set(used), key=sorted)
        if not broken:
            return Cover(chosen, bound, cut_short)
        used += broken


def row_matrix(rows: Sequence[StationSet], count: int) -> csr_array:
    """(rows, stations) ones where a row contains a station."""
    columns = [sorted(row) for row in rows]
    pointer = np.concatenate(([0], np.cumsum([len(row) for row in columns]))).astype(np.int64)
    index = np.array([station for row in columns for station in row], dtype=np.int64)
    return csr_array((np.ones(len(index)), index, pointer), shape=(len(rows), count))


def _fewest(
    rows: Sequence[StationSet], fixed: BoolArray, allowed: BoolArray, time_s: float
) -> tuple[BoolArray, int, bool]:
    """The fewest stations (s,) for some rows, the ``fixed`` (s,) among them, a bound, and whether time ran out."""
    if not rows:
        return fixed.copy(), int(fixed.sum()), False
    count = len(fixed)
    matrix = row_matrix(rows, count)
    greedy = _greedy(matrix, fixed)
    result = milp(
        np.ones(count),
        integrality=np.ones(count, dtype=np.int64),
        bounds=Bounds(fixed.astype(np.float64), (allowed | fixed).astype(np.float64)),
        constraints=LinearConstraint(matrix, 1, np.inf),
        options={"mip_rel_gap": 0.0, "node_limit": BRANCHES, "time_limit": time_s},
    )
    proven = getattr(result, "mip_dual_bound", None)
    bound = math.ceil(proven - BOUND_TOLERANCE) if proven is not None and math.isfinite(proven) else int(fixed.sum())
    chosen = greedy if result.x is None else np.asarray(result.x) > 0.5
    better = chosen if chosen.sum() <= greedy.sum() else greedy
    return np.asarray(better), bound, time_out(result.status, result.message)


def time_out(status: int, message: str) -> bool:
    """Whether the solver ended for want of time (it gives one status to all its limits)."""
    return status == 1 and "time" in message.lower()


def _greedy(matrix: csr_array, fixed: BoolArray) -> BoolArray:
    """Take the station that most open rows contain, again and again: mask (s,) with the ``fixed`` (s,)."""
    chosen = fixed.copy()
    open_rows: FloatArray = np.asarray((matrix @ chosen.astype(np.float64)) < 0.5, dtype=np.float64)
    turned = csr_array(matrix.T)
    while open_rows.any():
        best = int(np.argmax(turned @ open_rows))
        chosen[best] = True
        open_rows[turned.indices[turned.indptr[best] : turned.indptr[best + 1]]] = 0.0
    return chosen


MOST_WINDOWS = 64
"""From one start at most so many windows are taken before the search; others follow when they are found broken."""
LONGEST = 8.0
"""A walk that finds no wall at all is followed for so many times the spacing."""
SLACK_M = 1e-6

StationSet = frozenset[int]


@dataclass(frozen=True)
class Gap:
    """A demand that no place can fulfil: between ``start`` and ``stop``, BCS metres, a walk of ``length_m``."""

    kind: str
    """``spacing``, ``turn`` or ``open``."""
    start: tuple[float, float]
    stop: tuple[float, float]
    length_m: float


@dataclass(frozen=True)
class Demands:
    """Rows of stations, of which one must have a landmark, and what cannot be demanded."""

    rows: tuple[StationSet, ...]
    gaps: tuple[Gap, ...]


class CorridorWalks:
    """Walks along the corridors past those stations that ``usable`` (s,) marks."""

    def __init__(self, corridors: Corridors, stations: Stations, usable: BoolArray) -> None:
        self.corridors, self.stations = corridors, stations
        self._on: list[tuple[list[int], list[float]]] = []
        for corridor, length in enumerate(corridors.length_m.tolist()):
            rows = np.flatnonzero((stations.corridor == corridor) & usable)
            at = stations.offset_m[rows]
            self._on.append((rows.tolist(), at.tolist()))
            self._on.append((rows[::-1].tolist(), (length - at[::-1]).tolist()))

    def starts(self, chosen: BoolArray | None = None) -> Iterator[tuple[int, float]]:
        """Half and distance along it of every place at which a window may begin: ends of corridors and stations.

        With ``chosen`` (s,) only those stations.
        """
        for half, (rows, at) in enumerate(self._on):
            yield half, -1.0
            for row, offset in zip(rows, at, strict=True):
                if chosen is None or chosen[row]:
                    yield half, offset

    def windows(
        self, half: int, offset_m: float, spacing_m: float, most: int, chosen: BoolArray | None = None
    ) -> list[tuple[tuple[int, ...], Gap]]:
        """Follow all walks from a place for ``spacing_m``; without any station on it a walk is followed to the first.

        Returns the stations on each in order, and the stretch as the gap that it is if it is too long.
        With ``chosen`` (s,) only walks that pass none of those. A walk into an open area ends there without a window.
        """
        found: list[tuple[tuple[int, ...], Gap]] = []
        begin = max(offset_m, 0.0)
        todo: list[tuple[int, float, float, tuple[int, ...]]] = [(half, offset_m, -begin, ())]
        while todo and len(found) < most:
            here, beyond, gone, passed = todo.pop()
            step = self._along(here, beyond, gone, passed, spacing_m, chosen)
            if step is None:
                continue
            passed, end_m, done = step
            if done:
                found.append((passed, Gap("spacing", self._at(half, begin), self._at(here, end_m - gone), end_m)))
                continue
            gone += float(self.corridors.length_m[here // 2])
            if not self.corridors.is_open[self.corridors.stop(here)]:
                todo += [(onward, -1.0, gone, passed) for onward in reversed(self.corridors.onward(here))]
        return found

    def _along(
        self, half: int, beyond: float, gone: float, passed: tuple[int, ...], spacing_m: float, chosen: BoolArray | None
    ) -> tuple[tuple[int, ...], float, bool] | None:
        """Go on along one half past ``chosen`` (s,) stations: stations passed, length so far and whether the window is
        full; None: landmark met.
        """
        length = float(self.corridors.length_m[half // 2])
        for row, at in zip(*self._on[half], strict=True):
            if at <= beyond + SLACK_M:
                continue
            if gone + at > spacing_m + SLACK_M and passed:
                return passed, spacing_m, True
            if chosen is not None and chosen[row]:
                return None
            passed = (*passed, row)
            if gone + at > spacing_m + SLACK_M:
                return passed, gone + at, True
        if gone + length > spacing_m + SLACK_M and passed:
            return passed, spacing_m, True
        full = gone + length > LONGEST * spacing_m
        return passed, gone + length, full

    def _at(self, half: int, along_m: float) -> tuple[float, float]:
        corridor = half // 2
        length = float(self.corridors.length_m[corridor])
        offset = length - along_m if half % 2 else along_m
        x, y = self.corridors.place(corridor, np.array([min(max(offset, 0.0), length)]))[0].tolist()
        return x, y


def demands_of(
    corridors: Corridors, stations: Stations, usable: BoolArray, spacing_m: float, short_m: float
) -> Demands:
    """All demands on the ``usable`` (s,) stations; windows from one start beyond :data:`MOST_WINDOWS` are left out."""
    walks = CorridorWalks(corridors, stations, usable)
    rows: set[StationSet] = set()
    gaps: dict[tuple[tuple[float, float], ...], Gap] = {}
    for half, offset in walks.starts():
        for passed, gap in walks.windows(half, offset, spacing_m, MOST_WINDOWS):
            if gap.length_m > spacing_m + SLACK_M:
                where = (min(gap.start, gap.stop), max(gap.start, gap.stop))
                gaps[where] = replace(gap, length_m=round(gap.length_m, 2))
            if passed:
                rows.add(frozenset(passed))
    turns, turn_gaps = turn_rows(corridors, stations, usable, short_m)
    halls, hall_gaps = open_area_rows(corridors, stations, usable, spacing_m / 2)
    ordered = without_supersets([*turns, *halls, *sorted(rows, key=sorted)])
    return Demands(ordered, (*_longest(gaps.values()), *turn_gaps, *hall_gaps))


def _longest(gaps: Iterable[Gap]) -> list[Gap]:
    """Name each stretch once: the longest walk from each place on."""
    kept: list[Gap] = []
    for gap in sorted(gaps, key=lambda gap: (-gap.length_m, gap.start, gap.stop)):
        ends = {gap.start, gap.stop}
        if all(min(math.dist(a, b) for a in ends for b in (one.start, one.stop)) > 2.0 for one in kept):
            kept.append(gap)
    return kept


def turn_rows(
    corridors: Corridors, stations: Stations, usable: BoolArray, short_m: float
) -> tuple[list[StationSet], list[Gap]]:
    """A row of ``usable`` (s,) stations for each corridor between two turns that are not close together; open areas
    have none inside.
    """
    rows, gaps = [], []
    for corridor, length in enumerate(corridors.length_m.tolist()):
        if length < short_m or corridors.in_hall[corridor]:
            continue
        here = np.flatnonzero((stations.corridor == corridor) & usable).tolist()
        if here:
            rows.append(frozenset(here))
        else:
            (ax, ay), (bx, by) = corridors.ends[corridors.joined[corridor]].tolist()
            gaps.append(Gap("turn", (ax, ay), (bx, by), round(length, 2)))
    return rows, gaps


def open_area_rows(
    corridors: Corridors, stations: Stations, usable: BoolArray, reach_m: float
) -> tuple[list[StationSet], list[Gap]]:
    """A row for each place of an open area: the ``usable`` (s,) stations within ``reach_m`` of walking, or else the
    nearest.
    """
    halls = np.flatnonzero(corridors.is_open)
    rows: list[StationSet] = []
    gaps: list[Gap] = []
    here = np.flatnonzero(usable)
    if not len(halls) or not len(here):
        return rows, gaps
    distance = walking_distances(corridors, stations, from_ends=halls)[:, here]
    for end, away in zip(halls.tolist(), distance, strict=True):
        nearest = float(away.min())
        if nearest > reach_m:
            (x, y), (u, v) = corridors.ends[end].tolist(), stations.point[here[int(away.argmin())]].tolist()
            gaps.append(Gap("open", (x, y), (u, v), round(nearest, 2)))
        if np.isfinite(nearest):
            rows.append(frozenset(here[away <= max(reach_m, nearest + 1.0)].tolist()))
    return rows, gaps


def walking_distances(corridors: Corridors, stations: Stations, from_ends: IntArray | None = None) -> FloatArray:
    """Walking distances to the stations (., s): from the ends given, or (s, s) from each station."""
    ends, count = len(corridors.ends), len(stations.corridor)
    first, second, length = [], [], []
    for corridor, (a, b) in enumerate(corridors.joined.tolist()):
        rows = np.flatnonzero(stations.corridor == corridor)
        chain = np.concatenate(([a], ends + rows, [b]))
        at = np.concatenate(([0.0], stations.offset_m[rows], [corridors.length_m[corridor]]))
        first.append(chain[:-1])
        second.append(chain[1:])
        length.append(np.maximum(np.diff(at), 1e-6))
    start = ends + np.arange(count) if from_ends is None else from_ends
    graph = _shortest_edges(np.concatenate(length), np.concatenate(first), np.concatenate(second), ends + count)
    return np.asarray(dijkstra(graph, directed=False, indices=start)[:, ends:])


def _shortest_edges(length: FloatArray, first: IntArray, second: IntArray, size: int) -> csr_array:
    """Graph (size, size) with the shortest of parallel edges, by lengths (e,) and ends (e,), (e,): a sparse array would
    add them up.
    """
    low, high = np.minimum(first, second), np.maximum(first, second)
    order = np.argsort(length, kind="stable")
    kept = order[np.unique((low * size + high)[order], return_index=True)[1]]
    return csr_array((length[kept], (low[kept], high[kept])), shape=(size, size))


def without_supersets(rows: list[StationSet]) -> tuple[StationSet, ...]:
    """Leave out rows that contain another one: they say nothing more. Keeps the order."""
    unique = list(dict.fromkeys(rows))
    by_station: dict[int, list[int]] = {}
    kept: set[int] = set()
    for index in sorted(range(len(unique)), key=lambda i: (len(unique[i]), i)):
        row = unique[index]
        candidates = {other for station in row for other in by_station.get(station, ())}
        if not any(unique[other] <= row for other in candidates):
            kept.add(index)
            for station in row:
                by_station.setdefault(station, []).append(index)
    return tuple(unique[index] for index in sorted(kept))


def broken_spacing(
    corridors: Corridors, stations: Stations, usable: BoolArray, chosen: BoolArray, spacing_m: float, most: int = 20
) -> set[StationSet]:
    """Rows of walks that are longer than ``spacing_m`` though they pass none of the ``chosen`` (s,) stations.

    Empty for a set that fulfils the spacing wherever it can be fulfilled.
    """
    walks = CorridorWalks(corridors, stations, usable)
    found = (walks.windows(half, offset, spacing_m, most, chosen) for half, offset in walks.starts(chosen))
    return {frozenset(passed) for windows in found for passed, _ in windows if passed}
