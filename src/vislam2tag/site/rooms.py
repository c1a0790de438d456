"""Rooms of a floor by their names: which one is near a place, and those that are left out."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import BoolArray, FloatArray, runs_of
from vislam2tag.intake.ids import closest_id
from vislam2tag.site.floors import names_on_plan, read_room_names
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.source import FloorPlan, PlanText
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.graph import CorridorGraph, corridor_graph
from vislam2tag.site.walkable.painted_cells import floor_mask
from vislam2tag.site.walkable.space import WalkableSpace, walkable_space
from vislam2tag.site.walkable.walked import Areas, areas_of

NEAR_M = 5.0
"""For a room further away than this its distance is given."""


@dataclass(frozen=True)
class FloorRooms:
    """Rooms and corridors of a floor, called as in its table of rooms, or otherwise as on the plan."""

    areas: Areas
    names: tuple[PlanText, ...]
    """All names, those of rooms that cannot be walked into included."""

    @property
    def named(self) -> BoolArray:
        """(a,) areas that are rooms with a name."""
        return self.areas.is_room & np.array([bool(name) for name in self.areas.names], dtype=np.bool_)

    @property
    def boxes(self) -> dict[str, FloatArray]:
        """Rectangles (b, 4) that cover each room or corridor with a name: x0, y0, x1, y1, BCS metres."""
        names = np.array(self.areas.names, dtype=np.str_)
        return {name: boxes_of(self.areas, names == name) for name in sorted(set(self.areas.names) - {""})}

    def near(self, points_m: FloatArray) -> list[str]:
        """The room with a name that is nearest to each point (n, 2), and its distance if it is not beside the point.

        Empty if no room has a name.
        """
        found = self._nearest_areas(points_m)
        closed = [one for one in self.names if not self.areas.of_place(one.place_m)]
        for row, point in enumerate(points_m):
            others = [(float(np.hypot(*(point - one.place_m))), one.text) for one in closed]
            found[row] = min([found[row], *others])
        return [_near(*one) for one in found]

    def _nearest_areas(self, points_m: FloatArray) -> list[tuple[float, str]]:
        """Distance to the nearest room with a name, metres, and its name; infinite if there is none."""
        cells = np.isin(self.areas.number, np.flatnonzero(self.named))
        if not cells.any():
            return [(np.inf, "")] * len(points_m)
        away, nearest = distance_transform_edt(~cells, return_indices=True)
        at = tuple(self.areas.space.area.grid.cells_of(points_m).clip(0, np.array(cells.shape) - 1).T)
        numbers = self.areas.number[tuple(axis[at] for axis in nearest)]
        names = [self.areas.names[number] for number in numbers.tolist()]
        return list(zip((away[at] * self.areas.space.area.cell_m).tolist(), names, strict=True))

    def called(self, names: tuple[str, ...]) -> BoolArray:
        """(a,) rooms with one of these names; a room that cannot be walked into is none.

        Raises SurveyError, with the most similar name, if the floor has no such room, or it is a corridor.
        """
        found = np.zeros(len(self.areas.names), dtype=np.bool_)
        known = {_form(one.text): one.text for one in self.names}
        for name in names:
            if _form(name) not in known:
                near = closest_id(name, known.values())
                cure = f"the most similar name is {near}" if near else "its plan and its rooms.csv have no such name"
                raise SurveyError(f"excluded_rooms: there is no room {name}; {cure}")
            places = [one.place_m for one in self.names if _form(one.text) == _form(name)]
            here = self.areas.at(np.array(places))
            here = here[here >= 0]
            if not self.areas.is_room[here].all():
                raise SurveyError(f"excluded_rooms: {name} is no room behind a door: walks to other rooms lead past it")
            found[here] = True
            found |= self.named & np.array([_form(one) == _form(name) for one in self.areas.names], dtype=np.bool_)
        return found


def floor_rooms(floor: Floor, plan: FloorPlan, space: WalkableSpace, graph: CorridorGraph) -> FloorRooms:
    """Find the rooms of a floor in its walkable space."""
    listed = [] if floor.rooms is None else read_room_names(floor.rooms.parent, floor.rooms)[0]
    names = (*listed, *names_on_plan(plan))
    return FloorRooms(areas_of(space, graph).with_names(names), names)


def rooms_of(floor: Floor, settings: WalkableSettings | None = None) -> FloorRooms:
    """Find the rooms of a floor; raises SurveyError if its plan has no walkable space."""
    plan = floor_plan(floor)
    space = walkable_space(plan, settings, floor_mask(floor))
    return floor_rooms(floor, plan, space, corridor_graph(space))


def room_boxes(floor: Floor, settings: WalkableSettings | None = None) -> dict[str, FloatArray]:
    """Rectangles (b, 4) that cover each room or corridor with a name: x0, y0, x1, y1, BCS metres.

    Empty if no room has a name, or the floor has no plan with walkable space. Raises ModuleNotFoundError if the extra
    for its plan is not installed.
    """
    try:
        if floor.rooms is None and (floor.plan is None or not names_on_plan(floor_plan(floor))):
            return {}
        return rooms_of(floor, settings).boxes
    except SurveyError:  # the coverage of the floor reports it
        return {}


def areas_without(areas: Areas, left_out: BoolArray) -> Areas:
    """The areas that are not ``left_out`` (a,), on a space without the cells of those."""
    if not left_out.any():
        return areas
    kept = np.flatnonzero(~left_out)
    renumbered = np.full(len(left_out) + 1, -1, dtype=np.int64)  # the last one is for -1, cells of no area
    renumbered[kept] = np.arange(len(kept))
    number = renumbered[areas.number]
    space = replace(areas.space, area=replace(areas.space.area, mask=areas.space.area.mask & (number >= 0)))
    names = tuple(areas.names[row] for row in kept.tolist())
    return Areas(space, number, areas.is_room[kept], areas.middle_m[kept], areas.area_m2[kept], names)


def graph_without(graph: CorridorGraph, areas: Areas, left_out: BoolArray) -> CorridorGraph:
    """The graph without its edges in areas that are ``left_out`` (a,), and what only they join with the rest."""
    if not left_out.any():
        return graph
    middles = np.array([line[len(line) // 2] if len(line) > 2 else line.mean(axis=0) for line in graph.polylines])
    area = areas.at(middles)
    graph = _with_edges(graph, ~((area >= 0) & left_out[area]))
    size = len(graph.nodes)
    joined = coo_array((np.ones(len(graph.edges)), tuple(graph.edges.T)), shape=(size, size))
    part = connected_components(joined, directed=False)[1][graph.edges[:, 0]]
    return _with_edges(graph, part == np.bincount(part, graph.length_m).argmax())


def _with_edges(graph: CorridorGraph, kept: BoolArray) -> CorridorGraph:
    """The graph with the ``kept`` (e,) edges."""
    lines = tuple(line for line, keep in zip(graph.polylines, kept.tolist(), strict=True) if keep)
    return replace(
        graph,
        edges=graph.edges[kept],
        polylines=lines,
        length_m=graph.length_m[kept],
        in_room=graph.in_room[kept],
        shortcut=graph.shortcut[kept],
    )


def boxes_of(areas: Areas, chosen: BoolArray) -> FloatArray:
    """Rectangles (f, 4), x0, y0, x1, y1, that cover the cells of the ``chosen`` (a,) areas, BCS metres."""
    grid, mask = areas.space.area.grid, (areas.number >= 0) & chosen[areas.number]
    boxes, begun = [], dict[tuple[int, int], int]()
    for row, cells in enumerate([*mask, np.zeros(grid.columns, dtype=np.bool_)]):
        runs = {(int(start), int(stop)) for start, stop in runs_of(cells)}
        boxes += [(start, begun.pop((start, stop)), stop, row) for start, stop in [*begun] if (start, stop) not in runs]
        begun |= {run: row for run in runs if run not in begun}
    left, low = grid.origin_m
    return np.array(boxes, dtype=np.float64).reshape(-1, 4) * grid.cell_m + (left, low, left, low)


def _form(name: str) -> str:
    return " ".join(name.split()).casefold()


def _near(away_m: float, name: str) -> str:
    if not np.isfinite(away_m):
        return ""
    room = name if name.lower().startswith("room") else f"room {name}"
    return room if away_m <= NEAR_M else f"{away_m:.0f} m from {room}"
