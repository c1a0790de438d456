"""Rooms, open areas and doors of plans that give them as outlines and points: walls, openings and joined floors.

Coordinates may be of any unit: ``scale`` (2,) is metres a unit of x and y.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from vislam2tag.core.arrays import FloatArray
from vislam2tag.intake.cells import LENGTHS_M
from vislam2tag.site.plans.drawing import Bounds, extent_sides_m
from vislam2tag.site.plans.features import Rings
from vislam2tag.site.plans.source import PlanSource

DOOR_M = 1.0
"""Width of a door that does not say its own, metres."""
_WIDEST_M = 12.0
"""A door's width beyond it is of another unit."""
_WIDTH = re.compile(r"(\d+(?:[.,]\d+)?)\s*(m|cm|mm)?")
_SNAP_M = 0.5
"""A door's point is at most so far from its wall, metres."""
REACH_M = 0.4
"""Half the depth of openings, metres: more than a wall is thick."""
_GAP_M = 0.05
"""Areas that are so close to each other adjoin, metres."""
_DEGREE_M = 111_320.0


def metres_per_unit(source: PlanSource, epsg: int | None, bounds: Bounds) -> FloatArray:
    """Metres a unit of x and y (2,) near a plan; of coordinates without a known unit, they are taken as metres."""
    if epsg is None:
        extent_m = None if source.extent is None else extent_sides_m(source.extent, bounds)[0]
        return np.full(2, source.unit_m or (1.0 if extent_m is None else extent_m / (bounds[1] - bounds[0])))
    from pyproj import CRS  # slow to load, and few sites need it
    from pyproj.exceptions import CRSError

    try:
        axis = CRS.from_epsg(epsg).axis_info[0]
    except CRSError:  # the plan is refused where it is placed
        return np.ones(2)
    if axis.unit_name == "degree":
        return _DEGREE_M * np.array([np.cos(np.radians((bounds[2] + bounds[3]) / 2)), 1.0])
    return np.full(2, axis.unit_conversion_factor)


def door_width_m(tag: object) -> float:
    """Width of a door by its tag, such as ``0.9`` or ``90 cm``; :data:`DOOR_M` where that is none."""
    found = _WIDTH.fullmatch(str(tag).strip())
    width_m = float(found[1].replace(",", ".")) * LENGTHS_M[found[2] or "m"] if found else 0.0
    return width_m if 0 < width_m <= _WIDEST_M else DOOR_M


def ring_segments(polygons: Iterable[Rings]) -> FloatArray:
    """Segments (n, 2, 2) around polygons and their holes."""
    rings = [ring for outline, holes in polygons for ring in (outline, *holes)]
    return np.concatenate([np.empty((0, 2, 2)), *(np.stack((ring, np.roll(ring, -1, 0)), axis=1) for ring in rings)])


def door_lines(
    doors: FloatArray, widths_m: FloatArray, walls: FloatArray, scale: FloatArray
) -> list[FloatArray | None]:
    """Lines (2, 2) along walls (n, 2, 2), as wide as the doors at points (k, 2) there; None for doors at no wall."""
    lines: list[FloatArray | None] = [None] * len(doors)
    if not len(doors) or not len(walls):
        return lines
    there, places = shapely.linestrings(walls * scale), shapely.points(doors * scale)
    found, nearest = shapely.STRtree(there).query_nearest(places, max_distance=_SNAP_M, all_matches=False)
    for door, wall in zip(found.tolist(), nearest.tolist(), strict=True):
        (start, end), at = walls[wall] * scale, shapely.get_coordinates(places[door])[0]
        along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
        middle = start + along * ((at - start) @ along)
        lines[door] = (middle + np.outer((-0.5, 0.5), along * widths_m[door])) / scale
    return lines


def closed_off(rooms: Sequence[Rings], openings: Sequence[FloatArray], scale: FloatArray) -> int:
    """How many rooms have no opening, each a line or ring (k, 2), at their outlines."""
    doors = shapely.union_all([shapely.linestrings(line * scale) for line in openings])
    outlines = [shapely.linearrings(outline * scale) for outline, _ in rooms]
    return sum(not doors.distance(ring) <= REACH_M for ring in outlines)


def joined(polygons: Sequence[Rings], scale: FloatArray) -> list[Rings]:
    """Polygons of areas without walls between them: those that adjoin become one."""
    shapes = [shapely.Polygon(outline * scale, [hole * scale for hole in holes]) for outline, holes in polygons]
    whole = without_gaps(list(map(shapely.make_valid, shapes)), _GAP_M)
    return [(outline / scale, tuple(hole / scale for hole in holes)) for outline, holes in rings_of(whole)]


def without_gaps(shapes: Sequence[BaseGeometry], gap_m: float) -> BaseGeometry:
    """The union of shapes in metres, gaps of up to twice ``gap_m`` between them closed."""
    grown = shapely.union_all(shapely.buffer(list(shapes), gap_m, join_style="mitre"))
    return shapely.buffer(grown, -gap_m, join_style="mitre")


def rings_of(shape: BaseGeometry) -> list[Rings]:
    """Polygons of a shape, the largest first, so that what lies in a hole is drawn later."""
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon" and not part.is_empty]
    return [
        (_corners(part.exterior), tuple(_corners(hole) for hole in part.interiors))
        for part in sorted(parts, key=lambda part: -float(shapely.Polygon(part.exterior).area))
    ]


def _corners(ring: BaseGeometry) -> FloatArray:
    corners: FloatArray = shapely.get_coordinates(ring)[:-1]
    return corners
