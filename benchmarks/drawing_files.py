"""Drawings of generated floors, in formats and habits of those who draw them, for ``drawings.py``."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from ezdxf.filemanagement import new as new_dxf
from ezdxf.xclip import XClip
from PIL import Image, ImageDraw
from shapely.geometry import LineString, Polygon, box
from shapely.geometry.base import BaseGeometry

from vislam2tag.core.arrays import FloatArray
from vislam2tag.simulation.ground_plan import DOOR_M, GroundPlan, Room, corridor_rects, make_ground_plan
from vislam2tag.simulation.settings import BuildingSettings

CORRIDOR_M = 2.4


@dataclass(frozen=True)
class DrawnFloor:
    """A generated floor with walls of a thickness, metres; doors are gaps in the walls."""

    layout: GroundPlan
    width_m: float
    height_m: float
    wall_m: float

    @classmethod
    def of(cls, seed: int, *, thin: bool = False) -> DrawnFloor:
        """A floor of another size and wall thickness for each seed; ``thin``: as walls that are drawn without one."""
        rng = np.random.default_rng(seed)
        width, height = float(rng.integers(36, 64)), float(rng.integers(28, 36))
        settings = BuildingSettings(width_m=width, height_m=height, corridor_width_m=CORRIDOR_M, dead_ends=0)
        return cls(make_ground_plan(settings, rng), width, height, 0.1 if thin else float(rng.choice([0.12, 0.2, 0.3])))

    @cached_property
    def walls(self) -> tuple[Polygon, ...]:
        """Footprints of the walls; those that touch are one."""
        ends = shapely.points(self.layout.walls.reshape(-1, 2))
        lines = shapely.linestrings(self.layout.walls)
        tree = shapely.STRtree(lines)
        met = np.bincount(tree.query(ends, "dwithin", 1e-6)[0], minlength=len(ends)) > 1
        corners = shapely.buffer(ends[met], self.wall_m / 2, cap_style="square")
        whole = shapely.union_all([*shapely.buffer(lines, self.wall_m / 2, cap_style="flat"), *corners])
        return tuple(shapely.get_parts(whole).tolist())

    @property
    def area_m2(self) -> float:
        """Area between the walls, doors included."""
        return float(box(0, 0, self.width_m, self.height_m).difference(shapely.union_all(self.walls)).area)

    @cached_property
    def corridors(self) -> Polygon:
        """The corridors as one area."""
        rects = corridor_rects(self.layout.corridors, CORRIDOR_M / 2, self.width_m)
        area: Polygon = shapely.union_all([box(*rect) for rect in rects])
        return area

    def doors(self) -> Iterator[tuple[Room, FloatArray]]:
        """Rooms, and the ends (2, 2) of their doors."""
        for room in self.layout.rooms:
            along = np.array([abs(room.inward[1]), abs(room.inward[0])]) * DOOR_M / 2
            yield room, np.array([room.door - along, room.door + along])

    def rings(self) -> Iterator[FloatArray]:
        """Corners (k, 2) of all outlines of walls, closed."""
        for wall in self.walls:
            yield from (np.asarray(ring.coords) for ring in (wall.exterior, *wall.interiors))


# --- DXF ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Words:
    """Names of layers and blocks."""

    wall: str
    door: str
    window: str
    text: str
    dimension: str
    furniture: str
    door_block: str


LANGUAGES = {
    "en": (
        Words("A-WALL", "A-DOOR", "A-GLAZ", "A-ANNO-TEXT", "A-WALL-DIMS", "A-FURN", "Door_90"),
        Words("Walls", "Doors", "Windows", "Text", "Wall dimensions", "Furniture", "SingleDoor"),
    ),
    "de": (
        Words("Wände", "Türen", "Fenster", "Texte", "Bemaßung", "Einrichtung", "Innentür_90"),
        Words("AUSSENWAENDE", "TUEREN", "FENSTER", "BESCHRIFTUNG", "WAND-BEMASSUNG", "Möblierung", "Drehtuer"),
    ),
    "fr": (
        Words("Cloisons", "Portes", "Fenêtres", "Textes", "Cotes", "Mobilier", "Porte_simple"),
        Words("MURS PORTEURS", "PORTES", "FENETRES", "TEXTES", "COTATION MURS", "MOBILIER", "BlocPorte"),
    ),
    "it": (
        Words("Muri", "Porte", "Finestre", "Testi", "Quote", "Arredi", "Porta_90"),
        Words("PARETI", "PORTE", "FINESTRE", "TESTI", "QUOTATURA MURI", "ARREDAMENTO", "PortaInterna"),
    ),
    "es": (
        Words("Muros", "Puertas", "Ventanas", "Textos", "Cotas", "Mobiliario", "Puerta_90"),
        Words("TABIQUES", "PUERTAS", "VENTANAS", "TEXTOS", "COTAS MUROS", "MUEBLES", "PuertaSimple"),
    ),
}
UNITS = {"in": (1, 0.0254), "mm": (4, 0.001), "cm": (5, 0.01), "m": (6, 1.0)}


@dataclass(frozen=True)
class DxfStyle:
    """How a floor is drawn as DXF."""

    language: str = "en"
    form: int = 0
    """Which of the two sets of words."""
    walls: str = "lines"
    """lines, outlines, hatch, solids, single (one line for each wall), lines in a block."""
    unit: str = "mm"
    said_unit: str | None = None
    """The unit that the header states; none: the true one; "": none is stated."""
    extras: tuple[str, ...] = ()
    """stray, frozen, clipped, storeys, frame."""
    binary: bool = False


def write_dxf(floor: DrawnFloor, style: DxfStyle, path: Path) -> None:
    """Write a floor as DXF with doors, texts, dimensions and furniture."""
    words = LANGUAGES[style.language][style.form]
    document: Any = new_dxf("R2010")
    said = style.unit if style.said_unit is None else style.said_unit
    document.header["$INSUNITS"] = UNITS[said][0] if said else 0
    document.header["$MEASUREMENT"] = 0 if style.unit == "in" else 1
    space, scale = document.modelspace(), 1 / UNITS[style.unit][1]
    for name in (words.wall, words.door, words.window, words.text, words.dimension, words.furniture):
        document.layers.add(name)
    _door_block(document, words, scale)
    storeys = 2 if "storeys" in style.extras else 1
    for number in range(storeys):
        shift = np.array([number * (floor.width_m + 25.0), 0.0])
        _draw_walls(document, floor, words, style, scale, shift)
        for room, ends in floor.doors():
            _insert_door(space, room, ends + shift, words, scale)
        _draw_beside(space, floor, words, scale, shift)
    for extra in style.extras:
        if extra in _EXTRAS:
            _EXTRAS[extra](document, floor, words, scale)
    document.saveas(path, fmt="bin" if style.binary else "asc")


def _door_block(document: Any, words: Words, scale: float) -> None:
    """A leaf that is open by 90 degrees, its swing, and a threshold."""
    block, side = document.blocks.new(words.door_block), DOOR_M * scale
    block.add_line((0, 0), (0, side))
    block.add_arc((0, 0), side, 0, 90)
    block.add_line((0, 0), (side, 0))


def _insert_door(space: Any, room: Room, ends: FloatArray, words: Words, scale: float) -> None:
    start, stop = (ends if room.inward[1] > 0 or room.inward[0] < 0 else ends[::-1]) * scale
    angle = float(np.degrees(np.arctan2(*(stop - start)[::-1])))
    space.add_blockref(words.door_block, tuple(start), {"layer": words.door, "rotation": angle})


def _draw_walls(
    document: Any, floor: DrawnFloor, words: Words, style: DxfStyle, scale: float, shift: FloatArray
) -> None:
    space, layer = document.modelspace(), {"layer": words.wall}
    if style.walls == "block":
        name = f"plan_{shift[0]:.0f}"
        space.add_blockref(name, (0, 0), layer)
        _WALLS["lines"](document.blocks.new(name), floor, {"layer": "0"}, scale, shift)
    else:
        _WALLS[style.walls](space, floor, layer, scale, shift)


def _lines(space: Any, floor: DrawnFloor, layer: dict[str, str], scale: float, shift: FloatArray) -> None:
    for ring in floor.rings():
        for start, stop in pairwise((ring + shift) * scale):
            space.add_line(tuple(start), tuple(stop), layer)


def _outlines(space: Any, floor: DrawnFloor, layer: dict[str, str], scale: float, shift: FloatArray) -> None:
    for ring in floor.rings():
        space.add_lwpolyline(((ring + shift) * scale).tolist(), close=True, dxfattribs=layer)


def _hatch(space: Any, floor: DrawnFloor, layer: dict[str, str], scale: float, shift: FloatArray) -> None:
    for wall in floor.walls:
        hatch = space.add_hatch(color=8, dxfattribs=layer)
        for ring in (wall.exterior, *wall.interiors):
            points = (np.asarray(ring.coords) + shift) * scale
            hatch.paths.add_polyline_path(points.tolist(), is_closed=True, flags=int(ring is wall.exterior))


def _solids(space: Any, floor: DrawnFloor, layer: dict[str, str], scale: float, shift: FloatArray) -> None:
    for segment in floor.layout.walls:
        piece = LineString(segment).buffer(floor.wall_m / 2, cap_style="flat")
        a, b, c, d, *_ = (np.asarray(piece.exterior.coords) + shift) * scale
        space.add_solid([tuple(corner) for corner in (a, b, d, c)], dxfattribs=layer)


def _single(space: Any, floor: DrawnFloor, layer: dict[str, str], scale: float, shift: FloatArray) -> None:
    for start, stop in (floor.layout.walls + shift) * scale:
        space.add_line(tuple(start), tuple(stop), layer)


_WALLS = {"lines": _lines, "outlines": _outlines, "hatch": _hatch, "solids": _solids, "single": _single}


def _draw_beside(space: Any, floor: DrawnFloor, words: Words, scale: float, shift: FloatArray) -> None:
    """Texts, dimensions, tables in rooms, and windows within the outer walls."""
    for number, room in enumerate(floor.layout.rooms, 1):
        x, y = (np.array([room.rect[0] + room.rect[2], room.rect[1] + room.rect[3]]) / 2 + shift) * scale
        text = space.add_text(f"0.{number:02d}", height=0.3 * scale, dxfattribs={"layer": words.text})
        text.set_placement((x, y))
        table = np.array([(0.6, 0.6), (2.0, 0.6), (2.0, 1.4), (0.6, 1.4)]) * scale + (x, y)
        space.add_lwpolyline(table.tolist(), close=True, dxfattribs={"layer": words.furniture})
        ends = np.array([(room.rect[0], room.rect[1] + 0.8), (room.rect[2], room.rect[1] + 0.8)])
        start, stop = (ends + shift) * scale
        space.add_line(tuple(start), tuple(stop), {"layer": words.dimension})
    for x in np.arange(2.0, floor.width_m - 2, 6.0):
        a, b = (np.array([(x, 0.0), (x + 1.5, 0.0)]) + shift) * scale
        space.add_line(tuple(a), tuple(b), {"layer": words.window})


def _stray(document: Any, floor: DrawnFloor, words: Words, scale: float) -> None:
    """A line that was left over far away."""
    far = np.array([(9e5, 5e6), (9e5 + floor.width_m, 5e6)]) * scale
    document.modelspace().add_line(*map(tuple, far), {"layer": words.wall})


def _frozen(document: Any, floor: DrawnFloor, words: Words, scale: float) -> None:
    """An old state of the walls that is switched off."""
    layer = document.layers.add(f"{words.wall} OLD")
    layer.freeze()
    for y in np.arange(1.0, floor.height_m, 1.0) * scale:
        document.modelspace().add_line((0, y), (floor.width_m * scale, y), {"layer": layer.dxf.name})


def _clipped(document: Any, floor: DrawnFloor, words: Words, scale: float) -> None:
    """A block of which only a part within a wall shows."""
    block = document.blocks.new("detail")
    block.add_line((0, 0), (0, 3 * floor.height_m * scale), {"layer": words.wall})
    insert = document.modelspace().add_blockref("detail", (0, 0), {"layer": words.wall})
    XClip(insert).set_block_clipping_path([(-0.1 * scale, 0), (0.1 * scale, 2 * scale)])


def _frame(document: Any, floor: DrawnFloor, _: Words, scale: float) -> None:
    """A border with a title block."""
    document.layers.add("TITLE-BLOCK")
    for outer in (
        (-8.0, -12.0, floor.width_m + 8, floor.height_m + 8),
        (floor.width_m - 10, -11.0, floor.width_m, -4.0),
    ):
        ring = np.asarray(box(*outer).exterior.coords) * scale
        document.modelspace().add_lwpolyline(ring.tolist(), close=True, dxfattribs={"layer": "TITLE-BLOCK"})


_EXTRAS: dict[str, Callable[[Any, DrawnFloor, Words, float], None]] = {
    "stray": _stray,
    "frozen": _frozen,
    "clipped": _clipped,
    "frame": _frame,
}


# --- GeoJSON, OpenStreetMap, IMDF --------------------------------------------------------------------------------

EARTH = (51.0, 7.0)
_M_PER_DEGREE = (111_320.0 * np.cos(np.radians(EARTH[0])), 111_260.0)


def _degrees(points: FloatArray) -> list[list[float]]:
    return [[EARTH[1] + x / _M_PER_DEGREE[0], EARTH[0] + y / _M_PER_DEGREE[1]] for x, y in np.asarray(points)[:, :2]]


def _feature(kind: str, coordinates: object, **properties: object) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": coordinates}}


def _polygon(shape: BaseGeometry, **properties: object) -> dict[str, Any]:
    assert isinstance(shape, Polygon)
    return _feature("Polygon", [_degrees(ring.coords) for ring in (shape.exterior, *shape.interiors)], **properties)


def indoor_features(floor: DrawnFloor, level: str) -> list[dict[str, Any]]:
    """The floor in OpenStreetMap's simple indoor tags: rooms, a corridor, and a node for each door."""
    rooms = [
        _polygon(box(*room.rect), indoor="room", level=level, name=f"{level}.{number:02d}")
        for number, room in enumerate(floor.layout.rooms, 1)
    ]
    doors = [
        _feature("Point", _degrees(np.array([room.door]))[0], door="yes", level=level, width=f"{DOOR_M:g}")
        for room, _ in floor.doors()
    ]
    return [*rooms, _polygon(floor.corridors, indoor="corridor", level=level), *doors]


