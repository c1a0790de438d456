"""A storey of a building model: walls cut at 1 m, opened by doors and passages, with the names of spaces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.site.plans.drawn_floor import floor_with
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.site.plans.drawing import PlanDrawing, read_drawing
from vislam2tag.site.plans.load import floor_plan
from vislam2tag.site.plans.source import PlanSource, Use
from vislam2tag.site.plans.taken_parts import Became, TakenPart
from vislam2tag.site.settings import WalkableSettings
from vislam2tag.site.walkable.drawn_cells import polygon_area

ifcopenshell = pytest.importorskip("ifcopenshell")
MM = 1000.0
Box = tuple[float, float, float, float]
"""x and y of two corners, metres."""


class Model:
    """A building model in millimetres, 30 degrees turned and far away on its site, with storeys 3 m apart."""

    def __init__(self, schema: str = "IFC4") -> None:
        self.file = ifcopenshell.file(schema=schema)
        new = self.file.create_entity
        context = new("IfcGeometricRepresentationContext", None, "Model", 3, 1e-5, self.placement(0, 0, 0))
        length = new("IfcSIUnit", UnitType="LENGTHUNIT", Prefix="MILLI", Name="METRE")
        self.project = self.entity(
            "IfcProject", RepresentationContexts=[context], UnitsInContext=new("IfcUnitAssignment", [length])
        )
        self.context = context
        site = self.entity("IfcSite", ObjectPlacement=self.local(294_405, 5_628_801, 0, None, 30))
        self.building = self.entity("IfcBuilding", ObjectPlacement=self.local(1, 2, 0, site))
        self.part(self.project, site)
        self.part(site, self.building)

    def entity(self, kind: str, **values: Any) -> Any:
        return self.file.create_entity(kind, GlobalId=ifcopenshell.guid.new(), **values)

    def placement(self, x: float, y: float, z: float, turn_deg: float = 0.0) -> Any:
        new, turn = self.file.create_entity, np.radians(turn_deg)
        axes = (0.0, 0.0, 1.0), (float(np.cos(turn)), float(np.sin(turn)), 0.0)
        origin = new("IfcCartesianPoint", (x * MM, y * MM, z * MM))
        return new("IfcAxis2Placement3D", origin, *(new("IfcDirection", axis) for axis in axes))

    def local(self, x: float, y: float, z: float, within: Any, turn_deg: float = 0.0) -> Any:
        inside = None if within is None else within.ObjectPlacement
        return self.file.create_entity("IfcLocalPlacement", inside, self.placement(x, y, z, turn_deg))

    def part(self, whole: Any, *parts: Any) -> None:
        self.entity("IfcRelAggregates", RelatingObject=whole, RelatedObjects=list(parts))

    def storey(self, name: str, z: float) -> Any:
        placed = self.local(0, 0, z, self.building)
        found = self.entity("IfcBuildingStorey", Name=name, ObjectPlacement=placed, Elevation=z * MM)
        self.part(self.building, found)
        return found

    def add(self, storey: Any, kind: str, box: Box, z: float = 0.0, height: float = 2.8, **values: Any) -> Any:
        """Add a box to a storey; its own x axis is along its longer side."""
        new, (left, low, right, high) = self.file.create_entity, box
        long = right - left >= high - low
        sides = (right - left, high - low) if long else (high - low, right - left)
        placed = self.local(left, low, z, storey) if long else self.local(right, low, z, storey, 90)
        corners = [(0, 0), (sides[0], 0), sides, (0, sides[1]), (0, 0)]
        line = new("IfcPolyline", [new("IfcCartesianPoint", (x * MM, y * MM)) for x, y in corners])
        profile = new("IfcArbitraryClosedProfileDef", "AREA", None, line)
        solid = new(
            "IfcExtrudedAreaSolid", profile, self.placement(0, 0, 0), new("IfcDirection", (0.0, 0.0, 1.0)), height * MM
        )
        body = new("IfcShapeRepresentation", self.context, "Body", "SweptSolid", [solid])
        shape = new("IfcProductDefinitionShape", None, None, [body])
        found = self.entity(kind, ObjectPlacement=placed, Representation=shape, **values)
        if kind == "IfcSpace":
            self.part(storey, found)
        elif kind != "IfcOpeningElement":
            self.entity("IfcRelContainedInSpatialStructure", RelatedElements=[found], RelatingStructure=storey)
        return found

    def opening(self, storey: Any, wall: Any, box: Box, filling: str = "", z: float = 0.0) -> None:
        """Cut a wall, and fill the opening with a thin element of this kind."""
        hole = self.add(storey, "IfcOpeningElement", box, z, 2.1)
        self.entity("IfcRelVoidsElement", RelatingBuildingElement=wall, RelatedOpeningElement=hole)
        if filling:
            middle = (box[0] + box[2]) / 2
            filled = self.add(storey, filling, (middle - 0.02, box[1], middle + 0.02, box[3]), z, 2.1)
            self.entity("IfcRelFillsElement", RelatingOpeningElement=hole, RelatedBuildingElement=filled)


def two_storeys(schema: str = "IFC4") -> Model:
    """Ground floor of 12 m x 6 m: two rooms, between them a wall with a door and a passage, and a shaft."""
    model = Model(schema)
    ground, first = model.storey("Erdgeschoss", 0), model.storey("Obergeschoss", 3)
    model.storey("Dach", 6)
    for box in ((0, 0, 12, 0.2), (0, 5.8, 12, 6), (0, 0.2, 0.2, 5.8), (11.8, 0.2, 12, 5.8), (9.9, 0.2, 10.1, 5.8)):
        model.add(ground, "IfcWall", box)
    middle = model.add(ground, "IfcWall", (4.9, 0.2, 5.1, 5.8))
    model.opening(ground, middle, (4.8, 1, 5.2, 1.9), "IfcDoor")
    model.opening(ground, middle, (4.8, 3, 5.2, 4))
    model.opening(ground, middle, (4.8, 4.5, 5.2, 5.5), "IfcWindow", z=0.9)
    model.add(ground, "IfcColumn", (2, 2, 2.4, 2.4))
    model.add(ground, "IfcWall", (6, 0.2, 9, 0.4), z=2.4, height=0.4)
    model.add(ground, "IfcFurnishingElement", (7, 1, 8, 2), height=0.8)
    model.add(ground, "IfcSpace", (0.2, 0.2, 4.9, 5.8), Name="101", LongName="Büro")
    model.add(ground, "IfcSpace", (5.1, 0.2, 9.9, 5.8), Name="102")
    model.add(first, "IfcWall", (0, 0, 7, 0.2))
    return model


def written(folder: Path, model: Model) -> Path:
    model.file.write(str(folder / "plan.ifc"))
    return folder / "plan.ifc"


def read(path: Path, **source: object) -> PlanDrawing:
    return read_drawing(path, PlanSource.model_validate({"file": path.name, **source}))


def walkable(path: Path, level: str) -> WalkableArea:
    area = polygon_area(floor_plan(floor_with(path, {"level": level})), WalkableSettings(cell_m=0.05))
    assert area is not None
    return area


@pytest.mark.parametrize("schema", ["IFC4", "IFC2X3"])
def test_a_storey(tmp_path: Path, schema: str) -> None:
    path = written(tmp_path, two_storeys(schema))
    drawing = read(path, level="Erdgeschoss")
    assert drawing.bounds == pytest.approx((0, 12, 0, 6), abs=1e-3)
    assert drawing.levels == ("Erdgeschoss", "Obergeschoss")
    assert [text.text for text in drawing.texts] == ["101 Büro", "102"]
    (door,) = drawing.passages
    assert np.sort(door, axis=0) == pytest.approx(np.array([(5.0, 1.0), (5.0, 1.9)]), abs=1e-3)
    assert sorted(drawing.taken, key=lambda part: (part.name, part.became)) == [
        TakenPart("IfcColumn", Became.OBSTACLES, 1),
        TakenPart("IfcDoor", Became.OPENINGS, 1),
        TakenPart("IfcFurnishingElement", Became.LEFT_OUT, 1, "furniture"),
        TakenPart("IfcOpeningElement", Became.OPENINGS, 1),
        TakenPart("IfcSpace", Became.WALKABLE, 2),
        TakenPart("IfcWall", Became.LEFT_OUT, 1, "not at 1 m above the floor"),
        TakenPart("IfcWall", Became.WALLS, 6),
        TakenPart("IfcWindow", Became.WALLS, 1),
        TakenPart("shafts and voids", Became.OBSTACLES, 1, "neither a space nor a door"),
    ]


def test_its_walkable_area(tmp_path: Path) -> None:
    area = walkable(written(tmp_path, two_storeys()), "0")
    spaces = (4.7 + 4.8) * 5.6 - 0.4 * 0.4 + 0.2 * (0.9 + 1.0)
    assert area.mask.sum() * area.cell_m**2 == pytest.approx(spaces, rel=0.01)
    doors = [bool(area.mask[round(y / 0.05), 94:106].all()) for y in (1.5, 2.5, 3.5, 5.0)]
    assert doors == [True, False, True, False]


def test_a_storey_must_be_chosen(tmp_path: Path) -> None:
    path = written(tmp_path, two_storeys())
    with pytest.raises(OSError, match="has the levels Erdgeschoss, Obergeschoss: choose one"):
        read(path)
    with pytest.raises(OSError, match="has no level Keller; there are: Erdgeschoss, Obergeschoss"):
        read(path, level="Keller")


@pytest.mark.parametrize("level", ["1", "OBERGESCHOSS"])
def test_a_storey_that_its_walls_do_not_enclose(tmp_path: Path, level: str) -> None:
    drawing = read(written(tmp_path, two_storeys()), level=level)
    assert drawing.bounds == pytest.approx((0, 7, 0, 0.2), abs=1e-3)
    assert drawing.notes[0].startswith("the walls do not enclose the storey")


def test_curtain_walls_are_of_their_parts(tmp_path: Path) -> None:
    model = Model()
    storey = model.storey("EG", 0)
    curtain = model.entity("IfcCurtainWall", ObjectPlacement=model.local(0, 0, 0, storey))
    model.entity("IfcRelContainedInSpatialStructure", RelatedElements=[curtain], RelatingStructure=storey)
    plates = [model.add(storey, "IfcPlate", (x, 0, x + 3, 0.1)) for x in (0, 3)]
    model.part(curtain, *plates)
    model.add(storey, "IfcPlate", (0, 5, 3, 5.1))
    model.add(storey, "IfcWall", (0, 4, 6, 4.2))
    assert set(read(written(tmp_path, model)).taken) == {
        TakenPart("IfcCurtainWall", Became.WALLS, 2),
        TakenPart("IfcPlate", Became.LEFT_OUT, 1, "no part of walls"),
        TakenPart("IfcWall", Became.WALLS, 1),
    }


def test_walls_without_geometry_are_noted(tmp_path: Path) -> None:
    model = two_storeys()
    model.file.by_type("IfcWall")[4].Representation = None
    drawing = read(written(tmp_path, model), level="0")
    assert TakenPart("IfcWall", Became.LEFT_OUT, 1, "no geometry") in drawing.taken
    assert drawing.notes[0].startswith("1 walls, windows or columns have no geometry")


def test_classes_are_ignored_as_asked(tmp_path: Path) -> None:
    drawing = read(written(tmp_path, two_storeys()), level="0", ignore=["ifccol*", "IfcSpace"])
    assert TakenPart("IfcColumn", Became.LEFT_OUT, 1, "ignored as asked") in drawing.taken
    assert not drawing.texts
    assert len([each for each in drawing.polygons if each.use is Use.OBSTACLE]) == 1


def test_a_georeference_is_noted(tmp_path: Path) -> None:
    model = two_storeys()
    new = model.file.create_entity
    model.building.ObjectPlacement = model.local(10, 0, 0, None)
    system = new("IfcProjectedCRS", "EPSG:25832")
    new("IfcMapConversion", model.context, system, 1000.0, 2000.0, 0.0, 0.0, 1.0)
    note = read(written(tmp_path, model), level="0").notes[0]
    assert "--georeference EPSG:25832,1000.000,2010.000,90.0000" in note


@pytest.mark.parametrize(
    ("text", "message"), [("", "cannot be read as IFC"), ("ISO-10303-21;\nHEADER;", "cannot be read as IFC")]
)
def test_other_files(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "plan.ifc").write_text(text)
    with pytest.raises(OSError, match=message):
        read(tmp_path / "plan.ifc")


def test_nothing_to_draw(tmp_path: Path) -> None:
    model = Model()
    model.storey("EG", 0)
    with pytest.raises(OSError, match="has no walls or spaces with geometry on the storey EG"):
        read(written(tmp_path, model))
