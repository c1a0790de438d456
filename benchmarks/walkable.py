"""How well walkable space is found: on drawn plans of generated floors, and on the mall's.

docs/results/walkable.md tells more.

    python benchmarks/walkable.py generated [--seeds 2]
    python benchmarks/walkable.py mall FOLDER

FOLDER is the floor's folder of the unpacked ``site2-F4.tar.xz`` (floor_info.json, floor_image.png, geojson_map.json).
"""

from __future__ import annotations

import argparse
import io
from dataclasses import dataclass, replace
from pathlib import Path

import networkx as nx
import numpy as np
import shapely
from PIL import Image, ImageDraw, ImageFont
from scipy.spatial import KDTree

from vislam2tag.core.arrays import BoolArray, FloatArray, IntArray
from vislam2tag.simulation.building.ground_plan import (
    DOOR_M,
    GroundPlan,
    dead_end_inset,
    make_ground_plan,
    walkable_graph,
)
from vislam2tag.simulation.settings import BuildingSettings, stream
from vislam2tag.survey.model import ControlPoints, Floor
from vislam2tag.survey.plans.load import floor_plan
from vislam2tag.survey.plans.model import FloorPlan
from vislam2tag.survey.plans.source import Extent, PlanSource
from vislam2tag.walkable.graph import CorridorGraph, NodeKind, corridor_graph
from vislam2tag.walkable.plan_cells import cells_in
from vislam2tag.walkable.settings import WalkableSettings
from vislam2tag.walkable.space import WalkableSpace, walkable_space

BUILDING = BuildingSettings()
MARGIN_M = 1.0
CORNERS = (NodeKind.TURN, NodeKind.JUNCTION, NodeKind.DEAD_END)
Colour = tuple[int, int, int]


@dataclass(frozen=True)
class Style:
    """How a plan is drawn."""

    name: str
    per_m: float = 40.0
    wall_m: float = 0.12
    line_m: float = 0.03
    ink: Colour = (40, 40, 40)
    paper: Colour = (255, 255, 255)
    room: Colour | None = None
    quality: int | None = None
    hollow: bool = False


STYLES = (
    Style("20 pixels/m", per_m=20),
    Style("40 pixels/m"),
    Style("80 pixels/m", per_m=80),
    Style("JPEG, quality 30", quality=30),
    Style("grey on grey, JPEG", ink=(150, 150, 150), paper=(235, 235, 235), quality=60),
    Style("red walls, yellow rooms", ink=(200, 30, 30), room=(255, 230, 180)),
    Style("blue rooms", ink=(0, 0, 0), room=(120, 180, 240)),
    Style("white on black", ink=(255, 255, 255), paper=(0, 0, 0)),
    Style("walls of 0.3 m", wall_m=0.3),
    Style("walls as thin as swings", wall_m=0.05, line_m=0.05),
    Style("hollow walls", per_m=80, wall_m=0.25, hollow=True),
)


def drawn(layout: GroundPlan, style: Style) -> FloorPlan:
    """A plan with walls, doors with swing and leaf, room numbers and a table in each room."""
    width, height = BUILDING.width_m + 2 * MARGIN_M, BUILDING.height_m + 2 * MARGIN_M
    image = Image.new("RGB", (round(width * style.per_m), round(height * style.per_m)), style.paper)
    canvas = ImageDraw.Draw(image)
    for room in layout.rooms if style.room else ():
        corners = [_pixel(np.array(corner), style) for corner in (room.rect[:2], room.rect[2:])]
        (x0, y0), (x1, y1) = corners
        canvas.rectangle((x0, y1, x1, y0), fill=style.room)
    for start, stop in layout.walls:
        _wall(canvas, start, stop, style)
    thin = max(1, round(style.line_m * style.per_m))
    font = ImageFont.load_default(size=0.55 * style.per_m)
    for number, room in enumerate(layout.rooms):
        _door(canvas, np.array(room.door), np.array(room.inward), thin, style)
        x, y = (room.rect[0] + room.rect[2]) / 2, (room.rect[1] + room.rect[3]) / 2
        canvas.text(_pixel(np.array((x - 0.8, y + 0.3)), style), f"R{number:03d}", fill=style.ink, font=font)
        left, top = _pixel(np.array((x + 0.7, y - 0.5)), style)
        canvas.rectangle((left, top, left + 0.8 * style.per_m, top + 0.6 * style.per_m), outline=style.ink, width=thin)
    if style.quality is not None:
        buffer = io.BytesIO()
        image.save(buffer, "JPEG", quality=style.quality)
        image = Image.open(buffer).convert("RGB")
    extent = (-MARGIN_M, BUILDING.width_m + MARGIN_M, -MARGIN_M, BUILDING.height_m + MARGIN_M)
    return FloorPlan(extent, np.asarray(image))


def _pixel(point: FloatArray, style: Style) -> tuple[float, float]:
    return (float(point[0]) + MARGIN_M) * style.per_m, (BUILDING.height_m + MARGIN_M - float(point[1])) * style.per_m


def _wall(canvas: ImageDraw.ImageDraw, start: FloatArray, stop: FloatArray, style: Style) -> None:
    if not style.hollow:
        width = max(1, round(style.wall_m * style.per_m))
        canvas.line((*_pixel(start, style), *_pixel(stop, style)), fill=style.ink, width=width)
        return
    outline = shapely.LineString((start, stop)).buffer(style.wall_m / 2, cap_style="flat").exterior.coords
    thin = max(1, round(style.line_m * style.per_m))
    canvas.line([_pixel(np.array(corner), style) for corner in outline], fill=style.ink, width=thin)


