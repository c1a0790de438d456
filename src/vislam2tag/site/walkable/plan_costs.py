"""What it costs to walk through each place of a floor, from any plan, for walks that are placed on it."""

from __future__ import annotations

import hashlib
import json
from functools import partial

from vislam2tag.common.errors import SurveyError
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import PlanOfFloor
from vislam2tag.core.wall_costs import FINE_M, WallCosts
from vislam2tag.site.model import Floor
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.drawn_cells import file_mark, plan_at_hand

_costs: dict[str, WallCosts | None] = {}
"""What was read in this process, by its mark: the sessions of a building share it."""


def plans_of(floors: tuple[Floor, ...]) -> tuple[PlanOfFloor, ...]:
    """Plans of those floors that have one; each is read when its costs are asked for."""
    return tuple(PlanOfFloor(floor.number, partial(plan_costs, floor)) for floor in floors if floor.plan is not None)


def plan_mark(floor: Floor) -> str | None:
    """SHA-256 of all that a floor's costs follow from; None if it has no plan, or one that cannot be read."""
    if floor.plan is None:
        return None
    try:
        content = [
            floor.stored_plan.sha256 if floor.stored_plan else file_mark(floor.plan),
            None if floor.mask is None else file_mark(floor.mask),
        ]
    except OSError:
        return None
    source = None if floor.source is None else floor.source.model_dump(mode="json")
    placed = json.dumps([content, source, floor.width_m, floor.height_m, floor.lower_left_m], sort_keys=True)
    return hashlib.sha256(placed.encode()).hexdigest()


def plan_costs(floor: Floor) -> WallCosts | None:
    """Costs on a floor; None if its plan cannot be read or shows nothing that can be walked.

    Closed-off rooms count as walkable, because a drawn door may look like a wall. Raises StoreError if the plan is in a
    store and cannot be fetched as it was when the survey was opened.
    """
    mark = plan_mark(floor)
    if mark is None:
        return None
    if mark not in _costs:
        from vislam2tag.site.walkable.painted_cells import floor_mask
        from vislam2tag.site.walkable.space import free_cells

        with plan_at_hand(floor) as here:
            try:
                free, grid, _ = free_cells(floor_plan(here), WalkableSettings(cell_m=FINE_M), floor_mask(here))
                _costs[mark] = WallCosts.of(WalkableArea(free, grid.origin_m, grid.cell_m)) if free.any() else None
            except SurveyError:
                _costs[mark] = None
    return _costs[mark]
