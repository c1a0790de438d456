"""DXF drawings of a small floor: four rooms of 5 m x 10 m, whose walls have gaps of 2 m."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from ezdxf.document import Drawing

from vislam2tag.site.plan_formats.dxf import read_dxf
from vislam2tag.site.plans.drawing import PlanDrawing
from vislam2tag.site.plans.source import PlanSource

WALLS = 4 + 6
"""Segments of the floor."""
Build = Callable[[Any, Any], object]


def add_floor(space: Any, left: float = 0.0, low: float = 0.0, layer: str = "Wände", scale: float = 1.0) -> None:
    def at(*places: tuple[float, float]) -> list[tuple[float, float]]:
        return [((left + x) * scale, (low + y) * scale) for x, y in places]

    space.add_lwpolyline(at((0, 0), (20, 0), (20, 10), (0, 10)), close=True, dxfattribs={"layer": layer})
    for x in (5, 10, 15):
        for ends in (at((x, 0), (x, 4)), at((x, 6), (x, 10))):
            space.add_line(*ends, dxfattribs={"layer": layer})


def written(folder: Path, build: Build, fmt: str = "asc") -> Path:
    """Write what ``build`` adds to a document and its model space, in metres."""
    document = Drawing.new("R2010")
    document.header["$INSUNITS"] = 6
    document.header["$MEASUREMENT"] = 1
    build(document, document.modelspace())
    document.saveas(folder / "plan.dxf", fmt=fmt)
    return folder / "plan.dxf"


def read(folder: Path, build: Build, **source: object) -> PlanDrawing:
    path = written(folder, build)
    return read_dxf(path, PlanSource.model_validate({"file": path.name, **source}))


def parts(drawing: PlanDrawing) -> set[tuple[str, str, int, str]]:
    return {(part.name, part.became.value, part.count, part.why) for part in drawing.taken}
