"""The corridors of a floor as a plan sees them, walks along them as surveyors take them, and a tour over all of them.

The corridor graph without rooms is joined from turn to turn. A corridor leads between two *ends*: critical turns,
junctions, dead ends, places of open areas. Half a corridor is a direction along it: half ``2 e`` leads from the first
end to the second, ``2 e + 1`` back. A tour walks each, as little as possible twice (route inspection): ends at which an
odd number of corridors meet are joined in pairs by the shortest corridors (Edmonds and Johnson 1973). Of all orders it
takes one that meets landmarks early, and cuts off nothing that is left (Fleury).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import networkx as nx
import numpy as np
from scipy.ndimage import gaussian_filter1d

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.path_length import arc_lengths, points_along
from vislam2tag.site.walkable.graph import CorridorGraph, NodeKind, connected_edges

LOOK_AHEAD_M = 1.5
"""The direction of a corridor at its end is that to the place so far along it."""


@dataclass(frozen=True)
class Corridors:
    """``e`` corridors between ``n`` ends, BCS metres."""

    ends: FloatArray
    """(n, 2)."""
    is_open: BoolArray
    """(n,) ends that are places of an open area."""
    joined: IntArray
    """(e, 2) the ends of each corridor."""
    lines: tuple[FloatArray, ...]
    """(e) corners (k, 2) from the first end to the second."""
    doors: FloatArray
    """(d, 2) doors."""

    @cached_property
    def length_m(self) -> FloatArray:
        """(e,) length of each corridor."""
        return np.array([arc_lengths(line)[-1] for line in self.lines])

    @cached_property
    def in_hall(self) -> BoolArray:
        """(e,) corridors that lie in an open area."""
        return np.asarray(np.all(self.is_open[self.joined], axis=1))

    @cached_property
    def leaving(self) -> tuple[tuple[int, ...], ...]:
        """(n) halves that lead away from each end."""
        return tuple(tuple(halves) for halves in _leaving(self.joined, len(self.ends), range(len(self.joined))))

    def stop(self, half: int) -> int:
        """End that a half leads to."""
        return int(self.joined[half // 2, 1 - half % 2])

    def onward(self, half: int) -> tuple[int, ...]:
        """Halves that go on from where a half stops: never back, but where the corridor ends."""
        leaving = self.leaving[self.stop(half)]
        return tuple(other for other in leaving if other != half ^ 1) or leaving

    def place(self, corridor: int, offset_m: FloatArray) -> FloatArray:
        """Points (k, 2) of a corridor at these distances (k,) from its first end."""
        return points_along(self.lines[corridor], offset_m)

    def direction(self, corridor: int, offset_m: FloatArray, reach_m: float = 0.5) -> FloatArray:
        """Unit vectors (k, 2) along a corridor at these distances from its first end."""
        high = np.minimum(offset_m + reach_m, self.length_m[corridor])
        step = self.place(corridor, high) - self.place(corridor, np.maximum(offset_m - reach_m, 0.0))
        return np.asarray(step / np.maximum(np.linalg.norm(step, axis=1), 1e-9)[:, None])


Chain = tuple[int, FloatArray, int, tuple[int, ...]]
"""First node, line, last node and edges of a corridor."""


def corridors_of(graph: CorridorGraph, turn_rad: float, *, niche_m: float = 0.0, rooms: bool = False) -> Corridors:
    """Take the corridors out of a corridor graph; straight joints are joined.

    Shortcuts, rooms (unless ``rooms``) and dead ends shorter than ``niche_m`` only stay if they connect the rest.
    """
    opened = np.array([kind is NodeKind.OPEN for kind in graph.kinds], dtype=np.bool_)
    kept = connected_edges(graph, ~graph.shortcut & (rooms | ~graph.in_room))
    chains = _chains_of(graph, kept, opened, turn_rad)
    count = np.bincount([node for chain in chains for node in (chain[0], chain[2])], minlength=len(graph.nodes))
    dead = (count == 1) & ~opened
    niches = {
        edge
        for first, line, last, edges in chains
        if dead[[first, last]].sum() == 1 and arc_lengths(line)[-1] < niche_m
        for edge in edges
    }
    if niches:
        chains = _chains_of(graph, [edge for edge in kept if edge not in niches], opened, turn_rad)
    used = sorted({node for first, _, last, _ in chains for node in (first, last)})
    number = {node: i for i, node in enumerate(used)}
    doors = [node for node, kind in enumerate(graph.kinds) if kind is NodeKind.DOOR]
    return Corridors(
        ends=graph.nodes[used].reshape(-1, 2),
        is_open=opened[used],
        joined=np.array([(number[a], number[b]) for a, _, b, _ in chains], dtype=np.int64).reshape(-1, 2),
        lines=tuple(line for _, line, _, _ in chains),
        doors=graph.nodes[doors].reshape(-1, 2),
    )


def line_of(lines: Sequence[FloatArray], half: int) -> FloatArray:
    """The line (k, 2) of an edge in the direction of a half."""
    return lines[half // 2][::-1] if half % 2 else lines[half // 2]


def _leaving(joined: IntArray, count: int, edges: Iterable[int]) -> list[list[int]]:
    """The halves of some edges, by both their ends (e, 2), that leave each of ``count`` nodes."""
    found: list[list[int]] = [[] for _ in range(count)]
    for edge in edges:
        first, second = joined[edge].tolist()
        found[first].append(2 * edge)
        found[second].append(2 * edge + 1)
    return found


def _heading(line: FloatArray) -> float:
    """Direction in which a line (k, 2) leaves its first corner, rad."""
    at = arc_lengths(line)
    reach = min(LOOK_AHEAD_M, float(at[-1]))
    ahead = [float(np.interp(reach, at, line[:, axis])) - float(line[0, axis]) for axis in (0, 1)]
    return float(np.arctan2(ahead[1], ahead[0]))


def _is_end(graph: CorridorGraph, out: list[int], turn_rad: float) -> bool:
    """Whether the corridors part, end or turn at a node that these halves leave."""
    if len(out) != 2:
        return True
    first, second = (_heading(line_of(graph.polylines, half)) for half in out)
    return abs((first - second) % (2 * np.pi) - np.pi) > turn_rad


def _chains_of(graph: CorridorGraph, kept: list[int], opened: BoolArray, turn_rad: float) -> list[Chain]:
    """Follow the ``kept`` edges from end to end, over nodes that are not ``opened`` (n,); a ring without any end gets
    one.
    """
    halves = _leaving(graph.edges, len(graph.nodes), kept)
    is_end = [bool(out) and (bool(opened[n]) or _is_end(graph, out, turn_rad)) for n, out in enumerate(halves)]
    chains: list[Chain] = []
    seen: set[int] = set()
    starts = [node for node, end in enumerate(is_end) if end]
    for start in [*starts, *(node for node, out in enumerate(halves) if out and not is_end[node])]:
        for half in halves[start]:
            if half // 2 in seen:
                continue
            parts: list[FloatArray] = []
            edges: list[int] = []
            here = half
            while True:
                seen.add(here // 2)
                edges.append(here // 2)
                parts.append(line_of(graph.polylines, here)[1 if parts else 0 :])
                node = int(graph.edges[here // 2][1 - here % 2])
                if is_end[node] or node == start:
                    break
                here = next(other for other in halves[node] if other != here ^ 1)
            chains.append((start, np.vstack(parts), node, tuple(edges)))
    return chains


STEP_M = 0.1
"""Sampling of a walk."""
CORNER_M = 0.4
"""How much corners are rounded."""
WALK_M = 150.0
"""Length of a session's walk: three minutes."""
TIMES = 12.0
"""All corridors together are walked about so often."""
FEWEST = 12
"""Walks at least."""
ROOM_SHARE = 0.12
"""Probability of looking into a room when passing its door."""


