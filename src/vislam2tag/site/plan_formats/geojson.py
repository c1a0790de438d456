"""GeoJSON plans: polygons with their use, walls and passages, or OpenStreetMap's indoor tags; of one level."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from shapely.geometry import MultiPolygon, Polygon

from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.plans.drawing import Bounds, PlanDrawing, PlanFormat, bounds_of, file_bytes, register
from vislam2tag.site.plans.features import (
    Feature,
    Rings,
    features_of,
    geometries_of,
    polyline,
    positions,
    properties_of,
    rings,
    segments,
)
from vislam2tag.site.plans.indoor import closed_off, door_lines, door_width_m, joined, metres_per_unit, ring_segments
from vislam2tag.site.plans.levels import chosen_level, in_order, levels_of
from vislam2tag.site.plans.source import PlanPolygon, PlanSource, PlanText, Use
from vislam2tag.site.plans.taken_parts import IGNORED, Became, matching, taken_parts

WGS84 = 4326
WALL, ROOM, AREA, DOOR = "wall", "room", "area", "door"
"""Uses besides those of polygons: the outline of a room is a wall, areas adjoin without one, doors open walls."""
_TAGS = {
    "indoor=level": Use.OUTLINE,
    "indoor=room": ROOM,
    "indoor=corridor": AREA,
    "indoor=area": AREA,
    "indoor=platform": AREA,
    "indoor=stairs": AREA,
    "indoor=elevator": ROOM,
    "indoor=door": DOOR,
    "indoor=wall": WALL,
    "indoor=column": Use.OBSTACLE,
    "highway=elevator": ROOM,
    "highway=steps": AREA,
}
"""OpenStreetMap's simple indoor tagging."""
_BECAME = {
    Use.OUTLINE: Became.OUTLINE,
    Use.WALKABLE: Became.WALKABLE,
    Use.OBSTACLE: Became.OBSTACLES,
    Use.OPENING: Became.OPENINGS,
    ROOM: Became.WALKABLE,
    AREA: Became.WALKABLE,
    DOOR: Became.OPENINGS,
    WALL: Became.WALLS,
}
_POLYGON_USES: dict[str, Use] = {use.value: use for use in Use} | {
    ROOM: Use.WALKABLE,
    WALL: Use.OBSTACLE,
    DOOR: Use.OPENING,
}
_LINKS = {"elevator", "lift", "stairs", "staircase", "steps", "escalator"}
"""What joins levels: it names some that show nothing else."""
_GREATEST_SPAN_DEG = 0.5
"""No building is so large: coordinates that span more are not degrees."""
_HELD_SHARE = 0.98
"""Of the area of all others, which the outline must contain."""
_Left = list[tuple[str, Became, str]]
"""Of features, their class, what they became, and why they were left out."""


@dataclass(frozen=True)
class _Part:
    """A feature: its class, what it stands for (None: it does not say) and its geometry."""

    kind: str
    use: str | None
    name: str
    polygons: list[Rings]
    lines: list[FloatArray]
    points: FloatArray
    """(k, 2)."""
    width_m: float
    """Of a door."""


def read_geojson(path: Path, source: PlanSource) -> PlanDrawing:
    """Read the features of one level.

    The property ``use`` (walkable, obstacle, opening, outline, wall) or OpenStreetMap's ``indoor`` says what a polygon
    or line is. Points with ``door`` or ``entrance`` open the walls of rooms.
    """
    features, whole = features_of(file_bytes(path))
    said = [properties_of(feature) for feature in features]
    tagged = any("indoor" in each for each in said) and not any("use" in each for each in said)
    return drawing_of(features, source, lambda bounds: _epsg(whole, bounds), tagged=tagged)


def drawing_of(
    features: Sequence[Feature], source: PlanSource, epsg_of: Callable[[Bounds], int | None], *, tagged: bool
) -> PlanDrawing:
    """What features show of the level that ``source`` names; raises OSError as readers do.

    ``tagged``: with OpenStreetMap's tags, so that features with none of them are no part of a floor.
    """
    here, levels, left = _on_level(features, source.level)
    parts = [_part(feature) for feature in here]
    ignored = matching({part.kind for part in parts}, source.ignore)
    why = {part.kind: "no part of a floor" for part in parts if tagged and part.use is None}
    why |= dict.fromkeys(ignored, IGNORED)
    left += [(part.kind, Became.LEFT_OUT, why[part.kind]) for part in parts if part.kind in why]
    parts = [part for part in parts if part.kind not in why]
    if tagged and not parts:
        raise OSError("shows no rooms, areas or walls: expected the tag indoor (room, corridor, area, wall)")
    return replace(_drawn(parts, source, epsg_of, left), levels=levels)


