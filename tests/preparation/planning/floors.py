"""Small floors to plan on."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.preparation.planning.corridors import Corridors
from vislam2tag.preparation.planning.floor import FloorConstraints
from vislam2tag.preparation.planning.sheet_places import Stations
from vislam2tag.site.walkable.graph import CorridorGraph, NodeKind
from vislam2tag.site.walkable.space import WalkableSpace

CELL_M = 0.1
OUTER = (0.0, 0.0, 30.0, 16.0)
INNER = (2.0, 2.0, 28.0, 14.0)


def graph_of(
    nodes: Sequence[tuple[float, float]],
    edges: Sequence[tuple[int, int]],
    kinds: Sequence[NodeKind] | None = None,
    in_room: Sequence[bool] | None = None,
) -> CorridorGraph:
    """Straight edges between nodes; junctions unless their kinds are given."""
    places = np.array(nodes, dtype=np.float64).reshape(-1, 2)
    lines = tuple(places[[a, b]] for a, b in edges)
    return CorridorGraph(
        nodes=places,
        kinds=tuple(kinds or [NodeKind.JUNCTION] * len(places)),
        width_m=np.full(len(places), 2.0),
        edges=np.array(edges, dtype=np.int64).reshape(-1, 2),
        polylines=lines,
        length_m=np.array([np.linalg.norm(line[1] - line[0]) for line in lines]),
        in_room=np.array(in_room if in_room is not None else [False] * len(edges), dtype=np.bool_),
        shortcut=np.zeros(len(edges), dtype=np.bool_),
    )


def ways_with(lengths: Sequence[int], joined: Sequence[tuple[int, int]], ends: int) -> Corridors:
    """Ways of whole metres, wherever they lie: only how they hang together counts."""
    lines = tuple(np.array([(0.0, 10.0 * i), (float(length), 10.0 * i)]) for i, length in enumerate(lengths))
    return Corridors(
        ends=np.zeros((ends, 2)),
        is_open=np.zeros(ends, dtype=np.bool_),
        joined=np.array(joined, dtype=np.int64).reshape(-1, 2),
        lines=lines,
        doors=np.empty((0, 2)),
    )


def stations_each_metre(ways: Corridors) -> Stations:
    """A station in the middle of each metre of the ways."""
    lengths = ways.length_m.round().astype(int).tolist()
    way = np.repeat(np.arange(len(lengths)), lengths)
    offset = np.concatenate([np.arange(length) + 0.5 for length in lengths])
    points = np.vstack([ways.place(i, np.arange(length) + 0.5) for i, length in enumerate(lengths)])
    return Stations(way.astype(np.int64), offset, points)


def rectangle(x0: float, y0: float, x1: float, y1: float) -> FloatArray:
    """Four walls (4, 2, 2) with the free space inside."""
    corners = np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1)])
    return np.stack((corners, np.roll(corners, -1, axis=0)), axis=1)


def ring() -> tuple[WalkableSpace, CorridorGraph]:
    """A corridor 2 m wide around a block of 26 x 12 m."""
    rows, columns = round(OUTER[3] / CELL_M), round(OUTER[2] / CELL_M)
    mask = np.ones((rows, columns), dtype=np.bool_)
    x0, y0, x1, y1 = (round(value / CELL_M) for value in INNER)
    mask[y0:y1, x0:x1] = False
    walls = np.vstack((rectangle(*OUTER), rectangle(*INNER)[:, ::-1]))
    space = WalkableSpace(WalkableArea(mask, (0.0, 0.0), CELL_M), walls)
    corners = [(1.0, 1.0), (29.0, 1.0), (29.0, 15.0), (1.0, 15.0)]
    return space, graph_of(corners, [(0, 1), (1, 2), (2, 3), (3, 0)], [NodeKind.TURN] * 4)


def nothing_given() -> FloorConstraints:
    return FloorConstraints(np.empty((0, 2)), (), np.empty((0, 4)))


def write_ring_site(root: Path, floors: Sequence[int] = (1,)) -> Path:
    """A site in the published layout whose plans show the ring."""
    for number in floors:
        folder = root / f"floor_{number}"
        folder.mkdir(parents=True)
        image = Image.new("RGB", (600, 320), "white")
        draw = ImageDraw.Draw(image)
        draw.rectangle((0, 0, 599, 319), outline="black", width=3)
        # Closed rooms, each smaller than the corridor around them.
        x0, y0, x1, y1 = (int(20 * value) for value in INNER)
        for left in range(x0, x1, (x1 - x0) // 4):
            draw.rectangle((left, y0, left + (x1 - x0) // 4, y1), outline="black", width=3)
        image.save(folder / "floorplan.png")
    rows = [f"{number},30,16" for number in floors]
    (root / "floor_dimensions.csv").write_text("\n".join(("id,width,height", *rows)) + "\n")
    return root
