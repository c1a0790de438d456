"""Where a session's floor can be walked, as a plan drawn in polygons says; images of plans are not asked."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path, PurePosixPath

from vislam2tag.common.errors import StoreError, SurveyError
from vislam2tag.common.files.folder import scratch_folder
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.site.model import Floor
from vislam2tag.site.plan_formats.raster import IMAGES
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.walkable.plan_cells import polygon_area
from vislam2tag.site.walkable.settings import WalkableSettings

CELL_M = 0.25
"""Walls need not be finer than steps are known."""
_PICTURE_PX = 512
"""Nobody looks at the picture of the plan here."""
_areas: dict[str, WalkableArea | None] = {}
"""What was read in this process, by its mark: the sessions of a floor share it."""


def drawing_mark(floor: Floor) -> str | None:
    """SHA-256 of the floor's drawing and of how it is placed; None where its plan is an image or cannot be read."""
    if floor.plan is None or floor.plan.suffix.lower() in IMAGES:
        return None
    try:
        content = floor.stored_plan.sha256 if floor.stored_plan else _sha256(floor.plan)
    except OSError:
        return None
    placing = [None if part is None else part.model_dump(mode="json") for part in (floor.source, floor.georeference)]
    placed = json.dumps([content, placing, floor.width_m, floor.height_m], sort_keys=True)
    return hashlib.sha256(placed.encode()).hexdigest()


def drawn_area(floor: Floor) -> WalkableArea | None:
    """Where the floor can be walked; None where its plan is no drawing, or one that does not tell.

    Raises StoreError where the drawing lies in a store and cannot be fetched as it was when the survey was opened.
    """
    mark = drawing_mark(floor)
    if mark is None:
        return None
    if mark not in _areas:
        with _plan_at_hand(floor) as here:
            try:
                _areas[mark] = polygon_area(floor_plan(here, _PICTURE_PX), WalkableSettings(cell_m=CELL_M))
            except SurveyError:
                _areas[mark] = None
    return _areas[mark]


@contextmanager
def _plan_at_hand(floor: Floor) -> Iterator[Floor]:
    """Yield the floor with its plan on this machine, whichever opened the survey, while the block lasts."""
    stored = floor.stored_plan
    if stored is None:
        yield floor
        return
    with scratch_folder() as scratch:
        plan = scratch / PurePosixPath(stored.name).name
        if stored.store.fetch(stored.name, scratch, plan.name) is None or _sha256(plan) != stored.sha256:
            raise StoreError(f"{stored.store.address}/{stored.name}: has changed meanwhile; run the same command again")
        yield replace(floor, plan=plan)


def _sha256(path: Path) -> str:
    return hashlib.sha256(read_bytes(path)).hexdigest()
