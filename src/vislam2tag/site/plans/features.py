"""Features of GeoJSON files: properties, and geometry as arrays."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from vislam2tag.core.arrays import FloatArray

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
    points = positions(coordinates)
    if len(points) < 2:
        raise OSError("has a line of fewer than two points")
    return points


def segments(points: FloatArray) -> FloatArray:
    """Segments (k - 1, 2, 2) of a polyline (k, 2)."""
    return np.stack((points[:-1], points[1:]), axis=1)


def _ring(coordinates: object) -> FloatArray:
    """Corners (k, 2), k >= 3, of a ring, the first one once."""
    points = positions(coordinates)
    if len(points) > 1 and (points[0] == points[-1]).all():
        points = points[:-1]
    if len(points) < _LEAST_CORNERS:
        raise OSError("has a polygon with fewer than three corners")
    return points


def positions(coordinates: object) -> FloatArray:
    """Points (k, 2) of a list of positions; raises OSError as :func:`rings` does, where they are not finite numbers."""
    if not isinstance(coordinates, Sequence):
        raise OSError("has a geometry whose coordinates are not a list")
    try:
        points = np.array([position[:2] for position in coordinates], dtype=np.float64).reshape(len(coordinates), 2)
    except (TypeError, ValueError, IndexError, KeyError) as error:
        raise OSError("has coordinates that are not numbers") from error
    if not np.isfinite(points).all():
        raise OSError("has coordinates that are not finite")
    return points
