"""Layers of a floor's walkable space, found as for planning, and of its part without walks."""

from __future__ import annotations

import numpy as np

from vislam2tag.common.errors import import_extra
from vislam2tag.common.findings import Severity
from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.walkable.space import WalkableSpace, walkable_space
from vislam2tag.studio.collecting import covered
from vislam2tag.studio.layer_registry import Layer, register
from vislam2tag.studio.messages import Point
from vislam2tag.studio.work_messages import Feature, Title
from vislam2tag.studio.workspace import Workspace, plan_stamp

_FOUND: dict[tuple[str, str], list[list[Point]]] = {}
"""Cache of regions by floor and plan."""


def walkable(workspace: Workspace, floor: int) -> list[Feature]:
    """The region of one floor; none without a plan. Raises SurveyError without walkable space."""
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
    """Closed lines around the region and its holes, the outer one first."""
    ends = np.flatnonzero((space.walls[:-1, 1] != space.walls[1:, 0]).any(axis=1)) + 1
    rings = [part[:, 0] for part in np.split(space.walls, ends)]
    rings.sort(key=lambda ring: -float(np.ptp(ring, axis=0).prod()))
    return [[(round(x, 3), round(y, 3)) for x, y in ring.tolist()] for ring in rings]


_WALKABLE = Title(en="Walkable space", de="Begehbare Fläche")
register(Layer("walkable", _WALKABLE, walkable))


_WAY = "#a8447f"
"""A colour that no status has."""


def gaps(workspace: Workspace, floor: int) -> list[Feature]:
    """Areas without walks, a line through them and its first stop; none if the floor has no usable plan."""
    record, space = covered(workspace, floor)
    if space is None:
        return []
    step_m = space.distances.step_m
    features = [
        Feature(
            id=f"gaps:{floor}:{number}",
            shape="area",
            floor=floor,
            coordinates=outer,
            holes=holes,
            severity=Severity.WARNING,
        )
        for number, (outer, *holes) in enumerate(outlines(space.places_m[~space.walked], step_m))
    ]
    if record.walk is not None:
        line, stop = record.walk.points_m, record.walk.stops_m[0]
        way = Feature(id=f"gaps:{floor}:way", shape="line", floor=floor, coordinates=line, colour=_WAY)
        stopped = Feature(id=f"gaps:{floor}:next", shape="point", floor=floor, coordinates=[stop], colour=_WAY)
        features += [way, stopped]
    return features


def outlines(places_m: FloatArray, step_m: float) -> list[list[list[Point]]]:
    """Outlines of what places (n, 2) of a grid cover, metres: of each part the outer ring, then those of its holes."""
    if not len(places_m):
        return []
    import shapely

    cells = np.round(places_m / step_m)
    shift_m = places_m[0] - cells[0] * step_m
    parts = shapely.get_parts(
        shapely.simplify(shapely.coverage_union_all(shapely.box(*(cells - 0.5).T, *(cells + 0.5).T)), 0.0)
    )
    return [
        [
            [(round(x, 3), round(y, 3)) for x, y in (np.array(ring.coords)[:-1] * step_m + shift_m).tolist()]
            for ring in (part.exterior, *part.interiors)
        ]
        for part in parts
    ]


_GAPS = Title(en="Areas not walked yet, and a walk through them", de="Noch nicht begangene Flächen und ein Weg dorthin")
register(Layer("gaps", _GAPS, gaps))
