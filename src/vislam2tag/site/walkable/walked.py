"""Which areas of a floor's walkable space were walked and scanned, and the walk that would fill the rest.

Near is what is within a radius of a walk *on foot*, around walls: who passes a room outside has not been in it. The
radius is that of a data set's coverage.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from vislam2tag.common.findings import Finding
from vislam2tag.common.records import Record
from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.core.path_length import line_length
from vislam2tag.site.plans.source import PlanText
from vislam2tag.site.walkable.space import WalkableSpace
from vislam2tag.site.walkable.walking_distances import WALKING_M_S, WalkingDistances, covering_stops, short_order

if TYPE_CHECKING:
    from vislam2tag.site.walkable.graph import CorridorGraph


LEAST_M2 = 1.5
"""What doors part off and is smaller than this is a niche, and belongs to what it is beside."""
NAME_REACH_M = 1.0
"""A name may stand so far beside the walkable cells of its area: on a table, on a wall."""


@dataclass(frozen=True)
class Areas:
    """The ``a`` areas of a walkable space."""

    space: WalkableSpace
    number: IntArray
    """(rows, columns) the area of each cell of the space, -1 where no one can walk."""
    is_room: BoolArray
    """(a,) whether it is behind doors; else it is a corridor or a hall."""
    middle_m: FloatArray
    """(a, 2) the place of each area furthest from its walls, BCS metres."""
    area_m2: FloatArray
    """(a,)."""
    names: tuple[str, ...]
    """(a) as the plan or the survey calls them; empty where neither does."""

    def at(self, points_m: FloatArray) -> IntArray:
        """The area (n,) in which each point (n, 2) is, -1 where it is in none."""
        cells = self.space.area.grid.cells_of(np.asarray(points_m, dtype=np.float64).reshape(-1, 2))
        on = ((cells >= 0) & (cells < self.number.shape)).all(axis=1)
        found = np.full(len(cells), -1, dtype=np.int64)
        found[on] = self.number[tuple(cells[on].T)]
        return found

    def called(self, area: int) -> str:
        """What people call an area, with its place where it has no name."""
        kind = "room" if self.is_room[area] else "corridor"
        if self.names[area]:
            return f"{kind} {self.names[area]}" if self.is_room[area] else self.names[area]
        x, y = self.middle_m[area].tolist()
        return f"{kind} at ({x:.0f}, {y:.0f})"

    def of_place(self, place_m: tuple[float, float]) -> str:
        """What people call the area in or beside which a place is; empty where there is none, or without a name."""
        area = self._beside(np.array(place_m))
        return self.called(area) if area >= 0 and self.names[area] else ""

    def with_names(self, names: Sequence[PlanText]) -> Areas:
        """Call each area as the first of the names that stand in it, or beside it where none does."""
        called = list(self.names)
        for one in names:
            area = self._beside(np.array(one.place_m))
            if area >= 0 and not called[area]:
                called[area] = one.text
        return replace(self, names=tuple(called))

    def _beside(self, place_m: FloatArray) -> int:
        here = int(self.at(place_m)[0])
        if here >= 0:
            return here
        grid, reach = self.space.area.grid, int(NAME_REACH_M / self.space.area.cell_m)
        row, column = grid.cells_of(place_m[None])[0].tolist()
        rows, columns = (slice(max(at - reach, 0), max(at + reach + 1, 0)) for at in (row, column))
        around = self.number[rows, columns]
        cells = np.argwhere(around >= 0)
        if not len(cells):
            return -1
        off = np.linalg.norm(cells + np.array((rows.start - row, columns.start - column)), axis=1)
        return int(around[tuple(cells[int(off.argmin())])])


def areas_of(space: WalkableSpace, graph: CorridorGraph) -> Areas:
    """Part a space at the doors of its graph; what no node of a corridor is in is a room."""
    from vislam2tag.site.walkable.graph import NodeKind  # of an extra, which who only looks at areas does without

    mask, cell_m = space.area.mask, space.area.cell_m
    parts, count = label(mask & ~_door_cells(space, graph, NodeKind.DOOR))
    sizes = np.bincount(parts.ravel(), minlength=count + 1) * cell_m**2
    kept = np.flatnonzero(sizes >= LEAST_M2)
    kept = kept[kept > 0]
    if not len(kept):
        kept = np.array([1]) if count else np.zeros(0, dtype=np.int64)
    renumbered = np.full(count + 1, -1, dtype=np.int64)
    renumbered[kept] = np.arange(len(kept))
    number = renumbered[parts]
    nearest = distance_transform_edt(number < 0, return_distances=False, return_indices=True)
    number = np.where(mask, number[tuple(nearest)], -1)
    corridors = np.array([kind not in (NodeKind.ROOM, NodeKind.DOOR) for kind in graph.kinds], dtype=np.bool_)
    area_m2 = (np.bincount(number[mask], minlength=len(kept)) * cell_m**2).astype(np.float64)
    is_room, middles = np.ones(len(kept), dtype=np.bool_), _middles(space, number, len(kept))
    areas = Areas(space, number, is_room, middles, area_m2, ("",) * len(kept))
    inside = areas.at(graph.nodes[corridors])
    is_room[inside[inside >= 0]] = False
    return areas


def _door_cells(space: WalkableSpace, graph: CorridorGraph, door: str) -> BoolArray:
    """Cells (rows, columns) in the doors of a graph: discs as wide as each."""
    closed: BoolArray = np.zeros_like(space.area.mask)
    height, width = space.area.grid.shape
    for node, kind in enumerate(graph.kinds):
        if kind != door:
            continue
        radius = graph.width_m[node] / 2 / space.area.cell_m + 1.5
        row, column = space.area.grid.cells_of(graph.nodes[node][None])[0].tolist()
        reach = int(np.ceil(radius))
        rows = np.arange(max(row - reach, 0), min(row + reach + 1, height))
        columns = np.arange(max(column - reach, 0), min(column + reach + 1, width))
        disc = np.hypot((rows - row)[:, None], (columns - column)[None]) <= radius
        closed[np.ix_(rows, columns)] |= disc
    return closed


def _middles(space: WalkableSpace, number: IntArray, count: int) -> FloatArray:
    """Place (a, 2) of each area's cell with the most room around it."""
    cells = np.argwhere(number >= 0)
    area, clearance = number[tuple(cells.T)], space.clearance_m[tuple(cells.T)]
    order = np.lexsort((-clearance, area))
    first = order[np.searchsorted(area[order], np.arange(count))] if len(cells) else np.zeros(0, dtype=np.int64)
    return space.area.grid.centres_m(cells[first])


