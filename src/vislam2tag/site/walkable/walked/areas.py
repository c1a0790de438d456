"""Rooms, corridors and halls of a floor: its walkable space, parted at the doors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.site.room_names import RoomName
from vislam2tag.site.walkable.space import WalkableSpace

if TYPE_CHECKING:
    from vislam2tag.site.walkable.graph import CorridorGraph

LEAST_M2 = 1.5
"""What doors part off and is smaller than this is a niche, and belongs to what it lies beside."""
NAME_REACH_M = 1.0
"""A name may stand so far beside the walkable cells of its area: on a table, on a wall."""


@dataclass(frozen=True)
class Areas:
    """The ``a`` areas of a walkable space."""

    space: WalkableSpace
    number: IntArray
    """(rows, columns) the area of each cell of the space, -1 where nobody can walk."""
    is_room: BoolArray
    """(a,) whether it lies behind doors; else it is a corridor or a hall."""
    middle_m: FloatArray
    """(a, 2) the place of each area farthest from its walls, BCS metres."""
    area_m2: FloatArray
    """(a,)."""
    names: tuple[str, ...]
    """(a) as the plan or the survey calls them; empty where neither does."""

    def at(self, points_m: FloatArray) -> IntArray:
        """The area (n,) in which each point (n, 2) lies, -1 where it lies in none."""
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
        """What people call the area in or beside which a place lies; empty where there is none, or without a name."""
        area = self._beside(np.array(place_m))
        return self.called(area) if area >= 0 and self.names[area] else ""

    def with_names(self, names: Sequence[RoomName]) -> Areas:
        """Call each area as the first of the names that stand in it, or beside it where none does."""
        called = list(self.names)
        for one in names:
            area = self._beside(np.array(one.place_m))
            if area >= 0 and not called[area]:
                called[area] = one.name
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
    """Part a space at the doors of its graph; what no node of a corridor lies in is a room."""
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
    areas = Areas(
        space,
        number,
        np.ones(len(kept), dtype=np.bool_),
        _middles(space, number, len(kept)),
        (np.bincount(number[mask], minlength=len(kept)) * cell_m**2).astype(np.float64),
        ("",) * len(kept),
    )
    is_room = areas.is_room.copy()
    inside = areas.at(graph.nodes[corridors])
    is_room[inside[inside >= 0]] = False
    return replace(areas, is_room=is_room)


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
