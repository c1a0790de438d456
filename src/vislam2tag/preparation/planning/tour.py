"""A tour over all corridors of a floor: each is walked, as little as possible twice (route inspection).

Ends at which an odd number of corridors meet are joined in pairs by the shortest corridors there are (Edmonds and
Johnson 1973); those are walked twice. Of all orders in which the corridors can then be walked one is taken that meets
landmarks early: at every end the corridor whose next new landmark is nearest, unless taking it would cut off what is
left (Fleury).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import networkx as nx
import numpy as np

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.preparation.planning.corridors import Corridors, line_of

LOOK_S = 2.0
"""Passing a landmark costs so much time: to turn the phone to the sheet and back."""
MOST_STARTS = 12
"""So many places to begin at are tried."""
FEW_CORRIDORS = 40
"""On floors with no more corridors than this every end is tried."""
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
    """Length of the corridors that are walked again."""

    @property
    def length_m(self) -> float:
        """Length of the whole tour."""
        return float(arc_lengths(self.line)[-1])

    def duration_s(self, speed_m_s: float) -> float:
        """How long it takes."""
        return self.length_m / speed_m_s + LOOK_S * len(self.visit)

    def first_m(self) -> FloatArray:
        """How far along each landmark (l,) that is passed at all is met first, sorted, metres."""
        return _first_m(self.visit, self.visit_m)


def plan_tour(corridors: Corridors, corridor: IntArray, offset_m: FloatArray) -> Tour:
    """Make a tour past landmarks on ``corridor`` (m,) at ``offset_m`` (m,) from its first end; all are connected."""
    doubled = _doubled(corridors)
    copies = [*range(len(corridors.lines)), *doubled]
    marks = _marks(corridors, corridor, offset_m)
    best: tuple[float, list[int]] | None = None
    for start in _starts(corridors):
        route = _route(corridors, copies, marks, start)
        cost = _lateness(corridors, marks, route)
        if best is None or cost < best[0] - 1e-9:
            best = cost, route
    assert best is not None
    visits, at = _visits(corridors, marks, best[1])
    lines = [line_of(corridors.lines, half) for half in best[1]]
    line = np.vstack([lines[0][:1], *(part[1:] for part in lines)])
    return Tour(line, visits, at, float(corridors.length_m[doubled].sum()))


def _doubled(corridors: Corridors) -> list[int]:
    """Ways to walk twice so that an even number meets at every end, of the least total length."""
    graph = nx.Graph()
    for number, (first, second) in enumerate(corridors.joined.tolist()):
        length = float(corridors.length_m[number])
        if first != second and (not graph.has_edge(first, second) or graph[first][second]["length_m"] > length):
            graph.add_edge(first, second, length_m=length, corridor=number)
    odd = [end for end, leaving in enumerate(corridors.leaving) if len(leaving) % 2]
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
        found += [graph[a][b]["corridor"] for a, b in pairwise(path)]
    # Who would walk a corridor two more times need not.
    return sorted(corridor for corridor in set(found) if found.count(corridor) % 2)


Marks = list[list[tuple[float, int]]]
"""For each half the landmarks on it: how far along, and which."""


def _marks(corridors: Corridors, corridor: IntArray, offset_m: FloatArray) -> Marks:
    """The landmarks (m,) on each half, by their corridor (m,) and distance (m,) along it, metres."""
    marks: Marks = [[] for _ in range(2 * len(corridors.lines))]
    for landmark, (number, offset) in enumerate(zip(corridor.tolist(), offset_m.tolist(), strict=True)):
        marks[2 * number].append((offset, landmark))
        marks[2 * number + 1].append((float(corridors.length_m[number]) - offset, landmark))
    return [sorted(on) for on in marks]


def _starts(corridors: Corridors) -> list[int]:
    ends = sorted(set(corridors.joined.ravel().tolist()))
    if len(corridors.lines) <= FEW_CORRIDORS:
        return ends
    return [ends[i] for i in np.linspace(0, len(ends) - 1, MOST_STARTS).astype(int).tolist()]


def _route(corridors: Corridors, copies: Sequence[int], marks: Marks, start: int) -> list[int]:
    """Halves (r,) of a round trip over all the copies of corridors."""
    left = Counter(half for corridor in copies for half in (2 * corridor, 2 * corridor + 1))
    seen: set[int] = set()
    route: list[int] = []
    here = start
    for _ in range(len(copies)):
        half = _choice(corridors, left, marks, seen, here, route[-1] if route else -2)
        route.append(half)
        left.subtract((half, half ^ 1))
        here = corridors.stop(half)
        seen.update(landmark for _, landmark in marks[half])
    return route


def _choice(corridors: Corridors, left: Counter[int], marks: Marks, seen: set[int], here: int, before: int) -> int:
    """The half to go on by: none that cuts off the rest if that can be, not back, with the nearest new landmark."""
    options = [half for half in corridors.leaving[here] if left[half]]
    if len(options) == 1:
        return options[0]

    def rank(half: int) -> tuple[bool, bool, float, int]:
        fresh = [at for at, landmark in marks[half] if landmark not in seen]
        return (_cuts_off(corridors, left, here, half), half == before ^ 1, min(fresh, default=np.inf), half)

    return min(options, key=rank)


def _cuts_off(corridors: Corridors, left: Counter[int], here: int, half: int) -> bool:
    """Whether what is left at ``here`` could not be reached any more after going by a half."""
    if left[half] > 1:
        return False
    todo, reached = [corridors.stop(half)], {corridors.stop(half)}
    while todo:
        end = todo.pop()
        if end == here:
            return False
        onward = {corridors.stop(other) for other in corridors.leaving[end] if left[other] and other // 2 != half // 2}
        todo += onward - reached
        reached |= onward
    return True


def _visits(corridors: Corridors, marks: Marks, route: Sequence[int]) -> tuple[IntArray, FloatArray]:
    """Landmarks (v,) in the order in which a route passes them, and how far along (v,), metres."""
    visits: list[int] = []
    at: list[float] = []
    gone = 0.0
    for half in route:
        for offset, landmark in marks[half]:
            if visits and visits[-1] == landmark and gone + offset - at[-1] < 1.0:
                continue
            visits.append(landmark)
            at.append(gone + offset)
        gone += float(corridors.length_m[half // 2])
    return np.array(visits, dtype=np.int64), np.array(at, dtype=np.float64)


def _lateness(corridors: Corridors, marks: Marks, route: Sequence[int]) -> float:
    """Mean distance to the first visit of each landmark; the second one met counts most: then the walk is mapped."""
    met = _first_m(*_visits(corridors, marks, route))
    return float(met.mean() + met[:2][-1]) if len(met) else 0.0


def _first_m(visit: IntArray, visit_m: FloatArray) -> FloatArray:
    """How far along each landmark (l,) of some visits (v,) is met first, sorted, metres."""
    return np.sort(visit_m[np.unique(visit, return_index=True)[1]])
