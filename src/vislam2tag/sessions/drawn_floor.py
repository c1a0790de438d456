"""Where a session's floor can be walked, as a plan drawn in polygons says; images of plans are not asked."""

from __future__ import annotations

import hashlib
import json

from vislam2tag.common.errors import SurveyError
from vislam2tag.common.files.plain_files import read_bytes
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.survey.model import Floor
from vislam2tag.survey.plans.formats.raster import IMAGES
from vislam2tag.survey.plans.load import floor_plan
from vislam2tag.walkable.plan_cells import polygon_area
from vislam2tag.walkable.settings import WalkableSettings

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
        digest = hashlib.sha256(read_bytes(floor.plan))
    except OSError:
        return None
    placing = [None if part is None else part.model_dump(mode="json") for part in (floor.source, floor.georeference)]
    digest.update(json.dumps([placing, floor.width_m, floor.height_m], sort_keys=True).encode())
    return digest.hexdigest()


def drawn_area(floor: Floor) -> WalkableArea | None:
    """Where the floor can be walked; None where its plan is no drawing, or one that does not tell."""
    mark = drawing_mark(floor)
    if mark is None:
        return None
    if mark not in _areas:
        try:
            _areas[mark] = polygon_area(floor_plan(floor, _PICTURE_PX), WalkableSettings(cell_m=CELL_M))
        except SurveyError:
            _areas[mark] = None
    return _areas[mark]
