"""Coverage of each floor's plan: from positions of sessions to areas of the walkable space."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vislam2tag.common.errors import SurveyError, missing_extra
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.site.floors import names_on_plan, read_room_names
from vislam2tag.site.model import Floor, Site
from vislam2tag.site.plans.source import PlanText
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.space import walkable_space
from vislam2tag.site.walkable.walked import (
    Areas,
    WalkedFloor,
    WalkedSpace,
    areas_of,
    filling_walk,
    walked_floor,
    walked_space,
)


@dataclass(frozen=True)
class WalkPlaces:
    """Positions of a session: ``position`` (w, 2) about a metre apart on ``floor`` (w,), and its labelled Wi-Fi scans,
    ``scan`` (s, 2) on ``scan_floor`` (s,); BCS metres.
    """

    position: FloatArray
    floor: IntArray
    scan: FloatArray
    scan_floor: IntArray


@dataclass(frozen=True)
class FloorWalked:
    """One floor: its record, and the space to draw (None if the record's note says why there is none)."""

    record: WalkedFloor
    space: WalkedSpace | None = None


def walked_floors(
    root: Path, site: Site, walks: Iterable[WalkPlaces], settings: WalkableSettings | None = None
) -> Mapping[int, FloorWalked]:
    """Coverage of the walkable space for each walked floor.

    A floor without a plan, or without walkable space on it, has a note instead.
    """
    all_walks = list(walks)
    numbers = sorted({int(number) for walk in all_walks for number in np.unique(walk.floor)})
    known = {floor.number for floor in site.floors}
    return {
        number: _floor_walked(root, site.floor(number), all_walks, settings) for number in numbers if number in known
    }


def _floor_walked(root: Path, floor: Floor, walks: list[WalkPlaces], settings: WalkableSettings | None) -> FloorWalked:
    names, findings = read_room_names(root, floor.rooms)
    try:
        areas = floor_areas(floor, names, settings)
    except SurveyError as error:
        return FloorWalked(WalkedFloor(number=floor.number, note=f"not measured against the plan: {error}"))
    except ModuleNotFoundError as error:
        lacks = missing_extra(error)
        if lacks is None:
            raise
        return FloorWalked(WalkedFloor(number=floor.number, note=f"not measured against the plan: this {lacks}"))
    walked = np.vstack([np.empty((0, 2)), *(walk.position[walk.floor == floor.number] for walk in walks)])
    scanned = np.vstack([np.empty((0, 2)), *(walk.scan[walk.scan_floor == floor.number] for walk in walks)])
    space = walked_space(areas, walked, scanned)
    record = walked_floor(floor.number, space, filling_walk(space))
    return FloorWalked(record.model_copy(update={"findings": findings}), space)


def floor_areas(floor: Floor, names: Sequence[PlanText], settings: WalkableSettings | None = None) -> Areas:
    """Rooms and corridors of a floor's plan with these names, or otherwise with those on the plan; excluded rooms are
    left out.

    Raises SurveyError if no plan has walkable space or an excluded room does not exist, ModuleNotFoundError if an extra
    is not installed.
    """
    from vislam2tag.site.plans.load import floor_plan  # packages of extras
    from vislam2tag.site.rooms import FloorRooms, areas_without
    from vislam2tag.site.walkable.graph import corridor_graph
    from vislam2tag.site.walkable.painted_cells import floor_mask

    plan, settings = floor_plan(floor), settings or WalkableSettings()
    space = walkable_space(plan, settings, floor_mask(floor))
    names = (*names, *names_on_plan(plan))
    areas = areas_of(space, corridor_graph(space)).with_names(names)
    return areas_without(areas, FloorRooms(areas, names).called(floor.excluded_rooms))
