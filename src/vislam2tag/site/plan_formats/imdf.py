"""IMDF plans (Indoor Mapping Data Format, OGC 20-094): one level of a folder or ZIP archive."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vislam2tag.site.plan_formats.geojson import (
    WGS84,
    Feature,
    features_of,
    geometries_of,
    polyline,
    properties_of,
    rings,
)
from vislam2tag.site.plans.drawing import PlanDrawing, PlanFormat, bounds_of, file_bytes, register
from vislam2tag.site.plans.source import PlanPolygon, PlanSource, Use

_LEVELS, _UNITS, _OPENINGS, _FIXTURES = (f"{name}.geojson" for name in ("level", "unit", "opening", "fixture"))
_MOST_BYTES = 50_000_000
"""Of a file of the archive, unpacked; parsed it takes some ten times that."""
_NOT_WALKED = {"column", "nonpublic", "opentobelow", "structure"}
"""Categories of units that no one walks in."""


def is_archive(path: Path) -> bool:
    """An archive contains its levels."""
    try:
        return _member(path, _LEVELS) is not None
    except OSError:
        return path.suffix.lower() == ".imdf"


def read_imdf(path: Path, source: PlanSource) -> PlanDrawing:
    """Read the level that the source names, the first where that is empty, or the only one.

    An IMDF archive: outline, units, fixtures and openings of one level, in longitude and latitude.
    """
    levels = _features(path, _LEVELS)
    level = _level(levels, source.level)
    own = str(level.get("id"))
    polygons = _polygons([level], {})
    polygons += _polygons(_of_level(path, _UNITS, own), {"walkable": Use.WALKABLE, "closed": Use.OBSTACLE})
    polygons += _polygons(_of_level(path, _FIXTURES, own), {"walkable": Use.OBSTACLE, "closed": Use.OBSTACLE})
    passages = tuple(
        polyline(coordinates)
        for opening in _of_level(path, _OPENINGS, own)
        for kind, coordinates in geometries_of(opening)
        if kind == "LineString"
    )
    points = np.concatenate([np.empty((0, 2)), *(each.outline for each in polygons), *passages])
    return PlanDrawing(
        bounds_of(points),
        polygons=tuple(polygons),
        passages=passages,
        levels=tuple(_names(each)[-1] for each in levels),
        epsg=WGS84,
    )


def _polygons(features: Sequence[Feature], uses: Mapping[str, Use]) -> list[PlanPolygon]:
    """Polygons of features; no ``uses``: they are outlines."""
    found = []
    for feature in features:
        properties = properties_of(feature)
        closed = str(properties.get("category")) in _NOT_WALKED
        use, name = uses["closed" if closed else "walkable"] if uses else Use.OUTLINE, _label(properties.get("name"))
        polygons = [coordinates for kind, coordinates in geometries_of(feature) if kind == "Polygon"]
        found += [PlanPolygon(*rings(coordinates), use, name) for coordinates in polygons]
    return found


def _label(labels: object) -> str:
    """The first of the names in several languages."""
    return str(next(iter(labels.values()), "")) if isinstance(labels, dict) else ""


def _level(levels: Sequence[Feature], wanted: str | None) -> Feature:
    """The level of this id, ordinal or short name; the first for an empty text, the only one where none is wanted."""
    if wanted == "" and levels:
        return levels[0]
    names = [_names(level) for level in levels]
    there = ", ".join(each[-1] for each in names)
    if wanted is None:
        if len(levels) != 1:
            raise OSError(f"has {len(levels)} levels; specify level, one of: {there}")
        return levels[0]
    chosen = [level for level, known in zip(levels, names, strict=True) if wanted in known]
    if len(chosen) != 1:
        raise OSError(f"has {len(chosen) or 'no'} level{'s' * (len(chosen) > 1)} {wanted}; there are: {there}")
    return chosen[0]


def _names(level: Feature) -> list[str]:
    """Id, short name and ordinal of a level, the best to read last."""
    properties: Mapping[str, Any] = properties_of(level)
    known = [str(level.get("id")), _label(properties.get("short_name")), str(properties.get("ordinal", ""))]
    return [name for name in known if name]


def _of_level(path: Path, name: str, level: str) -> list[Feature]:
    return [feature for feature in _features(path, name) if str(properties_of(feature).get("level_id")) == level]


def _features(path: Path, name: str) -> list[Feature]:
    """Features of a file of the archive; none where it is not there."""
    data = _member(path, name)
    if data is None:
        return []
    try:
        return features_of(data)[0]
    except OSError as error:
        raise OSError(f"contains {name}, which {error}") from error


def _member(path: Path, name: str) -> bytes | None:
    """Read a file of a folder or archive, wherever in it; None where there is none."""
    if path.is_dir():
        return file_bytes(path / name) if (path / name).is_file() else None
    try:
        with zipfile.ZipFile(path) as archive:
            found = [member for member in archive.namelist() if member == name or member.endswith(f"/{name}")]
            if not found:
                return None
            with archive.open(min(found, key=len)) as file:
                data = file.read(_MOST_BYTES + 1)
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError) as error:
        raise OSError("cannot be read as a ZIP archive") from error
    if len(data) > _MOST_BYTES:
        raise OSError(f"contains {name}, which is larger than {_MOST_BYTES // 1_000_000} MB; make a smaller one")
    return data


register(PlanFormat("imdf", ("", ".zip", ".imdf"), read_imdf, is_archive))