def _drawn(
    parts: Sequence[_Part], source: PlanSource, epsg_of: Callable[[Bounds], int | None], left: _Left
) -> PlanDrawing:
    """Draw the parts of one level."""
    walls, passages = ([line for part in parts if part.use == use for line in part.lines] for use in (WALL, DOOR))
    outlines = [outline for part in parts for outline, _ in part.polygons]
    bounds = bounds_of(np.concatenate([*outlines, *walls, *passages, np.empty((0, 2))]))
    epsg = epsg_of(bounds)
    scale = metres_per_unit(source, source.epsg or epsg, bounds)
    rooms, areas = _polygons(parts, ROOM), joined(_polygons(parts, AREA), scale)
    wall_lines = np.concatenate([*map(segments, walls), ring_segments(rooms)])
    doors, counted = _doors(parts, np.concatenate([wall_lines, ring_segments(_polygons(parts, WALL))]), scale)
    passages += doors
    said = [
        PlanPolygon(*each, _POLYGON_USES[part.use], part.name)
        for part in parts
        if part.use in _POLYGON_USES
        for each in part.polygons
    ]
    unsaid = [(part.polygons, part.name) for part in parts if part.use is None and part.polygons]
    rest = _with_use(unsaid, said, source)
    left += [("without use", _BECAME[each.use], "") for each in rest]
    return PlanDrawing(
        bounds=bounds,
        polygons=(*said, *(PlanPolygon(*each, Use.WALKABLE) for each in areas), *rest),
        walls=wall_lines,
        passages=tuple(passages),
        texts=tuple(PlanText(part.name, _inside(part)) for part in parts if part.use == AREA and part.name),
        epsg=epsg,
        taken=taken_parts([*_taken(parts), *counted, *left]),
        notes=_closed_rooms(rooms, [*passages, *(outline for outline, _ in _polygons(parts, DOOR))], scale),
    )


def _polygons(parts: Sequence[_Part], use: str) -> list[Rings]:
    return [polygon for part in parts if part.use == use for polygon in part.polygons]


def _inside(part: _Part) -> tuple[float, float]:
    """A point of a part's first polygon."""
    point = Polygon(*part.polygons[0]).representative_point()
    return float(point.x), float(point.y)


def _doors(parts: Sequence[_Part], walls: FloatArray, scale: FloatArray) -> tuple[list[FloatArray], _Left]:
    """Lines of the doors that are points, along walls (w, 2, 2), and what became of each."""
    doors = [(part, point) for part in parts if part.use == DOOR for point in part.points]
    places = np.array([point for _, point in doors]).reshape(-1, 2)
    found = door_lines(places, np.array([part.width_m for part, _ in doors]), walls, scale)
    counted = [
        (part.kind, Became.LEFT_OUT, "at no wall") if line is None else (part.kind, Became.OPENINGS, "")
        for (part, _), line in zip(doors, found, strict=True)
    ]
    return [line for line in found if line is not None], counted


def _closed_rooms(rooms: Sequence[Rings], openings: Sequence[FloatArray], scale: FloatArray) -> tuple[str, ...]:
    closed = closed_off(rooms, openings, scale)
    if not closed:
        return ()
    return (
        f"{closed} of {len(rooms)} rooms have no door, so that no walk enters them: add points with door=yes on their "
        "outlines, or give open rooms the tag indoor=area",
    )


def _taken(parts: Sequence[_Part]) -> _Left:
    """What became of parts that are no points."""
    found: _Left = []
    for part in parts:
        used = part.polygons or (part.use in (WALL, DOOR) and part.lines)
        if used and part.use is not None:
            found.append((part.kind, _BECAME[part.use], ""))
        elif not used and part.use != DOOR:
            found.append((part.kind, Became.LEFT_OUT, "no area"))
    return found


def _on_level(features: Sequence[Feature], wanted: str | None) -> tuple[list[Feature], tuple[str, ...], _Left]:
    """Features of the level with the name ``wanted``, names of all levels, and those that are left out."""
    own = [_levels(properties_of(feature)) for feature in features]
    floors = [each for each, feature in zip(own, features, strict=True) if not _is_link(feature)]
    levels = in_order(frozenset().union(*floors) or frozenset().union(*own))
    if not levels and not wanted:
        return list(features), (), []
    called = {}
    for feature, each in zip(features, own, strict=True):
        if len(each) == 1 and (name := properties_of(feature).get("level:ref")) is not None:
            called[min(each)] = str(name)
    chosen = levels[chosen_level([(called.get(level, level), level) for level in levels], wanted)]
    here: list[Feature] = []
    left: _Left = []
    for feature, each in zip(features, own, strict=True):
        if chosen in each or (not each and (len(levels) == 1 or _of_all_levels(feature))):
            here.append(feature)
        else:
            left.append(("features of other levels" if each else "features without level", Became.LEFT_OUT, ""))
    return here, tuple(levels), left


