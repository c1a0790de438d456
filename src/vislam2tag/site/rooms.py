"""Rooms of a floor by their names: which one is near a place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import distance_transform_edt

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.site.floors import names_on_plan, read_room_names
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.source import FloorPlan, PlanText
from vislam2tag.site.walkable.space import WalkableSpace
from vislam2tag.site.walkable.walked import Areas, areas_of

if TYPE_CHECKING:
    from vislam2tag.site.walkable.graph import CorridorGraph

NEAR_M = 5.0
"""For a room further away than this its distance is given."""


@dataclass(frozen=True)
class FloorRooms:
    """Rooms and corridors of a floor, called as in its table of rooms, or otherwise as on the plan."""

    areas: Areas
    closed: tuple[PlanText, ...]
    """Names of rooms that cannot be walked into."""

    @property
    def named(self) -> BoolArray:
        """(a,) areas that are rooms with a name."""
        return np.array(
            [bool(room and name) for room, name in zip(self.areas.is_room, self.areas.names, strict=True)],
            dtype=np.bool_,
        )

    def near(self, points_m: FloatArray) -> list[str]:
        """The room with a name that is nearest to each point (n, 2), and its distance if it is not beside the point.

        Empty if no room has a name.
        """
        found = [(away_m, self.areas.names[area]) for away_m, area in self._nearest_areas(points_m)]
        for row, point in enumerate(points_m):
            closed = [(float(np.hypot(*(point - one.place_m))), one.text) for one in self.closed]
            found[row] = min([found[row], *closed])
        return [_near(*one) for one in found]

    def _nearest_areas(self, points_m: FloatArray) -> list[tuple[float, int]]:
        """Distance to the nearest room with a name, metres, and its number; infinite if there is none."""
        cells = np.isin(self.areas.number, np.flatnonzero(self.named))
        if not cells.any():
            return [(np.inf, -1)] * len(points_m)
        away, nearest = distance_transform_edt(~cells, return_indices=True)
        at = tuple(self.areas.space.area.grid.cells_of(points_m).clip(0, np.array(cells.shape) - 1).T)
        numbers = self.areas.number[tuple(axis[at] for axis in nearest)]
        return list(zip((away[at] * self.areas.space.area.cell_m).tolist(), numbers.tolist(), strict=True))


def floor_rooms(floor: Floor, plan: FloorPlan, space: WalkableSpace, graph: CorridorGraph) -> FloorRooms:
    """Find the rooms of a floor."""
    listed = [] if floor.rooms is None else read_room_names(floor.rooms.parent, floor.rooms)[0]
    names = [*listed, *names_on_plan(plan)]
    areas = areas_of(space, graph).with_names(names)
    return FloorRooms(areas, tuple(one for one in names if not areas.of_place(one.place_m)))


def _near(away_m: float, name: str) -> str:
    if not np.isfinite(away_m):
        return ""
    room = name if name.lower().startswith("room") else f"room {name}"
    return room if away_m <= NEAR_M else f"{away_m:.0f} m from {room}"
