"""One office floor, 40 m x 16 m with a corridor and ten rooms, as a hand-drawn SVG, a framed PDF and a DXF."""

from __future__ import annotations

from pathlib import Path

from ezdxf.document import Drawing
from reportlab.pdfgen.canvas import Canvas

WIDTH_M, HEIGHT_M = 40.0, 16.0
_LOW_M, _HIGH_M, _ROOM_M, _DOOR_M = 7.0, 9.0, 8.0, 1.0
Segment = tuple[float, float, float, float]


def walls() -> list[Segment]:
    """Lines x0, y0, x1, y1 in metres; doors are gaps."""
    found: list[Segment] = [
        (0, 0, WIDTH_M, 0),
        (WIDTH_M, 0, WIDTH_M, HEIGHT_M),
        (WIDTH_M, HEIGHT_M, 0, HEIGHT_M),
        (0, HEIGHT_M, 0, 0),
    ]
    for number in range(5):
        left = number * _ROOM_M
        door = left + 3.0
        for y in (_LOW_M, _HIGH_M):
            found += [(left, y, door, y), (door + _DOOR_M, y, left + _ROOM_M, y)]
        if number:
            found += [(left, 0, left, _LOW_M), (left, _HIGH_M, left, HEIGHT_M)]
    return found


def room_names() -> dict[str, tuple[float, float]]:
    """Where the name of each room stands, metres: 0.01 to 0.05 below the corridor, 0.06 to 0.10 above."""
    places = [(_ROOM_M * number + 2.0, y) for y in (3.0, 12.0) for number in range(5)]
    return {f"0.{number:02d}": place for number, place in enumerate(places, start=1)}


def draw(folder: Path) -> None:
    """Write ground.svg (1:100 in mm), first.pdf (A3 with frame and title block, 1:200) and second.dxf (mm)."""
    lines = "".join(
        f'<path d="M{10 * x0 + 5:g} {165 - 10 * y0:g}L{10 * x1 + 5:g} {165 - 10 * y1:g}" stroke="black"/>'
        for x0, y0, x1, y1 in walls()
    )
    names = "".join(
        f'<g transform="translate({10 * x + 5:g} {165 - 10 * y:g})"><text x="0" y="0"><tspan>{name}</tspan></text></g>'
        for name, (x, y) in room_names().items()
    )
    (folder / "ground.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="410mm" height="170mm" viewBox="0 0 410 170" '
        f'stroke-width="1.5">{lines}{names}</svg>'
    )
    canvas = Canvas(str(folder / "first.pdf"), pagesize=(1190.55, 841.89), invariant=1)
    canvas.rect(57, 28, 1105, 785)
    canvas.rect(860, 28, 302, 120)
    canvas.drawString(870, 100, "First floor, 1:200, checked")
    canvas.setLineWidth(2)
    per_m = 72 / 0.0254 / 200
    for x0, y0, x1, y1 in walls():
        canvas.line(200 + x0 * per_m, 400 + y0 * per_m, 200 + x1 * per_m, 400 + y1 * per_m)
    canvas.setFont("Helvetica", 8)
    for name, (x, y) in room_names().items():
        canvas.drawString(200 + x * per_m, 400 + y * per_m, name)
    canvas.save()
    document = Drawing.new()
    document.header["$INSUNITS"] = 4
    for x0, y0, x1, y1 in walls():
        document.modelspace().add_line((1000 * x0, 1000 * y0), (1000 * x1, 1000 * y1), dxfattribs={"layer": "WALLS"})
    for name, (x, y) in room_names().items():
        document.modelspace().add_text(name, height=300, dxfattribs={"layer": "TEXT", "insert": (1000 * x, 1000 * y)})
    document.saveas(folder / "second.dxf")
