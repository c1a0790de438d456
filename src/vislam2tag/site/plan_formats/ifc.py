"""IFC plans: one storey of a building model, its walls cut at 1 m above the floor, opened by doors."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from vislam2tag.core.arrays import FloatArray
from vislam2tag.site.plans.drawing import PlanDrawing, PlanFormat, bounds_of, register
from vislam2tag.site.plans.indoor import REACH_M, rings_of, without_gaps
from vislam2tag.site.plans.levels import chosen_level
from vislam2tag.site.plans.source import PlanPolygon, PlanSource, PlanText, Use
from vislam2tag.site.plans.taken_parts import IGNORED, Became, matching, taken_parts

_CLASSES = {
    "IfcWall": Became.WALLS,
    "IfcCurtainWall": Became.WALLS,
    "IfcWindow": Became.WALLS,
    "IfcColumn": Became.OBSTACLES,
    "IfcDoor": Became.OPENINGS,
    "IfcOpeningElement": Became.OPENINGS,
    "IfcSpace": Became.WALKABLE,
    "IfcStair": Became.WALKABLE,
    "IfcStairFlight": Became.WALKABLE,
    "IfcRamp": Became.WALKABLE,
    "IfcRampFlight": Became.WALKABLE,
}
"""Classes that count; the parts of an element are of its class."""
_OTHERS = {
    "IfcFurnishingElement": "furniture",
    "IfcDistributionElement": "installation",
    "IfcTransportElement": "installation",
    "IfcSlab": "floor or ceiling",
    "IfcCovering": "floor or ceiling",
    "IfcRoof": "floor or ceiling",
    "IfcBeam": "floor or ceiling",
    "IfcRailing": "railing",
}
"""Why others are left out."""
_NOT_CUT = "not at 1 m above the floor"
_CUT_M = 1.0
"""Height of the cut above the floor, metres; lower walls are cut at half their height."""
_SILL_M, _HEAD_M = 0.3, 1.8
"""Openings without a door or window that begin below and end above these heights are passages, metres."""
_GAP_M = 0.3
"""Gaps of up to twice this do not open the outline, metres."""
_SLIVER_M = 0.1
_TURNED = 1.5
"""A door that is so many times deeper than wide has its axes the other way round."""
_LEAST_INSIDE = 0.3
"""Share of the area around walls that they enclose, unless the storey is open."""
_GRID_M = 1e-4
_DEEPEST = 8


@dataclass(frozen=True)
class _Solid:
    """An element's surface: triangles (t, 3, 3), metres in the building's axes, and its own x axis (2,)."""

    element: Any
    kind: str
    triangles: FloatArray
    along: FloatArray

    @property
    def bottom(self) -> float:
        """Its lowest point, metres."""
        return float(self.triangles[..., 2].min())

    @property
    def top(self) -> float:
        """Its highest point, metres."""
        return float(self.triangles[..., 2].max())

    def cut(self, floor_m: float) -> BaseGeometry:
        """Its section above a floor; empty if it is not there."""
        height = floor_m + _CUT_M
        if self.bottom >= height or self.top <= floor_m + _SLIVER_M:
            return shapely.Polygon()
        return _section(self.triangles, height if self.top > height else (self.bottom + self.top) / 2)

    def footprint(self) -> BaseGeometry:
        """The convex hull of what is below it."""
        return shapely.convex_hull(shapely.multipoints(self.triangles[..., :2].reshape(-1, 2)))


def read_ifc(path: Path, source: PlanSource) -> PlanDrawing:
    """Read the storey that the source names, or the only one.

    Building models; coordinates are metres in the building's own axes.
    """
    import ifcopenshell  # of an extra

    try:
        model = ifcopenshell.open(str(path))
    except (ifcopenshell.Error, OSError) as error:
        raise OSError("cannot be read as IFC") from error
    storeys = _storeys(model)
    names = _names(storeys)
    number = chosen_level(names, source.level)
    elements = list(_elements(storeys[number]))
    ignored = matching({kind for _, kind in elements}, source.ignore)
    left = [(kind, Became.LEFT_OUT, IGNORED if kind in ignored else _why(one)) for one, kind in elements]
    left = [each for each in left if each[0] in ignored or each[0] not in _CLASSES]
    kept = {one.id(): kind for one, kind in elements if kind in _CLASSES and kind not in ignored}
    solids = list(_solids(model, [one for one, _ in elements if one.id() in kept], kept))
    if not any(_CLASSES[solid.kind] in (Became.WALLS, Became.WALKABLE) for solid in solids):
        raise OSError(f"has no walls or spaces with geometry on the storey {names[number][-1]}")
    shown = {solid.element.id() for solid in solids}
    unseen = [kind for one, kind in elements if one.id() in kept and one.id() not in shown and not one.IsDecomposedBy]
    left += [(kind, Became.LEFT_OUT, "no geometry") for kind in unseen]
    notes = (*_unseen_note(unseen), *_georeference_note(model))
    return _drawn(solids, tuple(each[-1] for each in names), left, notes)


def _unseen_note(kinds: Sequence[str]) -> tuple[str, ...]:
    walls = sum(_CLASSES[kind] in (Became.WALLS, Became.OBSTACLES) for kind in kinds)
    if not walls:
        return ()
    return (f"{walls} walls, windows or columns have no geometry that can be read: check that they are not missing",)


def _storeys(model: Any) -> list[Any]:
    """Storeys, upwards, those without walls or spaces left out; of a model without storeys, its building."""
    kinds = (model.by_type(name) for name in ("IfcBuildingStorey", "IfcBuilding", "IfcProject"))
    found: list[Any] = next(filter(None, kinds), [])
    if not found:
        raise OSError("contains no building")
    found = sorted(found, key=_elevation)
    return [one for one in found if any(_class_of(part) in _CLASSES for part in _parts(one))] or found


def _parts(storey: Any) -> Iterator[Any]:
    """What is directly in a storey."""
    for relation in (*getattr(storey, "ContainsElements", ()), *storey.IsDecomposedBy):
        yield from getattr(relation, "RelatedElements", ()) or getattr(relation, "RelatedObjects", ())


def _elevation(storey: Any) -> float:
    return float(getattr(storey, "Elevation", None) or 0.0)


def _names(storeys: Sequence[Any]) -> list[tuple[str, ...]]:
    """Number and name of each storey; 0 is the one at the building's zero."""
    ground = min(range(len(storeys)), key=lambda number: abs(_elevation(storeys[number])))
    called = [str(one.Name or one.LongName or "").strip() for one in storeys]
    numbers = [str(number - ground) for number in range(len(storeys))]
    return [
        (number, name) if name and called.count(name) == 1 else (name, number)
        for number, name in zip(numbers, called, strict=True)
    ]


