"""GeoJSON plans: polygons with their use, walls and passages."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from shapely.geometry import MultiPolygon, Polygon

from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.plans.drawing import Bounds, PlanDrawing, bounds_of, file_bytes
from vislam2tag.site.plans.geojson_features import (
    Feature,
    Rings,
    features_of,
    geometries_of,
    polyline,
    properties_of,
    rings,
    segments,
)
from vislam2tag.site.plans.model import PlanPolygon, Use
from vislam2tag.site.plans.registry import register
from vislam2tag.site.plans.source import PlanSource

WGS84 = 4326
WALL = "wall"
_INDOOR = {
    "level": Use.OUTLINE,
    "room": Use.WALKABLE,
    "corridor": Use.WALKABLE,
    "area": Use.WALKABLE,
    "door": Use.OPENING,
    "wall": Use.OBSTACLE,
    "column": Use.OBSTACLE,
}
"""OpenStreetMap's simple indoor tagging."""
_GREATEST_SPAN_DEG = 0.5
"""No building is so large: coordinates that span more are not degrees."""
_HELD_SHARE = 0.98
"""Of the area of all others, which the outline must hold."""


@dataclass
class _FoundGeometry:
    """What has been found in a file so far."""

    polygons: list[PlanPolygon] = field(default_factory=list)
    unsaid: list[tuple[list[Rings], str]] = field(default_factory=list)
    """Polygons of features that do not tell their use, with the feature's name."""
    walls: list[FloatArray] = field(default_factory=list)
    passages: list[FloatArray] = field(default_factory=list)


class GeoJsonFormat:
    """Features of one floor. The property ``use`` (walkable, obstacle, opening, outline, wall) or OpenStreetMap's
    ``indoor`` says what a polygon or line is.
    """

    name = "geojson"
    suffixes: tuple[str, ...] = (".geojson", ".json")

    def recognises(self, path: Path) -> bool:
        """The suffix tells."""
        return path.is_file()

    def read(self, path: Path, source: PlanSource) -> PlanDrawing:
        """Read all features."""
        features, whole = features_of(file_bytes(path))
        parts = _FoundGeometry()
        for feature in features:
            _add(parts, feature)
        polygons = (*parts.polygons, *_with_use(parts.unsaid, parts.polygons, source))
        lines = [*parts.walls, *parts.passages]
        bounds = bounds_of(np.concatenate([*(each.outline for each in polygons), *lines, np.empty((0, 2))]))
        walls = [segments(line) for line in parts.walls]
        return PlanDrawing(
            bounds=bounds,
            polygons=polygons,
            walls=np.concatenate([*walls, np.empty((0, 2, 2))]),
            passages=tuple(parts.passages),
            epsg=_epsg(whole, bounds),
        )


def _add(parts: _FoundGeometry, feature: Feature) -> None:
    """Sort a feature's geometries by what they stand for; points and lines without a use stand for nothing."""
    properties = properties_of(feature)
    use = _use_of(properties)
    name = str(properties.get("name") or "")
    found = list(geometries_of(feature))
    polygons = [rings(coordinates) for kind, coordinates in found if kind == "Polygon"]
    lines = [polyline(coordinates) for kind, coordinates in found if kind == "LineString"]
    if use == WALL:
        parts.walls += lines
        parts.polygons += [PlanPolygon(*each, Use.OBSTACLE, name) for each in polygons]
        return
    if use == Use.OPENING:
        parts.passages += lines
    if use is not None:
        parts.polygons += [PlanPolygon(*each, Use(use), name) for each in polygons]
    elif polygons:
        parts.unsaid.append((polygons, name))


def _use_of(properties: Mapping[str, Any]) -> str | None:
    said = properties.get("use")
    if said is not None:
        known = (*Use, WALL)
        if said not in known:
            raise OSError(f"has a feature whose use is '{said}', which is none of {', '.join(known)}")
        return str(said)
    indoor = properties.get("indoor")
    return WALL if indoor == WALL else _INDOOR.get(str(indoor))


def _with_use(
    unsaid: Sequence[tuple[list[Rings], str]], said: Sequence[PlanPolygon], source: PlanSource
) -> list[PlanPolygon]:
    """Tell what polygons are that do not say it: the one that holds all others is the outline."""
    outline = None if any(each.use == Use.OUTLINE for each in said) else _holder(unsaid)
    outlined = outline is not None or any(each.use == Use.OUTLINE for each in said)
    rest = Use(source.others) if source.others else (Use.OBSTACLE if outlined else Use.WALKABLE)
    return [
        PlanPolygon(*each, Use.OUTLINE if number == outline else rest, name)
        for number, (polygons, name) in enumerate(unsaid)
        for each in polygons
    ]


def _holder(unsaid: Sequence[tuple[list[Rings], str]]) -> int | None:
    """Which of these features holds all others."""
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


register(GeoJsonFormat())