def typical_walks(graph: CorridorGraph, seed: int = 0, fewest: int = FEWEST) -> list[FloatArray]:
    """Walks (each (k, 2), BCS metres, a sample every 10 cm or so) that cover a graph; the same for the same graph."""
    if not (~graph.shortcut).any():
        return []
    rng = np.random.default_rng(seed)
    used = np.zeros(len(graph.edges))
    leaving = _leaving(graph.edges, len(graph.nodes), np.flatnonzero(~graph.shortcut).tolist())
    count = max(fewest, round(TIMES * float(graph.length_m[~graph.in_room & ~graph.shortcut].sum()) / WALK_M))
    starts = [node for node, halves in enumerate(leaving) if any(not graph.in_room[half // 2] for half in halves)]
    return [_walk(graph, leaving, used, starts or list(range(len(leaving))), rng) for _ in range(count)]


def _walk(
    graph: CorridorGraph, leaving: list[list[int]], used: FloatArray, starts: list[int], rng: np.random.Generator
) -> FloatArray:
    """One walk (k, 2); ``used`` (e,) counts how often edges were taken and is changed."""
    fresh = np.array([min(used[half // 2] for half in leaving[node]) for node in starts])
    node = int(rng.choice(np.array(starts)[fresh == fresh.min()]))
    before, length, parts = -1, 0.0, [graph.nodes[node][None]]
    while length < WALK_M:
        half = _next(graph, leaving[node], before, used, rng)
        before = half // 2
        used[before] += 1
        length += float(graph.length_m[before])
        parts.append(line_of(graph.polylines, half)[1:])
        node = int(graph.edges[before, 1 - half % 2])
    return smooth_line(np.vstack(parts))


def _next(graph: CorridorGraph, leaving: list[int], before: int, used: FloatArray, rng: np.random.Generator) -> int:
    """Choose a half to go on by, by how often each edge was ``used`` (e,): not back unless there is no other."""
    options = [half for half in leaving if half // 2 != before] or leaving
    if before < 0 or not graph.in_room[before]:
        rooms = [half for half in options if graph.in_room[half // 2]]
        others = [half for half in options if not graph.in_room[half // 2]]
        options = rooms if rooms and (rng.random() < ROOM_SHARE or not others) else others or options
    weight = np.array([4.0 ** -min(used[half // 2], 60.0) for half in options])
    return options[int(rng.choice(len(options), p=weight / weight.sum()))]


def smooth_line(corners: FloatArray) -> FloatArray:
    """Sample a line (k, 2) densely and round its corners."""
    dense = points_along(corners, np.arange(0.0, arc_lengths(corners)[-1] + STEP_M / 2, STEP_M))
    return np.asarray(gaussian_filter1d(dense, CORNER_M / STEP_M, axis=0, mode="nearest"))


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