def _elements(storey: Any) -> Iterator[tuple[Any, str]]:
    """Elements of a storey, with their parts, openings and doors, and the class of each."""
    from ifcopenshell.util.element import get_decomposition

    for element in sorted(get_decomposition(storey), key=lambda one: int(one.id())):
        if element.is_a("IfcElement") or element.is_a("IfcSpace"):
            yield element, _class_of(element)


def _class_of(element: Any) -> str:
    """The class that counts: its own, else that of what it is a part of."""
    from ifcopenshell.util.element import get_aggregate

    whole = element
    for _ in range(_DEEPEST):
        if whole is None:
            break
        if (name := next((name for name in _CLASSES if whole.is_a(name)), None)) is not None:
            return name
        whole = get_aggregate(whole)
    return str(element.is_a())


def _why(element: Any) -> str:
    return next((why for name, why in _OTHERS.items() if element.is_a(name)), "no part of walls")


def _solids(model: Any, elements: Sequence[Any], kinds: dict[int, str]) -> Iterator[_Solid]:
    """Surfaces of elements that have geometry; doors and windows do not open walls yet."""
    import ifcopenshell.geom
    from ifcopenshell.util.shape import get_shape_matrix

    settings = ifcopenshell.geom.settings()
    settings.set("disable-opening-subtractions", True)
    settings.set("building-local-placement", True)
    if not elements:
        return
    for shape in ifcopenshell.geom.iterator(settings, model, 1, include=elements):
        corners = np.array(shape.geometry.verts, dtype=np.float64).reshape(-1, 3)
        faces = np.array(shape.geometry.faces, dtype=np.int64).reshape(-1, 3)
        matrix = get_shape_matrix(shape)
        if len(faces):
            triangles = (corners @ matrix[:3, :3].T + matrix[:3, 3])[faces]
            yield _Solid(model.by_id(shape.id), kinds[shape.id], triangles, matrix[:2, 0])


