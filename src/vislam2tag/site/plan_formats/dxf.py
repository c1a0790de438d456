"""DXF plans: lines, polylines and arcs of the layers that contain walls; doors stay open."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Iterator
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np

from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.plans.drawing import PlanDrawing, PlanFormat, bounds_of, file_bytes, refuse_too_many, register
from vislam2tag.site.plans.features import segments
from vislam2tag.site.plans.source import PlanSource, PlanText

_WALL = re.compile(r"wall|wand|mauer|mur|pared|partition|column|st(ue|ü)tze|window|fenster|glaz|facade|fassade", re.I)
_DOOR = re.compile(r"door|(^|[-_ ])t(ue|ü)r|porte|puerta|swing", re.I)
_BESIDE = re.compile(
    r"text|dim|anno|furn|m(oe|ö)bel|grid|ax[ie]s|achse|title|border|defpoints|plumb|sanit|elec|light|hatch|schraff",
    re.I,
)
"""Layers of other things, which count where no layer is called after walls."""
_CURVES = {"LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE"}
_COMPOUND = {"INSERT", "MLINE"}
_TEXTS = {"TEXT", "MTEXT", "ATTRIB"}
_SAG = 0.01
"""How far a curve's pieces may lie beside it, metres."""
_DEEPEST = 16
"""Blocks within blocks."""
_Line = tuple[str, bool, FloatArray]
"""Layer, whether it belongs to a door's block, and points (k, 2)."""


def read_dxf(path: Path, source: PlanSource) -> PlanDrawing:
    """Read the model space.

    CAD drawings; coordinates are the file's, whose header defines the unit.
    """
    from ezdxf import recover, units  # of an extra
    from ezdxf.enums import InsertUnits
    from ezdxf.lldxf.const import DXFError

    try:
        document, _ = recover.read(io.BytesIO(file_bytes(path)))
        code = int(document.header.get("$INSUNITS", 0))
        unit_m = float(units.conversion_factor(InsertUnits(code), InsertUnits.Meters)) if code else None
    except (DXFError, ValueError, KeyError) as error:
        raise OSError("cannot be read as DXF") from error
    hidden = {layer.dxf.name.lower() for layer in document.layers if layer.is_off() or layer.is_frozen()}
    shown, points_count = [], 0
    for line in _lines(document.modelspace(), _SAG / (unit_m or 1.0)):
        refuse_too_many(points_count := points_count + len(line[2]))
        if line[0].lower() not in hidden:
            shown.append(line)
    walls, doors = _sorted(shown, source.layers)
    points = np.concatenate([walls.reshape(-1, 2), doors.reshape(-1, 2)])
    texts = tuple(text for layer, text in _texts(document.modelspace()) if layer.lower() not in hidden)
    return PlanDrawing(bounds_of(points), walls=walls, doors=doors, texts=texts, unit_m=unit_m)


def _lines(
    entities: Iterable[Any], sag: float, layer: str = "0", in_door: bool = False, depth: int = 0
) -> Iterator[_Line]:
    """Lines of a layout or block; what is on layer 0 of a block is on the layer of its insertion."""
    from ezdxf.path import make_path

    for entity in entities:
        own = entity.dxf.layer if entity.dxf.layer != "0" else layer
        kind = entity.dxftype()
        if kind in _COMPOUND and depth < _DEEPEST:
            door = in_door or bool(kind == "INSERT" and _DOOR.search(entity.dxf.name))
            copies = entity.multi_insert() if kind == "INSERT" and entity.mcount > 1 else [entity]
            for copy in copies:
                yield from _lines(copy.virtual_entities(), sag, own, door, depth + 1)
        elif kind in _CURVES:
            points = np.array([(p.x, p.y) for p in make_path(entity).flattening(sag)]).reshape(-1, 2)
            if len(points) > 1:
                yield own, in_door, points


def _texts(entities: Iterable[Any]) -> Iterator[tuple[str, PlanText]]:
    """Texts with their layers: single ones, and the attributes of blocks, as room stamps are."""
    for entity in entities:
        kind = entity.dxftype()
        if kind == "INSERT":
            yield from _texts(entity.attribs)
        elif kind in _TEXTS:
            written = entity.plain_text() if kind != "MTEXT" else entity.plain_text().replace("\n", " ")
            place = entity.dxf.insert
            yield entity.dxf.layer, PlanText(str(written), (float(place.x), float(place.y)))


def _sorted(lines: list[_Line], wanted: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """Segments (w, 2, 2) of walls and (d, 2, 2) of doors."""
    layers = sorted({layer for layer, _, _ in lines})
    if not layers:
        raise OSError("contains no line, polyline or arc in its model space")
    for pattern in wanted:
        if not any(fnmatch(layer.lower(), pattern.lower()) for layer in layers):
            raise OSError(f"has no layer {pattern}; there are: {', '.join(layers)}")
    doors = {layer for layer in layers if _DOOR.search(layer)}
    if wanted:
        walls = {layer for layer in layers for pattern in wanted if fnmatch(layer.lower(), pattern.lower())}
    else:
        named = {layer for layer in layers if _WALL.search(layer)} - doors
        walls = named or {layer for layer in layers if not _BESIDE.search(layer)} - doors
    of_walls = [points for layer, in_door, points in lines if layer in walls and not in_door]
    of_doors = [points for layer, in_door, points in lines if in_door or (layer in doors and layer not in walls)]
    if not of_walls:
        raise OSError(f"has no layers whose names suggest walls; specify layers, from: {', '.join(layers)}")
    return _segments(of_walls), _segments(of_doors)


def _segments(lines: list[FloatArray]) -> FloatArray:
    """Segments (w, 2, 2) of polylines, (k, 2) each, without those of no length."""
    pieces = np.concatenate([np.empty((0, 2, 2)), *(segments(line) for line in lines)])
    kept: FloatArray = pieces[(pieces[:, 0] != pieces[:, 1]).any(axis=1)]
    return kept


register(PlanFormat("dxf", (".dxf",), read_dxf, options=("layers", "doors", "ignore", "epsg", "area")))