def wall_features(floor: DrawnFloor) -> list[dict[str, Any]]:
    """The outline and the walls as obstacles."""
    outline = _polygon(box(0, 0, floor.width_m, floor.height_m), use="outline")
    return [outline, *(_polygon(wall, use="obstacle") for wall in floor.walls)]


def write_geojson(features: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write a feature collection."""
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}), encoding="utf-8")


def write_osm(features: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write features as OpenStreetMap XML: points as nodes, rings as closed ways, holes as relations."""
    lines, made, number = list[str](), list[str](), -1
    for feature in features:
        tags = "".join(f'<tag k="{key}" v="{value}"/>' for key, value in feature["properties"].items())
        geometry = feature["geometry"]
        if geometry["type"] == "Point":
            (lon, lat), number = geometry["coordinates"], number - 1
            lines.append(f'<node id="{number}" lat="{lat:.9f}" lon="{lon:.9f}" version="1">{tags}</node>')
            continue
        members = []
        for place, ring in enumerate(geometry["coordinates"]):
            nodes = []
            for lon, lat in ring[:-1]:
                number -= 1
                nodes.append(number)
                lines.append(f'<node id="{number}" lat="{lat:.9f}" lon="{lon:.9f}" version="1"/>')
            number -= 1
            references = "".join(f'<nd ref="{node}"/>' for node in [*nodes, nodes[0]])
            own = tags if len(geometry["coordinates"]) == 1 else ""
            made.append(f'<way id="{number}" version="1">{references}{own}</way>')
            members.append(f'<member type="way" ref="{number}" role="{"inner" if place else "outer"}"/>')
        if len(members) > 1:
            number -= 1
            made.append(
                f'<relation id="{number}" version="1">{"".join(members)}{tags}'
                '<tag k="type" v="multipolygon"/></relation>'
            )
    relations = [line for line in made if line.startswith("<relation")]
    ways = [line for line in made if line.startswith("<way")]
    text = "\n".join(
        ["<?xml version='1.0' encoding='UTF-8'?>", '<osm version="0.6">', *lines, *ways, *relations, "</osm>"]
    )
    path.write_text(text, encoding="utf-8")


def write_imdf(floors: Sequence[DrawnFloor], folder: Path) -> None:
    """Write an IMDF folder with a level for each floor."""
    folder.mkdir()
    files: dict[str, list[dict[str, Any]]] = {"level": [], "unit": [], "opening": []}
    for ordinal, floor in enumerate(floors):
        own = f"level-{ordinal}"
        level = _polygon(box(0, 0, floor.width_m, floor.height_m), ordinal=ordinal, short_name={"en": f"L{ordinal}"})
        files["level"].append({"id": own, **level})
        shapes = [*(("room", box(*room.rect)) for room in floor.layout.rooms), ("walkway", floor.corridors)]
        files["unit"] += [_polygon(shape, category=category, level_id=own) for category, shape in shapes]
        files["opening"] += [
            _feature("LineString", _degrees(ends), category="pedestrian", level_id=own) for _, ends in floor.doors()
        ]
    for name, features in files.items():
        numbered = [{"id": f"{name}-{number}", **each} for number, each in enumerate(features)]
        write_geojson(numbered, folder / f"{name}.geojson")


# --- IFC ---------------------------------------------------------------------------------------------------------


def write_ifc(floors: Sequence[DrawnFloor], path: Path, *, prefix: str = "MILLI") -> None:
    """Write walls, doors and named spaces of storeys that are 3.5 m high; ``prefix`` is that of metres."""
    from ifcopenshell.api import aggregate, context, geometry, project, root, spatial, unit

    model = project.create_file()
    whole_model = root.create_entity(model, ifc_class="IfcProject", name="Drawn")
    length = unit.add_si_unit(model, unit_type="LENGTHUNIT", **({"prefix": prefix} if prefix else {}))
    unit.assign_unit(model, units=[length])
    whole = context.add_context(model, context_type="Model")
    body = context.add_context(
        model, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=whole
    )
    building = root.create_entity(model, ifc_class="IfcBuilding", name="House")
    aggregate.assign_object(model, products=[building], relating_object=whole_model)
    scale = 1000.0 if prefix else 1.0
    for number, floor in enumerate(floors):
        storey = root.create_entity(model, ifc_class="IfcBuildingStorey", name=f"Level {number}")
        storey.Elevation = number * 3.5 * scale
        aggregate.assign_object(model, products=[storey], relating_object=building)
        place = np.eye(4)
        place[2, 3] = number * 3.5
        geometry.edit_object_placement(model, product=storey, matrix=place)
        elements = [("IfcWall", "", wall, 3.0) for wall in floor.walls]
        for _, ends in floor.doors():
            leaf = LineString(ends).buffer(floor.wall_m / 2, cap_style="flat")
            elements.append(("IfcDoor", "", leaf, 2.1))
        for name, shape, height in [
            *((f"{number}.{n:02d}", box(*room.rect), 3.0) for n, room in enumerate(floor.layout.rooms, 1)),
            ("Corridor", floor.corridors, 3.0),
        ]:
            elements.append(("IfcSpace", name, shape, height))
        for kind, name, shape, height in elements:
            element = root.create_entity(model, ifc_class=kind, name=name)
            geometry.edit_object_placement(model, product=element, matrix=place)
            geometry.assign_representation(
                model, product=element, representation=_extrusion(model, body, shape, height * scale, scale)
            )
            if kind == "IfcSpace":
                aggregate.assign_object(model, products=[element], relating_object=storey)
            else:
                spatial.assign_container(model, products=[element], relating_structure=storey)
    model.write(str(path))


def _extrusion(model: Any, body: Any, shape: Polygon, height: float, scale: float) -> Any:
    def curve(ring: Any) -> Any:
        points = [model.createIfcCartesianPoint((float(x * scale), float(y * scale))) for x, y in ring.coords]
        return model.createIfcPolyline(points)

    holes = [curve(ring) for ring in shape.interiors]
    outer = curve(shape.exterior)
    profile = (
        model.createIfcArbitraryProfileDefWithVoids("AREA", None, outer, holes)
        if holes
        else model.createIfcArbitraryClosedProfileDef("AREA", None, outer)
    )
    solid = model.createIfcExtrudedAreaSolid(profile, None, model.createIfcDirection((0.0, 0.0, 1.0)), height)
    return model.createIfcShapeRepresentation(body, "Body", "SweptSolid", [solid])


# --- pictures ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PictureStyle:
    """How a floor is drawn as a picture; ``extras``: coloured, hatched, legend, boxed, swings."""

    filled: bool = True
    extras: tuple[str, ...] = ()
    pixels_per_m: float = 25.0
    ink: tuple[int, int, int] = (30, 30, 30)


_MARGIN_M = 6.0
_COLOURS = ((255, 236, 200), (214, 238, 214), (214, 226, 246), (246, 220, 230))


def write_picture(floor: DrawnFloor, style: PictureStyle, path: Path) -> None:
    """Draw a floor with doors and room numbers; exactly its extent, or with margins if there is a legend."""
    canvas = _Canvas(floor, style)
    if "coloured" in style.extras:
        for number, room in enumerate(floor.layout.rooms):
            canvas.area(box(*room.rect), _COLOURS[number % len(_COLOURS)])
    for wall in floor.walls:
        canvas.area(wall, style.ink if style.filled else (255, 255, 255), style.ink)
    if "hatched" in style.extras:
        canvas.hatch(floor.walls)
    if "swings" in style.extras:
        for room, ends in floor.doors():
            canvas.swing(room, ends)
    for number, room in enumerate(floor.layout.rooms, 1):
        canvas.number(room, f"0.{number:02d}", boxed="boxed" in style.extras)
    if "legend" in style.extras:
        canvas.legend(floor)
    canvas.image.save(path)


class _Canvas:
    """An image with metres as coordinates."""

    def __init__(self, floor: DrawnFloor, style: PictureStyle) -> None:
        self.scale = style.pixels_per_m
        self.ink = style.ink
        self.margin_m = _MARGIN_M if "legend" in style.extras else 0.0
        sides = (floor.width_m + 2 * self.margin_m, floor.height_m + 2 * self.margin_m)
        self.top_m = floor.height_m + self.margin_m
        size = (round(sides[0] * self.scale), round(sides[1] * self.scale))
        self.image = Image.new("RGB", size, "white")
        self.draw = ImageDraw.Draw(self.image)

    def px(self, points: object) -> list[tuple[float, float]]:
        """Pixels of points (n, 2)."""
        places = np.asarray(points, dtype=np.float64)
        return [((x + self.margin_m) * self.scale, (self.top_m - y) * self.scale) for x, y in places.tolist()]

    def area(self, shape: Polygon, fill: tuple[int, int, int], edge: tuple[int, int, int] | None = None) -> None:
        """Fill a polygon with holes, which show what is below."""
        mask = Image.new("L", self.image.size, 0)
        paint = ImageDraw.Draw(mask)
        paint.polygon(self.px(shape.exterior.coords), fill=255)
        for ring in shape.interiors:
            paint.polygon(self.px(ring.coords), fill=0)
        self.image.paste(fill, mask=mask)
        if edge is not None:
            for ring in (shape.exterior, *shape.interiors):
                self.draw.line(self.px(ring.coords), fill=edge, width=2)

    def hatch(self, shapes: Sequence[Polygon]) -> None:
        """Draw parallel strokes through areas."""
        whole = shapely.union_all(shapes)
        left, low, right, high = whole.bounds
        for start in np.arange(left - (high - low), right, 0.25):
            for part in shapely.get_parts(LineString([(start, low), (start + high - low, high)]).intersection(whole)):
                self.draw.line(self.px(part.coords), fill=self.ink, width=1)

    def swing(self, room: Room, ends: FloatArray) -> None:
        """Draw a door leaf that is open by 90 degrees, and its swing."""
        hinge, other = ends
        leaf = hinge + np.array(room.inward) * DOOR_M
        self.draw.line(self.px([hinge, leaf]), fill=self.ink, width=2)
        turn = np.linspace(0, np.pi / 2, 16)[:, None]
        arc = hinge + np.cos(turn) * (other - hinge) + np.sin(turn) * (leaf - hinge)
        self.draw.line(self.px(arc), fill=self.ink, width=1)

    def number(self, room: Room, text: str, *, boxed: bool) -> None:
        """Write a room's number, in a box or not."""
        (x, y), *_ = self.px([((room.rect[0] + room.rect[2]) / 2, (room.rect[1] + room.rect[3]) / 2)])
        self.draw.text((x, y), text, fill=self.ink)
        if boxed:
            self.draw.rectangle((x - 6, y - 4, x + 34, y + 16), outline=self.ink)

    def legend(self, floor: DrawnFloor) -> None:
        """Draw a frame, a title block and a scale bar outside the building."""
        self.draw.rectangle((8, 8, self.image.width - 9, self.image.height - 9), outline=self.ink, width=3)
        block = self.px([(floor.width_m - 12, -5.5), (floor.width_m, -1.5)])
        self.draw.rectangle((block[0][0], block[1][1], block[1][0], block[0][1]), outline=self.ink, width=2)
        self.draw.text((block[0][0] + 8, block[1][1] + 8), "GROUND FLOOR 1:100", fill=self.ink)
        self.draw.line(self.px([(0, -3), (10, -3)]), fill=self.ink, width=3)


def write_svg(floor: DrawnFloor, path: Path) -> None:
    """Draw the walls as filled paths in millimetres at 1:100."""
    size = (10 * floor.width_m, 10 * floor.height_m)

    def ring(points: object) -> str:
        return "M" + "L".join(f"{10 * x:.3f},{10 * (floor.height_m - y):.3f}" for x, y in np.asarray(points)) + "Z"

    paths = "".join(
        f'<path fill-rule="evenodd" fill="#222" d="{"".join(ring(r.coords) for r in (w.exterior, *w.interiors))}"/>'
        for w in floor.walls
    )
    path.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{size[0]}mm" height="{size[1]}mm" '
        f'viewBox="0 0 {size[0]} {size[1]}">{paths}</svg>',
        encoding="utf-8",
    )


def write_pdf(floor: DrawnFloor, path: Path) -> None:
    """Draw the walls as filled paths on a page at 1:100."""
    import matplotlib as mpl
    from matplotlib.figure import Figure
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    with mpl.rc_context({"pdf.compression": 6}):
        figure = Figure(figsize=(floor.width_m / 100 / 0.0254, floor.height_m / 100 / 0.0254))
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set_axis_off()
        axes.set_xlim(0, floor.width_m)
        axes.set_ylim(0, floor.height_m)
        for wall in floor.walls:
            rings = [Outline(np.asarray(ring.coords)) for ring in (wall.exterior, *wall.interiors)]
            axes.add_patch(PathPatch(Outline.make_compound_path(*rings), facecolor="0.15", edgecolor="none"))
        figure.savefig(path)