def _section(triangles: FloatArray, height: float) -> BaseGeometry:
    """The area in which a closed surface (t, 3, 3) is cut at a height; of an open one, what is around its lines."""
    below = triangles[..., 2] < height
    crossed = below != np.roll(below, -1, axis=1)
    triangles, crossed = triangles[crossed.any(axis=1)], crossed[crossed.any(axis=1)]
    ends = np.roll(triangles, -1, axis=1)
    share = (height - triangles[..., 2]) / np.where(crossed, ends[..., 2] - triangles[..., 2], 1.0)
    points = triangles + share[..., None] * (ends - triangles)
    lines = shapely.linestrings(points[crossed].reshape(-1, 2, 3)[..., :2])
    noded = shapely.union_all(lines, grid_size=_GRID_M)
    area = shapely.build_area(noded)
    return area if not area.is_empty else shapely.convex_hull(noded)


def _drawn(
    solids: Sequence[_Solid], levels: tuple[str, ...], left: list[tuple[str, Became, str]], notes: tuple[str, ...]
) -> PlanDrawing:
    """Draw a storey."""
    solid_walls = [one for one in solids if _CLASSES[one.kind] in (Became.WALLS, Became.OBSTACLES)]
    floors = [one for one in solids if _CLASSES[one.kind] is Became.WALKABLE]
    floor_m = float(np.median([one.bottom for one in solid_walls or floors]))
    cuts = [one.cut(floor_m) for one in solid_walls]
    walls = shapely.simplify(shapely.union_all(cuts), _GRID_M)
    spaces = [(one, _space(one, floor_m)) for one in floors]
    doors = _doors(solids)
    passages = [one for one in solids if _is_passage(one, floor_m)]
    outline, open_note = _outline(walls, [area for _, area in spaces])
    shafts = _shafts(outline - walls, spaces, doors)
    polygons = [PlanPolygon(*each, Use.OUTLINE) for each in rings_of(outline)]
    polygons += [PlanPolygon(*each, Use.OBSTACLE) for shape in (walls, shafts) for each in rings_of(shape)]
    polygons += [PlanPolygon(*each, Use.OPENING) for one in passages for each in rings_of(one.footprint())]
    counted = [
        (one.kind, Became.LEFT_OUT, _NOT_CUT) if cut.is_empty else (one.kind, _CLASSES[one.kind], "")
        for one, cut in zip(solid_walls, cuts, strict=True)
    ]
    used = [(one.kind, _CLASSES[one.kind], "") for one in (*floors, *passages)]
    used += [("IfcDoor", Became.OPENINGS, "")] * len(doors)
    used += [("shafts and voids", Became.OBSTACLES, "neither a space nor a door")] * len(rings_of(shafts))
    return PlanDrawing(
        bounds=bounds_of(np.concatenate([each.outline for each in polygons] or [np.empty((0, 2))])),
        polygons=tuple(polygons),
        passages=tuple(doors),
        texts=tuple(_texts(spaces)),
        levels=levels,
        unit_m=1.0,
        taken=taken_parts([*counted, *used, *left]),
        notes=(*notes, *open_note),
    )


def _space(solid: _Solid, floor_m: float) -> BaseGeometry:
    """The floor of a space; of stairs, what they cover."""
    return solid.cut(floor_m) if solid.kind == "IfcSpace" else solid.footprint()


def _doors(solids: Sequence[_Solid]) -> list[FloatArray]:
    """A line (2, 2) across each door, along the wall: as wide as its opening in the wall, else as itself."""
    by_id = {one.element.id(): one for one in solids}
    found = []
    for door in (one for one in solids if one.kind == "IfcDoor" and one.element.is_a("IfcDoor")):
        filled = [by_id.get(each.RelatingOpeningElement.id(), door) for each in door.element.FillsVoids]
        points = (filled[0] if filled else door).triangles[..., :2].reshape(-1, 2)
        along, across = _axes(door)
        reach, depth = points @ along, points @ across
        middle = across * (depth.min() + depth.max()) / 2
        found.append(np.array([along * reach.min() + middle, along * reach.max() + middle]))
    return found


