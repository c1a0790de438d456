"""A tour over all ways of a floor: each is walked, as little as possible twice (route inspection).

Ends at which an odd number of ways meet are joined in pairs by the shortest ways there are (Edmonds and Johnson 1973);
those are walked twice. Of all orders in which the ways can then be walked one is taken that meets landmarks early: at
every end the way whose next new landmark is nearest, unless taking it would cut off what is left (Fleury).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import networkx as nx
import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.planning.ways import Ways, along

LOOK_S = 2.0
"""Passing a landmark costs so much time: to turn the phone to the sheet and back."""
MOST_STARTS = 12
"""So many places to begin at are tried."""
FEW_WAYS = 40
"""On floors with no more ways than this every end is tried."""
MANY_ODD = 120
"""With more odd ends than this only near pairs are considered."""
NEAR_ODD = 12


@dataclass(frozen=True)
class Tour:
    """``line`` (k, 2) BCS metres from start to start; ``visit`` (v,) landmarks in the order in which it passes them,
    ``visit_m`` (v,) how far along.
    """

    line: FloatArray
    visit: IntArray
    visit_m: FloatArray
    twice_m: float
    """Length of the ways that are walked again."""

    @property
    def length_m(self) -> float:
        """Length of the whole tour."""
        return float(along(self.line)[-1])

    def duration_s(self, speed_m_s: float) -> float:
        """How long it takes."""
        return self.length_m / speed_m_s + LOOK_S * len(self.visit)

    def first_m(self) -> FloatArray:
        """How far along each landmark that is passed at all is met first, sorted, metres."""
        _, first = np.unique(self.visit, return_index=True)
        return np.sort(self.visit_m[first])


def plan_tour(ways: Ways, way: IntArray, offset_m: FloatArray) -> Tour:
    """Make a tour past landmarks on ``way`` (m,) at ``offset_m`` (m,) from its first end; ways hang together."""
    doubled = _doubled(ways)
    halves_of = [*range(len(ways.lines)), *doubled]
    marks = _marks(ways, way, offset_m)
    best: tuple[float, list[int]] | None = None
    for start in _starts(ways):
        route = _route(ways, halves_of, marks, start)
        cost = _lateness(ways, marks, route)
        if best is None or cost < best[0] - 1e-9:
            best = cost, route
    assert best is not None
    visits, at = _visits(ways, marks, best[1])
    lines = [_line(ways, half) for half in best[1]]
    line = np.vstack([lines[0][:1], *(part[1:] for part in lines)])
    return Tour(line, visits, at, float(ways.length_m[doubled].sum()))


def _doubled(ways: Ways) -> list[int]:
    """Ways to walk twice so that an even number meets at every end, of the least total length."""
    graph = nx.Graph()
    for number, (first, second) in enumerate(ways.joined.tolist()):
        length = float(ways.length_m[number])
        if first != second and (not graph.has_edge(first, second) or graph[first][second]["length_m"] > length):
            graph.add_edge(first, second, length_m=length, way=number)
    odd = [end for end, leaving in enumerate(ways.leaving) if len(leaving) % 2]
    apart = {end: nx.single_source_dijkstra(graph, end, weight="length_m") for end in odd}
    pairs = nx.Graph()
    pairs.add_nodes_from(odd)
    for end in odd:
        others = sorted((apart[end][0][other], other) for other in odd if other != end)
        for away, other in others[: NEAR_ODD if len(odd) > MANY_ODD else None]:
            pairs.add_edge(end, other, weight=away)
    matched = sorted(tuple(sorted(pair)) for pair in nx.min_weight_matching(pairs))
    alone = sorted(set(odd) - {end for pair in matched for end in pair})
    matched += list(zip(alone[::2], alone[1::2], strict=True))
    found: list[int] = []
    for first, second in matched:
        path = apart[first][1][second]
        found += [graph[a][b]["way"] for a, b in pairwise(path)]
    return _without_pairs(found)


def _without_pairs(ways: list[int]) -> list[int]:
    """Who would walk a way two more times need not."""
    return sorted(way for way in set(ways) if ways.count(way) % 2)


def _line(ways: Ways, half: int) -> FloatArray:
    line = ways.lines[half // 2]
    return line[::-1] if half % 2 else line


Marks = list[list[tuple[float, int]]]
"""For each half the landmarks on it: how far along, and which."""


def _marks(ways: Ways, way: IntArray, offset_m: FloatArray) -> Marks:
    marks: Marks = [[] for _ in range(2 * len(ways.lines))]
    for landmark, (number, offset) in enumerate(zip(way.tolist(), offset_m.tolist(), strict=True)):
        marks[2 * number].append((offset, landmark))
        marks[2 * number + 1].append((float(ways.length_m[number]) - offset, landmark))
    return [sorted(on) for on in marks]


def _starts(ways: Ways) -> list[int]:
    ends = sorted(set(ways.joined.ravel().tolist()))
    if len(ways.lines) <= FEW_WAYS:
        return ends
    return [ends[i] for i in np.linspace(0, len(ends) - 1, MOST_STARTS).astype(int).tolist()]


def _route(ways: Ways, copies: Sequence[int], marks: Marks, start: int) -> list[int]:
    """Halves (r,) of a round trip over all the copies of ways."""
    left: list[dict[int, int]] = [{} for _ in ways.ends]
    for way in copies:
        for half, end in ((2 * way, ways.joined[way, 0]), (2 * way + 1, ways.joined[way, 1])):
            left[int(end)][half] = left[int(end)].get(half, 0) + 1
    seen: set[int] = set()
    route: list[int] = []
    here = start
    for _ in range(len(copies)):
        half = _choice(ways, left, marks, seen, here, route[-1] if route else -2)
        route.append(half)
        _take(left, here, half)
        here = ways.stop(half)
        _take(left, here, half ^ 1)
        seen.update(landmark for _, landmark in marks[half])
    return route


def _take(left: list[dict[int, int]], end: int, half: int) -> None:
    left[end][half] -= 1
    if not left[end][half]:
        del left[end][half]


def _choice(ways: Ways, left: list[dict[int, int]], marks: Marks, seen: set[int], here: int, before: int) -> int:
    """The half to go on by: no bridge if that can be, not straight back, with the nearest new landmark."""
    options = sorted(left[here])
    if len(options) == 1:
        return options[0]

    def badness(half: int) -> tuple[bool, bool, float, int]:
        fresh = [at for at, landmark in marks[half] if landmark not in seen]
        return (_cuts_off(ways, left, here, half), half == before ^ 1, min(fresh, default=np.inf), half)

    return min(options, key=badness)


def _cuts_off(ways: Ways, left: list[dict[int, int]], here: int, half: int) -> bool:
    """Whether what is left at ``here`` could not be reached any more after going by a half."""
    if left[here][half] > 1:
        return False
    todo, known = [ways.stop(half)], {ways.stop(half)}
    while todo:
        end = todo.pop()
        if end == here:
            return False
        for other in left[end]:
            if other in (half, half ^ 1):
                continue
            stop = ways.stop(other)
            if stop not in known:
                known.add(stop)
                todo.append(stop)
    return True


def _visits(ways: Ways, marks: Marks, route: Sequence[int]) -> tuple[IntArray, FloatArray]:
    visits: list[int] = []
    at: list[float] = []
    gone = 0.0
    for half in route:
        for offset, landmark in marks[half]:
            if visits and visits[-1] == landmark and gone + offset - at[-1] < 1.0:
                continue
            visits.append(landmark)
            at.append(gone + offset)
        gone += float(ways.length_m[half // 2])
    return np.array(visits, dtype=np.int64), np.array(at, dtype=np.float64)


def _lateness(ways: Ways, marks: Marks, route: Sequence[int]) -> float:
    """Mean distance to the first visit of each landmark; the second one met counts most: then the walk is mapped."""
    visits, at = _visits(ways, marks, route)
    _, first = np.unique(visits, return_index=True)
    met = np.sort(at[first])
    if not len(met):
        return 0.0
    return float(met.mean() + met[min(1, len(met) - 1)])
