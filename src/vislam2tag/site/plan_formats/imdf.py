"""IMDF plans (Indoor Mapping Data Format, OGC 20-094): one level of a folder or ZIP archive."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vislam2tag.site.plan_formats.geojson import WGS84
from vislam2tag.site.plans.drawing import PlanDrawing, PlanFormat, bounds_of, file_bytes, register
from vislam2tag.site.plans.features import Feature, features_of, geometries_of, polyline, properties_of, rings
from vislam2tag.site.plans.levels import chosen_level
from vislam2tag.site.plans.source import PlanPolygon, PlanSource, Use
from vislam2tag.site.plans.taken_parts import IGNORED, Became, matching, taken_parts

_LEVELS = "level.geojson"
_KINDS = ("unit", "fixture", "kiosk", "opening")
_MOST_BYTES = 50_000_000
"""Of a file of the archive, unpacked; parsed it takes some ten times that."""
_NOT_WALKED = {"column", "nonpublic", "opentobelow", "structure", "brick", "concrete", "drywall", "glass", "wood"}
"""Categories of units that no one walks in."""
_USES = {Became.OUTLINE: Use.OUTLINE, Became.WALKABLE: Use.WALKABLE, Became.OBSTACLES: Use.OBSTACLE}


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
    names = [_names(each) for each in levels]
    level = levels[chosen_level(names, source.level)]
    parts = [("level", Became.OUTLINE, level)]
    for kind in _KINDS:
        parts += [_part(kind, each) for each in _of_level(path, f"{kind}.geojson", str(level.get("id")))]
    ignored = matching({name for name, _, _ in parts}, source.ignore)
    kept = [(became, feature) for name, became, feature in parts if name not in ignored]
    polygons = [polygon for became, feature in kept if became in _USES for polygon in _polygons(feature, _USES[became])]
    openings = [shape for became, feature in kept if became is Became.OPENINGS for shape in geometries_of(feature)]
    passages = tuple(polyline(coordinates) for kind, coordinates in openings if kind == "LineString")
    points = np.concatenate([np.empty((0, 2)), *(each.outline for each in polygons), *passages])
    return PlanDrawing(
        bounds_of(points),
        polygons=tuple(polygons),
        passages=passages,
        levels=tuple(each[-1] for each in names),
        epsg=WGS84,
        taken=taken_parts(
            (name, Became.LEFT_OUT, IGNORED) if name in ignored else (name, became, "") for name, became, _ in parts
        ),
    )


def _part(kind: str, feature: Feature) -> tuple[str, Became, Feature]:
    """Class of a feature, and what it becomes."""
    category = properties_of(feature).get("category")
    name = f"{kind}={category}" if category else kind
    if kind == "opening":
        return name, Became.OPENINGS, feature
    walked = kind == "unit" and category not in _NOT_WALKED
    return name, Became.WALKABLE if walked else Became.OBSTACLES, feature


def _polygons(feature: Feature, use: Use) -> list[PlanPolygon]:
    name = _label(properties_of(feature).get("name"))
    shapes = [coordinates for kind, coordinates in geometries_of(feature) if kind == "Polygon"]
    return [PlanPolygon(*rings(coordinates), use, name) for coordinates in shapes]


def _label(labels: object) -> str:
    """The first of the names in several languages."""
    return str(next(iter(labels.values()), "")) if isinstance(labels, dict) else ""


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


register(PlanFormat("imdf", ("", ".zip", ".imdf"), read_imdf, is_archive, options=("level", "ignore")))
