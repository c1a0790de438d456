"""Where a floor can be walked, found from its plan as planning finds it."""

from __future__ import annotations

import numpy as np

from vislam2tag.common.errors import import_extra
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.walkable.space import WalkableSpace, walkable_space
from vislam2tag.studio.layer_registry import Layer, register
from vislam2tag.studio.messages import Point
from vislam2tag.studio.work_messages import Feature, Title
from vislam2tag.studio.workspace import Workspace, plan_stamp

_FOUND: dict[tuple[str, str], list[list[Point]]] = {}
"""Regions by floor and plan, kept while their plan is as it was."""


def walkable(workspace: Workspace, floor: int) -> list[Feature]:
    """The region of one floor; none without a plan. Raises SurveyError if nothing on it can be walked."""
    chosen = workspace.now.survey.site.floor(floor)
    if chosen.plan is None:
        return []
    import_extra("skimage.measure")
    from vislam2tag.site.walkable.painted_cells import floor_mask

    key = str(chosen), plan_stamp(chosen)
    if key not in _FOUND:
        space = walkable_space(floor_plan(chosen), workspace.settings.walkable, floor_mask(chosen))
        _FOUND[key] = rings_of(space)
    outer, *holes = _FOUND[key]
    return [Feature(id=f"walkable:{floor}", shape="area", floor=floor, coordinates=outer, holes=holes)]


def rings_of(space: WalkableSpace) -> list[list[Point]]:
    """Closed lines about the region and its holes, the outer one, which encloses most, first."""
    ends = np.flatnonzero((space.walls[:-1, 1] != space.walls[1:, 0]).any(axis=1)) + 1
    rings = [part[:, 0] for part in np.split(space.walls, ends)]
    rings.sort(key=lambda ring: -float(np.ptp(ring, axis=0).prod()))
    return [[(round(x, 3), round(y, 3)) for x, y in ring.tolist()] for ring in rings]


_TITLE = Title(en="Walkable space", de="Begehbare Fläche")
register(Layer("walkable", _TITLE, walkable))
