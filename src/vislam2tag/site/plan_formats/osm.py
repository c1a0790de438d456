"""OpenStreetMap plans: XML files with nodes, ways and multipolygons that have indoor tags; of one level."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from xml.parsers import expat

import shapely

from vislam2tag.site.plan_formats.geojson import WGS84, drawing_of
from vislam2tag.site.plans.drawing import PlanDrawing, PlanFormat, file_bytes, register
from vislam2tag.site.plans.features import Feature
from vislam2tag.site.plans.indoor import rings_of
from vislam2tag.site.plans.source import PlanSource

_HEAD_BYTES = 2000
_KINDS = {"node", "way", "relation"}
_LEAST_CORNERS = 3


def is_osm(path: Path) -> bool:
    """Whether a file's name or its beginning is that of OpenStreetMap's XML."""
    if path.suffix.lower() == ".osm":
        return True
    with path.open("rb") as file:
        return b"<osm" in file.read(_HEAD_BYTES)


def read_osm(path: Path, source: PlanSource) -> PlanDrawing:
    """Read the features of one level, as of GeoJSON with OpenStreetMap's tags."""
    elements = _Elements()
    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler = _refuse_doctype
    parser.StartElementHandler, parser.EndElementHandler = elements.start, elements.end
    try:
        parser.Parse(file_bytes(path), True)
    except expat.ExpatError as error:
        raise OSError(f"is not XML ({error})") from error
    except (KeyError, ValueError) as error:
        line = parser.CurrentLineNumber
        raise OSError(f"has an element without a proper id, position or reference in line {line}") from error
    features, incomplete = elements.features()
    drawing = drawing_of(features, source, lambda _: WGS84, tagged=True)
    if not incomplete:
        return drawing
    note = (
        f"{incomplete} indoor ways or multipolygons refer to elements that are not in the file, so they are left out: "
        "download an area with the whole building"
    )
    return replace(drawing, notes=(*drawing.notes, note))


def _refuse_doctype(*_: object) -> None:
    raise OSError("has a document type declaration, which OpenStreetMap files do not have: remove it")


@dataclass
class _Element:
    """A node, way or relation that is not deleted."""

    kind: str
    id: str
    tags: dict[str, str] = field(default_factory=dict)
    nodes: list[str] = field(default_factory=list)
    """Of a way, ids."""
    outer: list[str] = field(default_factory=list)
    inner: list[str] = field(default_factory=list)
    """Ids of a relation's ways."""


class _Elements:
    """What a file contains, gathered while it is parsed."""

    def __init__(self) -> None:
        """Start without elements."""
        self._places: dict[str, tuple[float, float]] = {}
        self._ways: dict[str, list[str]] = {}
        self._tagged: list[_Element] = []
        self._open: _Element | None = None

    def start(self, name: str, attributes: Mapping[str, str]) -> None:
        """Read the attributes of an element; raises KeyError or ValueError where they are wrong."""
        if name in _KINDS:
            gone = attributes.get("action") == "delete" or attributes.get("visible") == "false"
            self._open = None if gone else _Element(name, attributes["id"])
            if name == "node" and not gone:
                self._places[attributes["id"]] = float(attributes["lon"]), float(attributes["lat"])
        elif self._open is None:
            return
        elif name == "tag":
            self._open.tags[attributes["k"]] = attributes["v"]
        elif name == "nd":
            self._open.nodes.append(attributes["ref"])
            if "lon" in attributes:  # written by Overpass with "out geom"
                self._places[attributes["ref"]] = float(attributes["lon"]), float(attributes["lat"])
        elif name == "member" and attributes["type"] == "way":
            ways = self._open.inner if attributes.get("role") == "inner" else self._open.outer
            ways.append(attributes["ref"])

    def end(self, name: str) -> None:
        """Keep an element."""
        if name not in _KINDS or self._open is None:
            return
        if name == "way":
            self._ways[self._open.id] = self._open.nodes
        if self._open.tags:
            self._tagged.append(self._open)
        self._open = None

    def features(self) -> tuple[list[Feature], int]:
        """Tagged elements as features, and how many indoor ones are incomplete."""
        found: list[Feature] = []
        incomplete = 0
        for element in self._tagged:
            try:
                geometry = self._geometry(element)
            except KeyError:
                incomplete += "indoor" in element.tags
                continue
            found.append({"properties": element.tags, "geometry": geometry})
        return found, incomplete

    def _geometry(self, element: _Element) -> dict[str, Any] | None:
        """Geometry as GeoJSON has it; raises KeyError where a part is not in the file."""
        if element.kind == "node":
            return {"type": "Point", "coordinates": self._places[element.id]}
        if element.kind == "relation":
            return self._multipolygon(element) if "indoor" in element.tags else None
        points = self._line(element.nodes)
        closed = len(points) > _LEAST_CORNERS and points[0] == points[-1] and element.tags.get("area") != "no"
        return {"type": "Polygon", "coordinates": [points]} if closed else {"type": "LineString", "coordinates": points}

    def _multipolygon(self, element: _Element) -> dict[str, Any]:
        """Areas between the outer and inner ways, which may be pieces of rings."""
        outer, inner = (self._area(ways) for ways in (element.outer, element.inner))
        parts = [[outline.tolist(), *(hole.tolist() for hole in holes)] for outline, holes in rings_of(outer - inner)]
        return {"type": "MultiPolygon", "coordinates": parts}

    def _area(self, ways: Iterable[str]) -> shapely.Geometry:
        lines = [shapely.LineString(self._line(self._ways[way])) for way in ways]
        return shapely.union_all(shapely.get_parts(shapely.polygonize(lines)))

    def _line(self, nodes: Iterable[str]) -> list[tuple[float, float]]:
        """Places of a way's nodes; raises KeyError where one, or all but one, is not in the file."""
        places = [self._places[node] for node in nodes]
        if len(places) < 2:
            raise KeyError("a second node")
        return places


register(PlanFormat("osm", (".osm", ".xml"), read_osm, is_osm, options=("level", "ignore")))