RADIUS_M = 2.0
"""Half of what is walked between two scans of a phone (3 to 4 s at 1 m/s)."""
STOP_RADIUS_M = 3.0
"""Stops of the filling walk: it comes closer on its way from one to the next."""
LEAST_GAP_M2 = 2.0
"""Less than this that was not walked in an area does not justify going there."""
_OFF_SPACE_M = 0.5
"""Positions may lie so far outside the walkable space: labels are not exact, nor are plans."""
MOST_STOPS = 500
"""A walk has so many stops at most, those that fill most: who walked it checks again."""
_LOOK_M = 25.0
"""Stops that are further apart on foot come after each other only where nothing is closer."""
_MANY_STOPS = 400
"""With so many stops one order is tried, with fewer several."""
_APART = 1e4
"""Metres by which stops of different areas are held apart: a stop fills only its own area."""


class WalkToFill(Record):
    """The walk past all that was not walked; corners and stops in order, BCS metres."""

    length_m: float
    minutes: float
    points_m: list[tuple[float, float]]
    stops_m: list[tuple[float, float]]


@dataclass(frozen=True)
class WalkedSpace:
    """``n`` places, an even grid over a walkable space of ``a`` areas, and which of them walks came near."""

    areas: Areas
    distances: WalkingDistances
    walked: BoolArray
    """(n,)."""
    scanned: BoolArray
    """(n,) whether a labelled Wi-Fi scan was near."""
    entered: BoolArray
    """(a,) whether a walk led into the area."""

    @property
    def places_m(self) -> FloatArray:
        """(n, 2) BCS metres."""
        return self.distances.places_m

    @property
    def place_m2(self) -> float:
        """What a place stands for, square metres."""
        return self.distances.step_m**2

    def area_shares(self, near: BoolArray) -> FloatArray:
        """Share (a,) of each area's places that are ``near`` (n,); 0 of an area without any."""
        area, count = self.areas.at(self.places_m), len(self.areas.area_m2)
        on = area >= 0
        whole = np.bincount(area[on], minlength=count)
        return np.asarray(np.bincount(area[on & near], minlength=count) / np.maximum(whole, 1))

    @property
    def never_entered(self) -> list[int]:
        """Rooms that no walk led into."""
        return np.flatnonzero(self.areas.is_room & ~self.entered).tolist()


def walked_space(areas: Areas, walked_m: FloatArray, scanned_m: FloatArray) -> WalkedSpace:
    """Find what walks came near, by points along them (w, 2) about a metre apart, and places of scans (s, 2)."""
    distances = WalkingDistances(areas.space)
    walked_m, scanned_m = (points[np.isfinite(points).all(axis=1)] for points in (walked_m, scanned_m))
    walked_m = np.vstack((walked_m, scanned_m))  # who scanned was there
    inside = areas.at(walked_m)
    entered = np.zeros(len(areas.area_m2), dtype=np.bool_)
    entered[inside[inside >= 0]] = True
    return WalkedSpace(areas, distances, _near(distances, walked_m), _near(distances, scanned_m), entered)


