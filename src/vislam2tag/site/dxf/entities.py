"""Lines and texts that a DXF drawing shows: blocks inserted and clipped, without what is frozen, off or invisible."""

from __future__ import annotations

import io
import struct
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.dxf.layers import Kind, kind_of
from vislam2tag.site.plans.drawing import refuse_too_many
from vislam2tag.site.plans.source import PlanText

_CURVES = {"LINE", "LWPOLYLINE", "POLYLINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "HELIX"}
_FILLED = {"SOLID", "TRACE", "3DFACE", "HATCH", "MPOLYGON"}
_COMPOUND = {"INSERT", "MLINE"}
_TEXTS = {"TEXT", "MTEXT", "ATTRIB"}
_NO_GEOMETRY = {
    *(
        "DIMENSION",
        "ARC_DIMENSION",
        "LARGE_RADIAL_DIMENSION",
        "LEADER",
        "MULTILEADER",
        "MLEADER",
        "TOLERANCE",
        "ATTDEF",
    ),
    *("POINT", "RAY", "XLINE", "WIPEOUT", "IMAGE", "VIEWPORT", "ACAD_TABLE", "LIGHT", "OLE2FRAME", "PDFUNDERLAY"),
}
"""Types of which nothing can be a wall."""
_NAMED_BLOCKS = {Kind.WALL, Kind.PART, Kind.DOOR, Kind.ANNOTATION, Kind.FURNITURE, Kind.ELECTRICAL, Kind.SANITARY}
"""What a block's name may stand for: blocks called after rooms or storeys may contain anything."""
_DEEPEST = 16
"""Blocks within blocks."""
_BINARY = b"AutoCAD Binary DXF"


@dataclass(frozen=True)
class DrawnLine:
    """A line, or the boundary of a filled shape."""

    layer: str
    own: bool
    """Whether it is on that layer itself: what is on layer 0 of a block is on the layer of its insertion."""
    block: Kind
    """What the names of blocks around it stand for."""
    points: FloatArray
    """(k, 2), units of the file."""
    printed: bool = True
    """Whether its layer is one that is printed."""
    is_arc: bool = False
    thickness: float = 0.0
    """Of a filled shape, twice its area by its perimeter, units of the file."""


@dataclass
class Drawn:
    """What a drawing's model space shows, and what of it does not."""

    lines: list[DrawnLine] = field(default_factory=list)
    texts: list[tuple[str, PlanText]] = field(default_factory=list)
    """With their layers."""
    hidden: Counter[tuple[str, str]] = field(default_factory=Counter)
    """Entities by layer and why they are not shown."""
    unread: Counter[tuple[str, str]] = field(default_factory=Counter)
    """Entities by layer and type that cannot be read."""
    missing: set[str] = field(default_factory=set)
    """Drawings that this one refers to."""


def open_dxf(data: bytes) -> Any:
    """Parse a DXF file, text or binary; raises OSError, whose text completes a sentence about the file."""
    from ezdxf import recover  # of an extra
    from ezdxf.document import Drawing
    from ezdxf.lldxf.const import DXFError
    from ezdxf.lldxf.tagger import binary_tags_loader

    try:
        if data.startswith(_BINARY):
            return Drawing.load(binary_tags_loader(data))
        return recover.read(io.BytesIO(data))[0]
    except (DXFError, ValueError, KeyError, IndexError, struct.error) as error:
        raise OSError("cannot be read as DXF") from error


def drawn_entities(document: Any, sag: float) -> Drawn:
    """Read the model space; ``sag`` is how far a curve's pieces may be from it, units of the file."""
    reader = _Reader(document, sag)
    reader.read(document.modelspace(), _Place())
    return reader.drawn


@dataclass(frozen=True)
class _Place:
    """The blocks around an entity: the layer of the insertion, what they stand for, and what they cut away."""

    layer: str = "0"
    block: Kind = Kind.UNKNOWN
    clips: tuple[tuple[BaseGeometry, bool], ...] = ()
    """Polygons, and whether what is inside is cut away."""
    depth: int = 0


class _Reader:
    def __init__(self, document: Any, sag: float) -> None:
        self.drawn = Drawn()
        self._document, self._sag = document, sag
        self._layers = {layer.dxf.name.lower(): layer for layer in document.layers}
        self._points = 0

    def read(self, entities: Iterable[Any], place: _Place) -> None:
        """Read the entities of a layout or block."""
        for entity in entities:
            own = entity.dxf.layer != "0" or place.depth == 0
            layer = entity.dxf.layer if own else place.layer
            kind, why = entity.dxftype(), self._why_hidden(entity, layer)
            if kind in _COMPOUND and not _hides_contents(kind, why):
                self._insert(entity, layer, place)
            elif why:
                self.drawn.hidden[layer, why] += 1
            elif kind in _TEXTS:
                self._text(entity, layer, place)
            elif kind in _CURVES | _FILLED:
                self._lines(entity, DrawnLine(layer, own, place.block, np.empty((0, 2))), place)
            elif entity.proxy_graphic and kind not in _NO_GEOMETRY:
                self.read(entity.virtual_entities(), replace(place, layer=layer, depth=place.depth + 1))
            elif kind not in _NO_GEOMETRY:
                self.drawn.unread[layer, kind] += 1

    def _why_hidden(self, entity: Any, layer: str) -> str:
        known = self._layers.get(layer.lower())
        if known is not None and known.is_frozen():
            return "frozen layer"
        if entity.dxf.get("invisible", 0):
            return "invisible"
        return "layer that is off" if known is not None and known.is_off() else ""

    def _insert(self, entity: Any, layer: str, place: _Place) -> None:
        """Read the contents of an insertion."""
        if place.depth >= _DEEPEST:
            return
        block = place.block
        clips = place.clips
        if entity.dxftype() == "INSERT":
            self.read(entity.attribs, replace(place, layer=layer))
            name = self._block_name(entity)
            if block in (Kind.UNKNOWN, Kind.WALL, Kind.PART) and kind_of(name) in _NAMED_BLOCKS:
                block = kind_of(name)
            clips = (*clips, *_clip(entity))
        inside = _Place(layer, block, clips, place.depth + 1)
        copies = entity.multi_insert() if entity.dxftype() == "INSERT" and entity.mcount > 1 else [entity]
        for copy in copies:
            self.read(copy.virtual_entities(), inside)

    def _block_name(self, entity: Any) -> str:
        """Name of the block, that of its definition where it is dynamic; notes drawings that are not in the file."""
        from ezdxf.dynblkhelper import get_dynamic_block_definition

        layout = self._document.blocks.get(entity.dxf.name)
        if layout is not None and layout.block.is_xref and not len(layout):
            self.drawn.missing.add(layout.block.dxf.get("xref_path") or layout.name)
        definition = get_dynamic_block_definition(entity, self._document)
        return str(entity.dxf.name if definition is None else definition.name)

    def _text(self, entity: Any, layer: str, place: _Place) -> None:
        at = entity.dxf.insert
        if all(shapely.contains_xy(shape, at.x, at.y) != inverted for shape, inverted in place.clips):
            text = " ".join(str(entity.plain_text()).split("\n"))
            self.drawn.texts.append((layer, PlanText(text, (float(at.x), float(at.y)))))

    def _lines(self, entity: Any, like: DrawnLine, place: _Place) -> None:
        """Add the lines of an entity, as parts of a line that is ``like`` it."""
        known = self._layers.get(like.layer.lower())
        like = replace(like, printed=known is None or bool(known.dxf.get("plot", 1)), is_arc=entity.dxftype() == "ARC")
        try:
            lines = [np.array([(p.x, p.y) for p in path.flattening(self._sag)]) for path in _paths(entity)]
        except (TypeError, ValueError, ZeroDivisionError):  # meshes, and shapes that are none
            self.drawn.unread[like.layer, entity.dxftype()] += 1
            return
        lines = [line for line in lines if len(line) > 1]
        if entity.dxftype() in _FILLED:
            like = replace(like, thickness=_thickness(lines))
        elif entity.dxftype() == "LWPOLYLINE" and entity.dxf.get("const_width", 0) > 0:
            lines = [ring for line in lines for ring in _wide(line, entity.dxf.const_width)]
        for line in (part for whole in lines for part in _clipped(whole, place.clips)):
            self._points += len(line)
            refuse_too_many(self._points)
            self.drawn.lines.append(replace(like, points=line))


def _hides_contents(kind: str, why: str) -> bool:
    """Whether what an insertion contains is hidden with it: an off layer hides only what is on it."""
    return bool(why) and (kind != "INSERT" or "off" not in why)


def _paths(entity: Any) -> Iterator[Any]:
    from ezdxf import path

    if entity.dxftype() in ("HATCH", "MPOLYGON"):
        for one in path.from_hatch(entity):
            one.close()
            yield one
    else:
        yield path.make_path(entity)


def _thickness(rings: list[FloatArray]) -> float:
    """How thick a shape of these rings, each (k, 2), is: that of a long wall is its own."""
    shapes = [Polygon(ring).buffer(0) for ring in rings if len(ring) > 3]
    filled = reduce(shapely.symmetric_difference, shapes, Polygon())
    return 2 * filled.area / filled.length if filled.length else 0.0


def _wide(line: FloatArray, width: float) -> list[FloatArray]:
    """Outlines (k, 2) of a polyline with a width."""
    shape = shapely.buffer(shapely.linestrings(line), width / 2, cap_style="flat", join_style="mitre")
    return [shapely.get_coordinates(ring) for ring in shapely.get_parts(shapely.boundary(shape))]


def _clip(entity: Any) -> Iterator[tuple[BaseGeometry, bool]]:
    """The polygon that clips an insertion (XCLIP), and whether its inside is cut away; none where it is not clipped."""
    from ezdxf.math import Vec2
    from ezdxf.xclip import XClip

    clip = XClip(entity.origin_of_copy or entity)  # copies have no clip
    if not (clip.has_clipping_path and clip.is_clipping_enabled):
        return
    path = clip.get_block_clipping_path()
    corners = Vec2.list(entity.matrix44().transform_vertices(path.inner_polygon()))
    if len(corners) > 2:
        yield Polygon([(corner.x, corner.y) for corner in corners]).buffer(0), path.is_inverted_clip


def _clipped(line: FloatArray, clips: tuple[tuple[BaseGeometry, bool], ...]) -> Iterator[FloatArray]:
    """Parts (k, 2) of a line (n, 2) that no clip cuts away."""
    if not clips:
        yield line
        return
    shape = shapely.linestrings(line)
    for clip, inverted in clips:
        shape = shapely.difference(shape, clip) if inverted else shapely.intersection(shape, clip)
    for part in shapely.get_parts(shape):
        if part.geom_type == "LineString" and part.length:
            yield shapely.get_coordinates(part)
