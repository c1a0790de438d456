"""What it costs to walk through each place of a floor, from any plan, for walks that are placed on it."""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache, partial
from pathlib import Path

from vislam2tag.common.errors import SurveyError, missing_extra
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import PlanOfFloor
from vislam2tag.core.wall_costs import FINE_M, WallCosts
from vislam2tag.site.model import Floor, StoredFile
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.drawn_cells import file_mark, plan_at_hand

OPENING_M = 6.0
"""Through narrower openings in the outer wall the outside does not reach in: ink may be missing there, and taking a
corridor for the outside would refute every walk in it.
"""
_costs: dict[str, WallCosts | str] = {}
"""What was read in this process, or why it cannot be used, by its mark: the sessions of a building share it."""


def plans_of(floors: tuple[Floor, ...]) -> tuple[PlanOfFloor, ...]:
    """Plans of those floors that have one; each is read when its costs are asked for."""
    return tuple(PlanOfFloor(floor.number, partial(plan_costs, floor)) for floor in floors if floor.plan is not None)


def plan_mark(floor: Floor) -> str | None:
    """SHA-256 of all that a floor's costs follow from; None if it has no plan, or one that cannot be read."""
    if floor.plan is None:
        return None
    try:
        content = [_mark_of(floor.plan, floor.stored_plan), _mark_of(floor.mask, floor.stored_mask)]
    except OSError:
        return None
    placing = [None if part is None else part.model_dump(mode="json") for part in (floor.source, floor.georeference)]
    placed = json.dumps([content, placing, floor.width_m, floor.height_m, floor.lower_left_m], sort_keys=True)
    return hashlib.sha256(placed.encode()).hexdigest()


def _mark_of(path: Path | None, stored: StoredFile | None) -> str | None:
    """SHA-256 of a file or folder; None if there is none. Raises OSError if it cannot be read."""
    if path is None or stored is not None:
        return None if stored is None else stored.sha256
    if path.is_dir():  # its own times do not show that a file in it was changed
        return file_mark(path)
    status = path.stat()
    return _hashed(path, status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns)


@lru_cache(maxsize=1024)
def _hashed(path: Path, *_unchanged: int) -> str:
    """SHA-256 of a file, which is read again if its number, size or times have changed: each session asks for it."""
    return file_mark(path)


def plan_costs(floor: Floor) -> WallCosts | None:
    """Costs on a floor; None if its plan cannot be read (here) or shows nothing that can be walked.

    Closed-off rooms count as walkable, because a drawn door may look like a wall. Raises StoreError if the plan is in a
    store and cannot be fetched as it was when the survey was opened.
    """
    read = _read(floor)
    return read if isinstance(read, WallCosts) else None


def plan_fault(floor: Floor) -> str | None:
    """Why walks cannot be placed on a floor's plan, a clause; None if they can, or it has none. Raises StoreError, as
    :func:`plan_costs`.
    """
    read = _read(floor)
    return read if isinstance(read, str) else None


def _read(floor: Floor) -> WallCosts | str | None:
    mark = plan_mark(floor)
    if mark is None:
        return None if floor.plan is None else f"{floor.plan.name} cannot be opened"
    if mark not in _costs:
        with plan_at_hand(floor) as here:
            try:
                from vislam2tag.site.walkable.painted_cells import floor_mask
                from vislam2tag.site.walkable.space import free_cells

                settings = WalkableSettings(cell_m=FINE_M, entrance_m=OPENING_M)
                free, grid, _ = free_cells(floor_plan(here), settings, floor_mask(here))
                area = WalkableArea(free, grid.origin_m, grid.cell_m)
                _costs[mark] = WallCosts.of(area) if free.any() else "it shows no walkable space"
            except SurveyError as error:
                _costs[mark] = str(error).replace(str(here.plan), here.plan.name if here.plan else "")
            except ModuleNotFoundError as error:  # images and drawings need an extra
                needs = missing_extra(error)
                _costs[mark] = str(error) if needs is None else f"this {needs}"
    return _costs[mark]
