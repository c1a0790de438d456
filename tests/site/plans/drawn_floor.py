"""One small floor, 20 m x 10 m with a wall at x = 5 from y = 0 to 6, written in every format."""

from __future__ import annotations

import io
import itertools
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from ezdxf.document import Drawing
from PIL import Image, ImageDraw
from reportlab.pdfgen.canvas import Canvas

from vislam2tag.site.georeference import Georeference, to_wgs84
from vislam2tag.site.model import ControlPoints, Floor
from vislam2tag.site.plans.source import FloorPlan, PlanSource

WIDTH_M, HEIGHT_M = 20.0, 10.0
LINES = (((0, 0), (20, 0), (20, 10), (0, 10), (0, 0)), ((5, 0), (5, 6)))
HERE = Georeference(latitude_deg=50.78, longitude_deg=6.06, bearing_deg=25.0)
POINTS_PER_M = 72 / 0.0254
EXTENT = {"width_m": WIDTH_M, "height_m": HEIGHT_M}


def floor_with(plan: Path, source: Mapping[str, object], georeference: Georeference | None = None) -> Floor:
    points = ControlPoints((), np.empty((0, 2)))
    known = PlanSource.model_validate({"file": plan.name, **source})
    return Floor(1, "One", None, None, None, plan, points, source=known, georeference=georeference)


def png(folder: Path, pixels_per_m: float = 10.0, name: str = "plan.png") -> Path:
    image = Image.new("RGB", (round(WIDTH_M * pixels_per_m), round(HEIGHT_M * pixels_per_m)), "white")
    canvas = ImageDraw.Draw(image)
    for line in LINES:
        canvas.line([(x * pixels_per_m, (HEIGHT_M - y) * pixels_per_m) for x, y in line], fill="black", width=3)
    image.save(folder / name)
    return folder / name


def svg(folder: Path, size: str = "") -> Path:
    """At 4 units a metre; ``size``: further attributes."""
    paths = "".join(
        f'<polyline points="{" ".join(f"{x * 4},{(HEIGHT_M - y) * 4}" for x, y in line)}" fill="none" stroke="black"/>'
        for line in LINES
    )
    text = f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 80 40">{paths}</svg>'
    (folder / "plan.svg").write_text(text)
    return folder / "plan.svg"


def pdf(folder: Path) -> Path:
    """Page 2 shows the floor at 20 points a metre."""
    buffer = io.BytesIO()
    canvas = Canvas(buffer, pagesize=(WIDTH_M * 20, HEIGHT_M * 20), invariant=1)
    canvas.showPage()
    canvas.setLineWidth(4)
    for line in LINES:
        for (x0, y0), (x1, y1) in itertools.pairwise(line):
            canvas.line(x0 * 20, y0 * 20, x1 * 20, y1 * 20)
    canvas.showPage()
    canvas.save()
    (folder / "plan.pdf").write_bytes(buffer.getvalue())
    return folder / "plan.pdf"


def framed_pdf(folder: Path) -> Path:
    """An A3 with frame and title block, and the floor at 1:100 with its lower left corner at (120, 300) points."""
    canvas = Canvas(str(folder / "framed.pdf"), pagesize=(1190.55, 841.89), invariant=1)
    canvas.rect(57, 28, 1105, 785)
    canvas.rect(57, 28, 1105, 785)
    canvas.rect(760, 28, 402, 160)
    for row in range(5):
        canvas.line(760, 60 + 30 * row, 1162, 60 + 30 * row)
        canvas.drawString(770, 66 + 24 * row, "Ground floor, checked, date, scale 1:100")
    canvas.setLineWidth(4)
    for line in LINES:
        for ends in itertools.pairwise(line):
            (x0, y0), (x1, y1) = ((120 + x * 0.01 * POINTS_PER_M, 300 + y * 0.01 * POINTS_PER_M) for x, y in ends)
            canvas.line(x0, y0, x1, y1)
    canvas.save()
    return folder / "framed.pdf"


def dxf(folder: Path, units: int = 4) -> Path:
    """In millimetres (``units`` 4), with a door in a block and a dimension far outside."""
    document = Drawing.new()
    document.header["$INSUNITS"] = units
    space = document.modelspace()
    for line in LINES:
        space.add_lwpolyline([(x * 1000, y * 1000) for x, y in line], dxfattribs={"layer": "A-WALL"})
    block = document.blocks.new("DOOR-90")
    block.add_line((0, 0), (900, 0))
    block.add_arc((0, 0), 900, 0, 90)
    space.add_blockref("DOOR-90", (5000, 6000), dxfattribs={"layer": "A-WALL"})
    space.add_line((-9000, -9000), (-9000, 50_000), dxfattribs={"layer": "A-DIM"})
    document.saveas(folder / "plan.dxf")
    return folder / "plan.dxf"


def lonlat(points: object) -> list[list[float]]:
    found: list[list[float]] = to_wgs84(np.array(points, dtype=np.float64), HERE).tolist()
    return found


def collection(*features: dict[str, object]) -> str:
    return json.dumps({"type": "FeatureCollection", "features": features})


def feature(kind: str, coordinates: object, **properties: object) -> dict[str, object]:
    return {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": coordinates}}


def geojson(folder: Path) -> Path:
    outline = feature("Polygon", [lonlat(LINES[0])], use="outline")
    wall = feature("LineString", lonlat(LINES[1]), use="wall")
    (folder / "plan.geojson").write_text(collection(outline, wall))
    return folder / "plan.geojson"


def imdf(folder: Path, *, archive: bool = False) -> Path:
    """Two levels; on level 0 a thin column stands where the wall is, and an opening leads through the outline."""
    column = [(4.9, 0), (5.1, 0), (5.1, 6), (4.9, 6), (4.9, 0)]
    level = {"id": "L0", **feature("Polygon", [lonlat(LINES[0])], short_name={"en": "G"}, ordinal=0)}
    other = {"id": "L1", **feature("Polygon", [lonlat(LINES[0])], short_name={"en": "1"}, ordinal=1)}
    files = {
        "level.geojson": collection(level, other),
        "unit.geojson": collection(
            feature("Polygon", [lonlat(column)], level_id="L0", category="column"),
            feature("Polygon", [lonlat(LINES[0])], level_id="L0", category="walkway", name={"en": "Hall"}),
            feature("Polygon", [lonlat(LINES[0])], level_id="L1", category="opentobelow"),
        ),
        "opening.geojson": collection(feature("LineString", lonlat([(20, 7), (20, 9)]), level_id="L0")),
    }
    if archive:
        with zipfile.ZipFile(folder / "venue.zip", "w") as packed:
            for name, text in files.items():
                packed.writestr(f"venue/{name}", text)
        return folder / "venue.zip"
    (folder / "venue").mkdir()
    for name, text in files.items():
        (folder / "venue" / name).write_text(text)
    return folder / "venue"


def is_dark(plan: FloorPlan, x: float, y: float) -> bool:
    """Whether something dark is within 0.15 m of a point of the BCS."""
    left, _, _, high = plan.extent_m
    across, up = plan.pixel_m
    columns = slice(max(0, round((x - 0.15 - left) / across)), round((x + 0.15 - left) / across) + 1)
    rows = slice(max(0, round((high - y - 0.15) / up)), round((high - y + 0.15) / up) + 1)
    return bool(plan.image[rows, columns].size and plan.image[rows, columns].min() < 110)