def _axes(door: _Solid) -> tuple[FloatArray, FloatArray]:
    """Directions (2,) along a door's wall and across it: its x and y axis, unless it is much wider along y."""
    along = door.along / max(float(np.linalg.norm(door.along)), 1e-9)
    across = np.array([-along[1], along[0]])
    wide, deep = (float(np.ptp(door.triangles[..., :2] @ axis)) for axis in (along, across))
    return (along, across) if deep < _TURNED * wide else (across, along)


def _is_passage(solid: _Solid, floor_m: float) -> bool:
    """Whether an element is an opening through a wall, without a door or window, that one can walk through."""
    element = solid.element
    return (
        solid.kind == "IfcOpeningElement"
        and not element.HasFillings
        and getattr(element, "PredefinedType", None) != "RECESS"
        and any(each.RelatingBuildingElement.is_a("IfcWall") for each in element.VoidsElements)
        and solid.bottom <= floor_m + _SILL_M
        and solid.top >= floor_m + _HEAD_M
    )


def _outline(walls: BaseGeometry, spaces: Iterable[BaseGeometry]) -> tuple[BaseGeometry, tuple[str, ...]]:
    """The area within the outer walls; where they do not enclose the storey, around all of it, with a note."""
    whole = without_gaps([walls, *spaces], _GAP_M)
    filled = shapely.union_all([shapely.Polygon(part.exterior) for part in shapely.get_parts(whole)])
    hull = shapely.convex_hull(filled)
    if filled.area - walls.area >= _LEAST_INSIDE * hull.area:
        return filled, ()
    return hull, ("the walls do not enclose the storey, so all of the area around them counts as its floor: check it",)


def _shafts(
    free: BaseGeometry, spaces: Sequence[tuple[_Solid, BaseGeometry]], doors: Sequence[FloatArray]
) -> BaseGeometry:
    """Free parts of a storey that has spaces, but none there, and to which no door leads."""
    if not any(one.kind == "IfcSpace" for one, _ in spaces):
        return shapely.Polygon()
    rest = shapely.difference(free, shapely.union_all([area for _, area in spaces]))
    rest = shapely.buffer(shapely.buffer(rest, -_SLIVER_M), _SLIVER_M, join_style="mitre")
    entered = shapely.union_all([shapely.linestrings(door) for door in doors])
    return shapely.union_all([part for part in shapely.get_parts(rest) if not part.distance(entered) <= REACH_M])


def _texts(spaces: Iterable[tuple[_Solid, BaseGeometry]]) -> Iterator[PlanText]:
    """Numbers and names of spaces."""
    for solid, area in spaces:
        names = (solid.element.Name, solid.element.LongName) if solid.kind == "IfcSpace" else ()
        text = " ".join(dict.fromkeys(str(name).strip() for name in names if name))
        if text and not area.is_empty:
            point = area.representative_point()
            yield PlanText(text, (float(point.x), float(point.y)))


def _georeference_note(model: Any) -> tuple[str, ...]:
    """What places the building on earth, which is for the site to say."""
    from ifcopenshell.util.placement import get_local_placement
    from ifcopenshell.util.unit import calculate_unit_scale

    found = model.by_type("IfcMapConversion") if "IFC2X3" not in model.schema else []
    buildings = model.by_type("IfcBuilding")
    system = re.search(r"EPSG:\s*(\d+)", str(found[0].TargetCRS.Name), re.IGNORECASE) if found else None
    if system is None or len(buildings) != 1:
        return ()
    building = get_local_placement(buildings[0].ObjectPlacement)
    x_axis = complex(found[0].XAxisAbscissa or 0.0, found[0].XAxisOrdinate or 0.0) or 1.0
    turn = x_axis / abs(x_axis)
    place = complex(found[0].Eastings, found[0].Northings)
    place += turn * complex(*building[:2, 3]) * calculate_unit_scale(model)
    angle = np.degrees(np.angle(turn * complex(*building[:2, 0])))
    where = f"EPSG:{system[1]},{place.real:.3f},{place.imag:.3f},{angle:.4f}"
    return (f"the file says where the building is: add --georeference {where} if the site has no georeference yet",)


register(PlanFormat("ifc", (".ifc",), read_ifc, options=("level", "ignore")))
