"""A small floor that is known exactly: a corridor, three rooms with doors above it, a hall below it."""

from __future__ import annotations

import numpy as np
import shapely
from PIL import Image, ImageDraw

from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.site.plans.source import FloorPlan
from vislam2tag.site.walkable.space import WalkableSpace, wall_segments

WIDTH_M, HEIGHT_M = 24.0, 20.0
CORRIDOR = (10.0, 12.2)
"""Lower and upper wall."""
DOORS_X = (4.0, 12.0, 20.0)
"""Middles of the rooms' doors, 1 m wide; the hall's gate is 3 m wide, in the middle."""
MARGIN_M = 1.0
WALL_M = 0.2
Colour = tuple[int, int, int]


def walls(*, gate: bool = True, doors: bool = True) -> FloatArray:
    low, high = CORRIDOR
    corners = [(0.0, 0.0), (WIDTH_M, 0.0), (WIDTH_M, HEIGHT_M), (0.0, HEIGHT_M)]
    lines = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    lines += [((x, high), (x, HEIGHT_M)) for x in (8.0, 16.0)]
    lines += _broken(high, [(x - 0.5, x + 0.5) for x in DOORS_X] if doors else [])
    lines += _broken(low, [(10.5, 13.5)] if gate else [])
    return np.array(lines, dtype=np.float64)


def _broken(y: float, gaps: list[tuple[float, float]]) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    marks = [0.0, *(end for gap in gaps for end in gap), WIDTH_M]
    return [((marks[i], y), (marks[i + 1], y)) for i in range(0, len(marks), 2)]


def truth(points: FloatArray) -> BoolArray:
    """Whether points are on the floor: inside, and in no wall."""
    lines = shapely.union_all([shapely.LineString(line).buffer(WALL_M / 2, cap_style="square") for line in walls()])
    inside = shapely.box(0, 0, WIDTH_M, HEIGHT_M)
    return np.asarray(shapely.contains_xy(shapely.difference(inside, lines), points[:, 0], points[:, 1]))


def plan(
    per_m: float = 20.0,
    ink: Colour = (40, 40, 40),
    paper: Colour = (255, 255, 255),
    lines: FloatArray | None = None,
    thickness_m: float = WALL_M,
) -> FloorPlan:
    """The floor's plan as an image with a margin."""
    image, canvas = blank(per_m, paper)
    for start, stop in walls() if lines is None else lines:
        canvas.line((*pixel(start, per_m), *pixel(stop, per_m)), fill=ink, width=max(1, round(thickness_m * per_m)))
    return as_plan(image)


def blank(per_m: float, paper: Colour = (255, 255, 255)) -> tuple[Image.Image, ImageDraw.ImageDraw]:
    size = (round((WIDTH_M + 2 * MARGIN_M) * per_m), round((HEIGHT_M + 2 * MARGIN_M) * per_m))
    image = Image.new("RGB", size, paper)
    return image, ImageDraw.Draw(image)


def pixel(point: FloatArray, per_m: float) -> tuple[float, float]:
    return (float(point[0]) + MARGIN_M) * per_m, (HEIGHT_M + MARGIN_M - float(point[1])) * per_m


def as_plan(image: Image.Image) -> FloorPlan:
    extent = (-MARGIN_M, WIDTH_M + MARGIN_M, -MARGIN_M, HEIGHT_M + MARGIN_M)
    return FloorPlan(extent, np.asarray(image.convert("RGB")))


def agreement(space: WalkableSpace) -> float:
    """Intersection over union of a space and the true floor."""
    area = space.area
    true = truth(area.grid.centres_m(np.argwhere(np.ones(area.mask.shape)))).reshape(area.mask.shape)
    return float((true & area.mask).sum() / (true | area.mask).sum())


def space_of(mask: BoolArray, cell_m: float = 0.1) -> WalkableSpace:
    """A space from cells, its lower left corner at the origin."""
    area = WalkableArea(mask, (0.0, 0.0), cell_m)
    return WalkableSpace(area, wall_segments(area))


def rectangles(width_m: float, height_m: float, *boxes: tuple[float, float, float, float]) -> WalkableSpace:
    """A space that is the union of boxes (x0, y0, x1, y1), metres, in cells of 10 cm."""
    mask = np.zeros((round(height_m * 10), round(width_m * 10)), dtype=np.bool_)
    for x0, y0, x1, y1 in boxes:
        mask[round(y0 * 10) : round(y1 * 10), round(x0 * 10) : round(x1 * 10)] = True
    return space_of(mask)