def _door(canvas: ImageDraw.ImageDraw, middle: FloatArray, inward: FloatArray, thin: int, style: Style) -> None:
    along = inward[::-1]
    hinge = middle - along * DOOR_M / 2
    angles = np.linspace(0, np.pi / 2, 30)[:, None]
    swing = hinge + DOOR_M * (np.cos(angles) * along + np.sin(angles) * inward)
    canvas.line([_pixel(point, style) for point in swing], fill=style.ink, width=thin)
    canvas.line((*_pixel(hinge, style), *_pixel(swing[-1], style)), fill=style.ink, width=thin)


def true_cells(layout: GroundPlan, style: Style, space: WalkableSpace) -> BoolArray:
    """Cells of the floor that are free of walls."""
    lines = shapely.linestrings(layout.walls)
    walls = shapely.union_all(shapely.buffer(lines, style.wall_m / 2, cap_style="square"))
    whole = shapely.box(0, 0, BUILDING.width_m, BUILDING.height_m)
    return cells_in(shapely.difference(whole, walls), space.area.grid)


def length_ratios(graph: CorridorGraph, nodes: FloatArray, edges: IntArray) -> FloatArray:
    """Walkable lengths between turns, junctions and dead ends, over those of the true graph."""
    true = _joined(edges, np.linalg.norm(nodes[edges[:, 0]] - nodes[edges[:, 1]], axis=1))
    found = _joined(graph.edges, graph.length_m)
    corners = [node for node, kind in enumerate(graph.kinds) if kind in CORNERS]
    found_at = [np.asarray(part) for part in KDTree(nodes).query(graph.nodes[corners])]
    pairs = [(node, int(near)) for node, away, near in zip(corners, *found_at, strict=True) if away < 0.6]
    ratios = []
    for node, near in pairs:
        here = nx.single_source_dijkstra_path_length(found, node)
        there = nx.single_source_dijkstra_path_length(true, near)
        ratios += [here[other] / there[its] for other, its in pairs if there[its] > 8]
    return np.array(ratios)


def _joined(edges: IntArray, length_m: FloatArray) -> nx.Graph:
    graph = nx.Graph()
    for (one, other), length in sorted(zip(edges.tolist(), length_m.tolist(), strict=True), key=lambda edge: -edge[1]):
        graph.add_edge(one, other, weight=length)
    return graph


def generated(seeds: int) -> None:
    """Print one row for each style, the mean over some floors."""
    print("| plan | IoU | true nodes inside | rooms told | lengths: median, 5 to 95 % | closed off |")
    print("| --- | ---: | ---: | ---: | ---: | ---: |")
    for style in STYLES:
        rows, ratios = [], []
        for seed in range(seeds):
            layout = make_ground_plan(BUILDING, stream(seed, "floor", 0))
            nodes, edges = walkable_graph(replace(layout, corridors=dead_end_inset(layout.corridors, BUILDING.width_m)))
            space = walkable_space(drawn(layout, style))
            true = true_cells(layout, style, space)
            found = space.area.mask
            graph = corridor_graph(space)
            centres = shapely.multipoints(graph.nodes[graph.rooms])
            rooms = np.mean([shapely.intersects(shapely.box(*room.rect), centres) for room in layout.rooms])
            overlap = (true & found).sum() / (true | found).sum()
            rows.append((overlap, space.inside(nodes).mean(), rooms, sum(each.count for each in space.findings)))
            ratios.append(length_ratios(graph, nodes, edges))
        overlap, inside, rooms, closed = np.mean(rows, axis=0)
        low, middle, high = np.percentile(np.concatenate(ratios), (5, 50, 95))
        print(
            f"| {style.name} | {overlap:.3f} | {inside:.1%} | {rooms:.0%} | {middle:.3f}, {low:.3f} to {high:.3f} | "
            f"{closed:g} |"
        )


def mall(folder: Path) -> None:
    """Print how the mall's image compares with its polygons."""
    info = Extent.model_validate({"width_m": 236.71181213998395, "height_m": 219.74676479990106})
    nowhere = ControlPoints((), np.empty((0, 2)))
    vector = Floor(
        3, "F4", info.width_m, info.height_m, None, folder / "geojson_map.json", nowhere,
        source=PlanSource(file="geojson_map.json", extent=info),
    )  # fmt: skip
    image = replace(vector, plan=folder / "floor_image.png", source=PlanSource(file="floor_image.png", extent=info))
    true = walkable_space(floor_plan(vector))
    print("| mall | area | IoU | IoU, but for 0.5 m along walls | connected share of the polygons' ways |")
    print("| --- | ---: | ---: | ---: | ---: |")
    ways = corridor_graph(true)
    inner = true.clearance_m > 0.5
    for name, contrast in (("image", None), ("image, wall contrast 0.08", 0.08)):
        space = walkable_space(floor_plan(image), WalkableSettings(wall_contrast=contrast))
        found = space.area.mask
        overlap = (true.area.mask & found).sum() / (true.area.mask | found).sum()
        off_walls = ~true.area.mask & (space.clearance_m > 0.5)
        core = (inner & found).sum() / (inner.sum() + off_walls.sum())
        points = np.vstack([line for line, short in zip(ways.polylines, ways.shortcut, strict=True) if not short])
        area = found.sum() * space.area.cell_m**2
        print(f"| {name} | {area:.0f} m² | {overlap:.3f} | {core:.3f} | {space.inside(points).mean():.1%} |")


def main() -> None:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=("generated", "mall"))
    parser.add_argument("folder", nargs="?", type=Path)
    parser.add_argument("--seeds", type=int, default=2)
    arguments = parser.parse_args()
    if arguments.what == "mall":
        mall(arguments.folder)
    else:
        generated(arguments.seeds)


if __name__ == "__main__":
    main()