_LEVEL_KEYS = ("level", "level:ref", "storey", "etage", "geschoss", "stockwerk", "floor")


def _levels(properties: Mapping[str, Any]) -> frozenset[str]:
    """All levels of a feature."""
    values = {str(key).lower(): levels_of(value) for key, value in properties.items()}
    if any(not level.lstrip("-").isdecimal() for level in values.get("floor", ())):
        del values["floor"]  # a material
    own = next((values[key] for key in _LEVEL_KEYS if values.get(key)), frozenset())
    return own | values.get("repeat_on", frozenset())


def _is_link(feature: Feature) -> bool:
    """Whether a feature joins levels or is a point, so that it makes no level of its own."""
    properties = properties_of(feature)
    tags = {str(properties.get(key)) for key in ("indoor", "room", "highway")}
    points = all(kind == "Point" for kind, _ in geometries_of(feature))
    return points or not tags.isdisjoint(_LINKS) or properties.get("stairs", "no") != "no"


def _of_all_levels(feature: Feature) -> bool:
    """Whether a feature without a level belongs to each: doors, which are points of walls, and outlines."""
    return _class_of(properties_of(feature))[1] in (DOOR, Use.OUTLINE)


def _part(feature: Feature) -> _Part:
    """What a feature says; points that are no door, and lines without a use, stand for nothing."""
    properties, found = properties_of(feature), list(geometries_of(feature))
    kind, use = _class_of(properties)
    return _Part(
        kind=kind,
        use=use,
        name=" ".join(str(properties[key]) for key in ("ref", "name") if properties.get(key)),
        polygons=[rings(coordinates) for shape, coordinates in found if shape == "Polygon"],
        lines=[polyline(coordinates) for shape, coordinates in found if shape == "LineString"],
        points=positions([coordinates for shape, coordinates in found if shape == "Point"]),
        width_m=door_width_m(properties.get("door:width", properties.get("width"))),
    )


def _class_of(properties: Mapping[str, Any]) -> tuple[str, str | None]:
    """Class of a feature, and what that stands for."""
    said = properties.get("use")
    if said is not None:
        known = (*Use, WALL)
        if said not in known:
            raise OSError(f"has a feature with the use '{said}', which is not one of {', '.join(known)}")
        return f"use={said}", DOOR if said == Use.OPENING else str(said)
    tags = [f"{key}={properties.get(key)}" for key in ("indoor", "highway")]
    if (tag := next((tag for tag in tags if tag in _TAGS), None)) is not None:
        return tag, _TAGS[tag]
    door = next((key for key in ("door", "entrance") if properties.get(key) is not None), None)
    return (door, DOOR) if door else (tags[0] if "indoor" in properties else "without use", None)


def _with_use(
    unsaid: Sequence[tuple[list[Rings], str]], said: Sequence[PlanPolygon], source: PlanSource
) -> list[PlanPolygon]:
    """Classify polygons that have no use: the one that contains all others is the outline."""
    outline = None if any(each.use == Use.OUTLINE for each in said) else _holder(unsaid)
    outlined = outline is not None or any(each.use == Use.OUTLINE for each in said)
    rest = Use(source.others) if source.others else (Use.OBSTACLE if outlined else Use.WALKABLE)
    return [
        PlanPolygon(*each, Use.OUTLINE if number == outline else rest, name)
        for number, (polygons, name) in enumerate(unsaid)
        for each in polygons
    ]


def _holder(unsaid: Sequence[tuple[list[Rings], str]]) -> int | None:
    """Which of these features contains all others."""
    if not unsaid:
        return None
    shapes = [MultiPolygon([Polygon(*each) for each in polygons]).buffer(0) for polygons, _ in unsaid]
    largest = int(np.argmax([shape.area for shape in shapes]))
    others = [shape for number, shape in enumerate(shapes) if number != largest]
    held = sum(shapes[largest].intersection(shape).area for shape in others)
    return largest if held >= _HELD_SHARE * sum(shape.area for shape in others) else None


def _epsg(whole: Mapping[str, Any], bounds: Bounds) -> int | None:
    """Reference system: what the member ``crs`` of the format's first version says, else degrees if it can be."""
    if "crs" in whole:
        crs = whole["crs"]
        properties = crs.get("properties") if isinstance(crs, dict) else None
        named = str(properties.get("name", "")) if isinstance(properties, dict) else ""
        number = re.search(r"EPSG:{1,2}(\d+)$", named)
        return int(number.group(1)) if number else (WGS84 if named.endswith("CRS84") else None)
    left, right, low, high = bounds
    degrees = left >= -180 and right <= 180 and low >= -90 and high <= 90
    return WGS84 if degrees and max(right - left, high - low) <= _GREATEST_SPAN_DEG else None


register(PlanFormat("geojson", (".geojson", ".json"), read_geojson, options=("level", "ignore", "others", "epsg")))
