"""Where a floor can be walked, and the graph of its corridors, over its plan."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from vislam2tag.figures.panels import aspect_of, draw_plan, extent_around, in_metres, legend_below, panel_grid, show
from vislam2tag.figures.style import PAGE_IN, QUIET, print_quality
from vislam2tag.site.model import Floor
from vislam2tag.site.walkable.graph import CorridorGraph, NodeKind
from vislam2tag.site.walkable.space import WalkableSpace

_COLOURS = {
    NodeKind.JUNCTION: "#d55e00",
    NodeKind.TURN: "#0072b2",
    NodeKind.DEAD_END: "#cc79a7",
    NodeKind.STRAIGHT: QUIET,
    NodeKind.OPEN: "#009e73",
    NodeKind.DOOR: "#e69f00",
    NodeKind.ROOM: "#56b4e9",
}
"""Of Okabe and Ito."""
_WALKABLE = "#b7e0c3"


@print_quality
def walkable_figure(floor: Floor, space: WalkableSpace, graph: CorridorGraph) -> Figure:
    """Draw the plan, what of it can be walked, its walls, and the graph with its kinds of nodes."""
    extent = extent_around(space.walls.reshape(-1, 2))
    figure, (axes,) = panel_grid(1, 1, PAGE_IN, aspect_of(extent), extra_in=0.7)
    draw_plan(axes, floor)
    _draw_space(axes, space)
    _draw_graph(axes, graph)
    square_m = float(space.area.mask.sum()) * space.area.cell_m**2
    corridor_m = float(graph.length_m[~graph.in_room & ~graph.shortcut].sum())
    axes.set_title(
        f"{floor.name}: {square_m:.0f} m² can be walked, {corridor_m:.0f} m of ways outside rooms", loc="left"
    )
    in_metres(axes)
    show(axes, extent)
    legend_below(figure, [axes])
    return figure


def _draw_space(axes: Axes, space: WalkableSpace) -> None:
    cells = np.ma.masked_equal(space.area.mask.astype(np.uint8), 0)
    colours = ListedColormap([_WALKABLE])
    axes.imshow(cells, extent=space.area.grid.extent_m, origin="lower", cmap=colours, alpha=0.6, zorder=1)
    axes.add_collection(LineCollection(list(space.walls), colors="black", linewidths=0.4, zorder=2))


def _draw_graph(axes: Axes, graph: CorridorGraph) -> None:
    ways = [line for line, short in zip(graph.polylines, graph.shortcut, strict=True) if not short]
    colours = [QUIET if room else "black" for room in graph.in_room[~graph.shortcut]]
    axes.add_collection(LineCollection(ways, colors=colours, linewidths=0.7, zorder=3))
    for kind, colour in _COLOURS.items():
        here = graph.nodes[[each is kind for each in graph.kinds]]
        if len(here):
            axes.plot(*here.T, "o", color=colour, markersize=2.2, zorder=4, label=f"{kind} ({len(here)})")