def _near(distances: WalkingDistances, points_m: FloatArray) -> BoolArray:
    """Places (n,) within the radius of some points (p, 2)."""
    known = points_m[distances.off_space_m(points_m) <= _OFF_SPACE_M]
    if not len(known):
        return np.zeros(len(distances.places_m), dtype=np.bool_)
    return np.asarray(distances.to_nearest(distances.places_m, known, RADIUS_M) <= RADIUS_M)


def filling_walk(space: WalkedSpace) -> WalkToFill | None:
    """The walk through doors that comes near all that was not walked; None where nothing worth a way is left."""
    missing = np.flatnonzero(~space.walked)
    area = space.areas.at(space.places_m[missing])
    enough = np.bincount(area[area >= 0], minlength=len(space.areas.area_m2)) * space.place_m2 >= LEAST_GAP_M2
    worth = (area >= 0) & np.append(enough, False)[area]
    missing, area = missing[worth], area[worth]
    if not len(missing):
        return None
    stops = _stops(space.places_m[missing], area, space.distances.step_m)[:MOST_STOPS]
    apart_m = space.distances.between(stops, stops, _LOOK_M)
    straight = np.linalg.norm(stops[:, None] - stops, axis=2)
    order = short_order(
        np.where(np.isfinite(apart_m), apart_m, _LOOK_M + 2 * straight),
        free=True,
        tries=max(1, min(8, _MANY_STOPS // len(stops))),
    )
    # A way is no longer than a length that is known, which it is where it is short.
    limits_m = np.where(np.isfinite(apart_m), apart_m + 1.0, np.inf)
    pairs = list(pairwise(order))
    legs = [space.distances.path(stops[one], stops[other], limits_m[one, other])[1:] for one, other in pairs]
    line = space.distances.off_walls(np.vstack([stops[order[:1]], *legs]))
    length_m = line_length(line)
    return WalkToFill(
        length_m=round(length_m, 2),
        minutes=round(length_m / WALKING_M_S / 60, 2),
        points_m=[_point(point) for point in line.tolist()],
        stops_m=[_point(point) for point in stops[order].tolist()],
    )


def _stops(places_m: FloatArray, area: IntArray, step_m: float) -> FloatArray:
    """Places (s, 2) so that each of the places (n, 2) is near one in its own area (n,); every second is looked at."""
    row, column = np.round(places_m / step_m).astype(np.int64).T
    looked = (row % 2 == 0) & (column % 2 == 0)
    kept = looked | ~np.isin(area, area[looked])
    apart = np.column_stack((places_m[kept], _APART * area[kept]))
    return np.asarray(places_m[kept][covering_stops(apart, STOP_RADIUS_M)])


class WalkedArea(Record):
    """A room, a corridor or a hall."""

    name: str
    """As people call it, ``room 2.114``; with its place where it has no name."""
    room: bool
    """Whether it is behind doors."""
    area_m2: float
    walked: float
    """Share of it within 2 m of a walk, on foot, 0 to 1."""
    scanned: float
    """Share of it within 2 m of a labelled Wi-Fi scan."""
    entered: bool
    place_m: tuple[float, float]
    """A place in it, far from its walls; BCS."""


class WalkedFloor(Record):
    """One floor."""

    number: int
    note: str = ""
    """Why nothing is known of it; empty where it is."""
    walkable_m2: float | None = None
    walked: float | None = None
    """Share of the walkable space within 2 m of a walk, on foot, 0 to 1."""
    scanned: float | None = None
    areas: list[WalkedArea] = []
    """Rooms by name, then the rest."""
    walk: WalkToFill | None = None
    """None where nothing worth a way is left."""
    findings: list[Finding] = []
    """What is wrong with the table of the rooms' names."""

    @property
    def rooms(self) -> list[WalkedArea]:
        """What is behind doors."""
        return [area for area in self.areas if area.room]

    @property
    def never_entered(self) -> list[WalkedArea]:
        """Rooms that no walk led into."""
        return [area for area in self.rooms if not area.entered]


def walked_floor(number: int, space: WalkedSpace, walk: WalkToFill | None) -> WalkedFloor:
    """Reduce a floor to its record."""
    areas, walked, scanned = space.areas, space.area_shares(space.walked), space.area_shares(space.scanned)
    rows = [
        WalkedArea(
            name=areas.called(area),
            room=bool(areas.is_room[area]),
            area_m2=round(float(areas.area_m2[area]), 2),
            walked=round(float(walked[area]), 4),
            scanned=round(float(scanned[area]), 4),
            entered=bool(space.entered[area]),
            place_m=_point(areas.middle_m[area].tolist()),
        )
        for area in range(len(areas.area_m2))
    ]
    return WalkedFloor(
        number=number,
        walkable_m2=round(float(areas.area_m2.sum()), 2),
        walked=round(float(np.mean(space.walked)), 4),
        scanned=round(float(np.mean(space.scanned)), 4),
        areas=sorted(rows, key=lambda area: (not area.room, area.name)),
        walk=walk,
    )


def _point(place: list[float]) -> tuple[float, float]:
    return round(place[0], 2), round(place[1], 2)
