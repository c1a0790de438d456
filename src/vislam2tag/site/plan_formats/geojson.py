"""GeoJSON plans: polygons with their use, walls and passages."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from shapely.geometry import MultiPolygon, Polygon

from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.plans.drawing import Bounds, PlanDrawing, PlanFormat, bounds_of, file_bytes, register
from vislam2tag.site.plans.source import PlanPolygon, PlanSource, Use

Rings = tuple[FloatArray, tuple[FloatArray, ...]]
"""Outline and holes of a polygon, not closed."""
Feature = Mapping[str, Any]
_LEAST_CORNERS = 3


def features_of(data: bytes) -> tuple[list[Feature], Mapping[str, Any]]:
    """Parse a feature collection: its features and the whole object.

    Raises OSError, whose text completes a sentence about the file.
    """
    try:
        whole = json.loads(data.decode("utf-8-sig"))
    except ValueError as error:
        raise OSError(f"is not JSON ({error})") from error
    if not isinstance(whole, dict):
        raise OSError("is not GeoJSON: expected a FeatureCollection")
    features = whole.get("features")
    if not isinstance(features, list) or not all(isinstance(each, dict) for each in features):
        raise OSError("is not GeoJSON: expected a FeatureCollection with its features")
    return features, whole


def properties_of(feature: Feature) -> Mapping[str, Any]:
    """Return a feature's properties; none where it has none."""
    properties = feature.get("properties")
    return properties if isinstance(properties, dict) else {}


def geometries_of(feature: Feature) -> Iterator[tuple[str, Any]]:
    """Yield kind (``Point``, ``LineString``, ``Polygon``) and coordinates of each part of a feature's geometry."""
    waiting = [feature.get("geometry")]
    while waiting:
        geometry = waiting.pop()
        if not isinstance(geometry, dict):
            continue
        kind, coordinates = str(geometry.get("type")), geometry.get("coordinates")
        if kind == "GeometryCollection":
            waiting += reversed(list(geometry.get("geometries") or ()))
        elif kind.startswith("Multi") and isinstance(coordinates, list):
            yield from ((kind.removeprefix("Multi"), part) for part in coordinates)
        else:
            yield kind, coordinates


def rings(coordinates: object) -> Rings:
    """Outline and holes of a polygon's coordinates.

    Raises OSError, whose text completes a sentence about the file, where they are none.
    """
    if not isinstance(coordinates, list) or not coordinates:
        raise OSError("has a polygon without coordinates")
    outline, *holes = (_ring(ring) for ring in coordinates)
    return outline, tuple(holes)


def polyline(coordinates: object) -> FloatArray:
    """Points (k, 2), k >= 2, of a line's coordinates; raises OSError as :func:`rings` does."""
    points = _points(coordinates)
    if len(points) < 2:
        raise OSError("has a line of fewer than two points")
    return points


def segments(points: FloatArray) -> FloatArray:
    """Segments (k - 1, 2, 2) of a polyline (k, 2)."""
    return np.stack((points[:-1], points[1:]), axis=1)


def _ring(coordinates: object) -> FloatArray:
    """Corners (k, 2), k >= 3, of a ring, the first one once."""
    points = _points(coordinates)
    if len(points) > 1 and (points[0] == points[-1]).all():
        points = points[:-1]
    if len(points) < _LEAST_CORNERS:
        raise OSError("has a polygon with fewer than three corners")
    return points


def _points(coordinates: object) -> FloatArray:
    """Points (k, 2) of a list of positions; raises OSError where they are not finite numbers."""
    if not isinstance(coordinates, Sequence):
        raise OSError("has a geometry whose coordinates are not a list")
    try:
        points = np.array([position[:2] for position in coordinates], dtype=np.float64).reshape(len(coordinates), 2)
    except (TypeError, ValueError, IndexError, KeyError) as error:
        raise OSError("has coordinates that are not numbers") from error
    if not np.isfinite(points).all():
        raise OSError("has coordinates that are not finite")
    return points


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
"""Of the area of all others, which the outline must contain."""


_Sorted = tuple[str | None, str, list[Rings], list[FloatArray]]
"""Of a feature: its use and name, its polygons and lines."""


def read_geojson(path: Path, source: PlanSource) -> PlanDrawing:
    """Read all features.

    Features of one floor. The property ``use`` (walkable, obstacle, opening, outline, wall) or OpenStreetMap's
    ``indoor`` says what a polygon or line is.
    """
    features, whole = features_of(file_bytes(path))
    found = [_sorted(feature) for feature in features]
    said = [
        PlanPolygon(*each, Use.OBSTACLE if use == WALL else Use(use), name)
        for use, name, polygons, _ in found
        for each in polygons
        if use is not None
    ]
    unsaid = [(polygons, name) for use, name, polygons, _ in found if use is None and polygons]
    walls = [line for use, _, _, lines in found for line in lines if use == WALL]
    passages = [line for use, _, _, lines in found for line in lines if use == Use.OPENING]
    polygons = (*said, *_with_use(unsaid, said, source))
    points = [*(each.outline for each in polygons), *walls, *passages, np.empty((0, 2))]
    bounds = bounds_of(np.concatenate(points))
    return PlanDrawing(
        bounds=bounds,
        polygons=polygons,
        walls=np.concatenate([*map(segments, walls), np.empty((0, 2, 2))]),
        passages=tuple(passages),
        epsg=_epsg(whole, bounds),
    )


def _sorted(feature: Feature) -> _Sorted:
    """What a feature says; points, and lines without a use, stand for nothing."""
    properties, found = properties_of(feature), list(geometries_of(feature))
    use = _use_of(properties)
    polygons = [rings(coordinates) for kind, coordinates in found if kind == "Polygon"]
    lines = [polyline(coordinates) for kind, coordinates in found if kind == "LineString"]
    return use, str(properties.get("name") or ""), polygons, lines


def _use_of(properties: Mapping[str, Any]) -> str | None:
    said = properties.get("use")
    if said is not None:
        known = (*Use, WALL)
        if said not in known:
            raise OSError(f"has a feature with the use '{said}', which is not one of {', '.join(known)}")
        return str(said)
    indoor = properties.get("indoor")
    return WALL if indoor == WALL else _INDOOR.get(str(indoor))


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


register(PlanFormat("geojson", (".geojson", ".json"), read_geojson))
