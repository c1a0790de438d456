"""A site in print: plans with landmarks, the workflow of labelling, walkable space, residuals of a registration."""

from __future__ import annotations

import math
from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
import polars as pl
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.preparation.registration.record import PositionSource, RegisteredPoint, Registration, Residual
from vislam2tag.site.model import Floor, Site
from vislam2tag.site.walkable.graph import CorridorGraph, NodeKind
from vislam2tag.site.walkable.space import WalkableSpace
from vislam2tag.views.panels import (
    LANDMARK,
    MARGIN_M,
    PAGE_IN,
    QUIET,
    TRUTH,
    arrow,
    aspect_of,
    colour_of,
    draw_cells,
    draw_control_points,
    draw_floor,
    draw_plan,
    draw_recording,
    draw_walk,
    extent_around,
    extent_of,
    in_metres,
    legend_below,
    letter,
    panel_grid,
    print_quality,
    show,
)

_COLOURS = 10
"""Colours of the map ``tab10``; neighbouring scans never share one."""


@print_quality
def scan_labels(floor: Floor, landmarks: Landmarks, wifi: pl.DataFrame) -> Figure:
    """Draw the label of every reading of a walk, a colour for each scan, and each scan's mean.

    ``wifi`` is the labelled table with ``scan``, ``x`` and ``y`` (BCS, metres, null without a label); at least one
    reading has a label.
    """
    extent = extent_around(wifi.drop_nulls("x").select("x", "y").to_numpy())
    figure, (axes,) = panel_grid(1, 1, PAGE_IN, aspect_of(extent))
    draw_floor(axes, floor, landmarks)
    draw_scans(axes, wifi)
    show(axes, extent)
    legend_below(figure, [axes])
    return figure


def draw_scans(axes: Axes, wifi: pl.DataFrame) -> None:
    """Draw the labelled readings of a table as dots, and the mean of each scan as a star."""
    labelled = wifi.drop_nulls("x").sort("scan")
    rank = labelled["scan"].rank("dense").to_numpy().astype(int) - 1
    colours = mpl.colormaps["tab10"](rank % _COLOURS)
    axes.scatter(labelled["x"], labelled["y"], s=5, c=colours, linewidths=0, zorder=5, label="reading, by scan")
    means = labelled.group_by("scan", maintain_order=True).agg(pl.col("x", "y").mean())
    axes.plot(means["x"], means["y"], "*k", markersize=4, markeredgewidth=0, zorder=6, label="mean of a scan")


@print_quality
def landmark_configuration(site: Site) -> Figure:
    """Draw every floor that has landmarks: its plan, the landmarks with their ids, the control points."""
    floors = [floor for floor in site.floors if len(site.landmarks.on_floor(floor.number).ids)]
    aspect = max((aspect_of(extent_of(floor, site.landmarks)) for floor in floors), default=1.0)
    figure, axes = panel_grid(len(floors), min(2, max(1, len(floors))), PAGE_IN, aspect)
    for one, floor in zip(axes, floors, strict=True):
        draw_floor(one, floor, site.landmarks, ids=True)
        if len(floor.control_points.ids):
            draw_control_points(one, floor)
    letter(axes, [f"Floor {floor.number}" for floor in floors])
    legend_below(figure, axes)
    return figure


@print_quality
def workflow(
    floor: Floor,
    landmarks: Landmarks,
    camera: CameraTrack,
    log: LandmarkLog,
    trajectory: Trajectory,
    wifi: pl.DataFrame,
) -> Figure:
    """Draw what becomes of a walk: landmarks surveyed, the walk recorded, mapped, its Wi-Fi readings labelled.

    ``wifi`` is the labelled table (see :func:`vislam2tag.labeling.tables.label_readings`).
    """
    figure, axes = panel_grid(4, 2, PAGE_IN, aspect_of(extent_of(floor, landmarks)))
    draw_floor(axes[0], floor, landmarks, ids=True)
    draw_recording(axes[1], camera, log)
    draw_floor(axes[2], floor, landmarks)
    draw_walk(axes[2], trajectory, colour_of("local-corrected"), "mapped, without what is discarded")
    draw_floor(axes[3], floor, landmarks)
    draw_scans(axes[3], wifi)
    legend_below(figure, axes, 6)
    letter(axes, ["Landmarks are placed and surveyed", "A walk is recorded", "It is mapped", "Readings are labelled"])
    return figure


_BAR_STEPS = (1.0, 2.0, 5.0)
_AXIS_SHARE, _BAR_SHARE, _NORTH_SHARE = 0.12, 0.25, 0.08
"""Of the wider side of what is shown."""


@print_quality
def site_plan(floors: Sequence[Floor], landmarks: Landmarks) -> Figure:
    """Draw each floor: its plan, landmarks with their ids, control points, the BCS axes at its origin, a scale bar,
    and north where the floor has a place on earth.
    """
    extents = [_shown(floor, landmarks) for floor in floors]
    columns = min(2, len(floors))
    figure, axes = panel_grid(len(floors), columns, PAGE_IN, max(map(aspect_of, extents)))
    for one, floor, extent in zip(axes, floors, extents, strict=True):
        draw_floor(one, floor, landmarks, ids=True)
        if len(floor.control_points.ids):
            draw_control_points(one, floor)
        side_m = float(np.max(extent[1] - extent[0]))
        _draw_axes(one, _axes_origin(extent, side_m), _AXIS_SHARE * side_m)
        _draw_scale(one, extent, side_m)
        if floor.georeference is not None:
            _draw_north(one, extent, side_m, floor.georeference.bearing_deg)
        show(one, extent)
    letter(axes, [floor.name for floor in floors])
    legend_below(figure, axes)
    return figure


def _shown(floor: Floor, landmarks: Landmarks) -> tuple[FloatArray, FloatArray]:
    """Corners of what is shown: the plan, what was surveyed, the origin if it is near, and a margin below."""
    low, high = extent_of(floor, landmarks)
    here = landmarks.on_floor(floor.number)
    points = np.concatenate((here.position_bcs[here.surveyed], floor.control_points.position_bcs, [low, high]))
    side_m = float(np.max(high - low))
    if (np.abs(np.clip(0.0, low, high)) <= side_m).all():
        points = np.concatenate((points, np.zeros((1, 2))))
    corners = points.min(axis=0) - MARGIN_M, points.max(axis=0) + MARGIN_M
    return corners[0] - (0.0, 0.06 * side_m), corners[1]


def _axes_origin(extent: tuple[FloatArray, FloatArray], side_m: float) -> FloatArray:
    """The BCS's origin where it is shown, else near the lower left corner: then the arrows tell directions only."""
    origin = np.zeros(2)
    shown = (origin >= extent[0]).all() and (origin <= extent[1]).all()
    return origin if shown else extent[0] + 0.03 * side_m


def _draw_axes(axes: Axes, origin: FloatArray, length_m: float) -> None:
    for name, tip in (("x", (length_m, 0.0)), ("y", (0.0, length_m))):
        arrow(axes, origin, origin + tip, color="#0072b2", shrinkA=0, shrinkB=0, zorder=8)
        x, y = (origin + 1.12 * np.array(tip)).tolist()
        axes.text(x, y, name, color="#0072b2", ha="center", va="center", clip_on=True, zorder=8)


def _draw_scale(axes: Axes, extent: tuple[FloatArray, FloatArray], side_m: float) -> None:
    """A bar of a round length in the lower right corner."""
    decade = 10.0 ** math.floor(math.log10(_BAR_SHARE * side_m))
    length_m = max(step * decade for step in _BAR_STEPS if step * decade <= _BAR_SHARE * side_m)
    x, y = extent[1][0] - length_m - 0.02 * side_m, extent[0][1] + 0.02 * side_m
    for half, colour in enumerate(("black", "white")):
        place = (x + half * length_m / 2, y)
        axes.add_patch(
            Rectangle(place, length_m / 2, 0.012 * side_m, facecolor=colour, edgecolor="black", linewidth=0.5, zorder=8)
        )
    axes.text(x + length_m / 2, y + 0.016 * side_m, f"{length_m:g} m", ha="center", va="bottom", zorder=8)


def _draw_north(axes: Axes, extent: tuple[FloatArray, FloatArray], side_m: float, bearing_deg: float) -> None:
    """An arrow to true north in the upper right corner; the y axis has this bearing."""
    angle = math.radians(bearing_deg)
    north = _NORTH_SHARE * side_m * np.array([-math.sin(angle), math.cos(angle)])
    middle = extent[1] - 1.3 * _NORTH_SHARE * side_m
    start, tip = middle - north / 2, middle + north / 2
    axes.annotate(
        "N",
        xy=(float(tip[0]), float(tip[1])),
        xytext=(float(start[0]), float(start[1])),
        arrowprops={"arrowstyle": "-|>", "color": "black"},
        ha="center",
        va="center",
        zorder=8,
    )


_NODE_COLOURS = {
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
    draw_cells(axes, cells, space.area.grid.extent_m, 1, cmap=colours, alpha=0.6)
    axes.add_collection(LineCollection(list(space.walls), colors="black", linewidths=0.4, zorder=2))


def _draw_graph(axes: Axes, graph: CorridorGraph) -> None:
    ways = [line for line, short in zip(graph.polylines, graph.shortcut, strict=True) if not short]
    colours = [QUIET if room else "black" for room in graph.in_room[~graph.shortcut]]
    axes.add_collection(LineCollection(ways, colors=colours, linewidths=0.7, zorder=3))
    for kind, colour in _NODE_COLOURS.items():
        here = graph.nodes[[each is kind for each in graph.kinds]]
        if len(here):
            axes.plot(*here.T, "o", color=colour, markersize=2.2, zorder=4, label=f"{kind} ({len(here)})")


REGION_95 = 5.991
"""Squared Mahalanobis distance in the plane that holds 95 %."""
_LONGEST_SHARE = 0.08
"""Length of the longest arrow, of the plan's longer side."""
_SOURCE_COLOURS = {PositionSource.STATION: LANDMARK, PositionSource.TAPE: "#009e73", PositionSource.CLICK: "#cc79a7"}
_ODD_SIGMAS = 3.0


@print_quality
def residual_figure(floor: Floor, found: Registration) -> Figure:
    """Draw points with their 95 % regions and residuals on the plan, magnified, and all residuals in sigmas."""
    points = [*found.landmarks, *found.control_points]
    places = np.array([(one.x_m, one.y_m) for one in points], dtype=np.float64).reshape(-1, 2)
    extent = _extent(floor, places)
    figure, (plan, bars) = panel_grid(2, 2, PAGE_IN, aspect_of(extent))
    draw_plan(plan, floor)
    magnified = _draw_points(plan, points, places, extent)
    longer = _draw_arrows(plan, found.residuals, extent)
    in_metres(plan)
    show(plan, extent)
    plan.set_title(f"95 % regions {magnified:g} times, residuals {longer:g} times as large", loc="left")
    _draw_residuals(bars, (*found.residuals, *found.tape_residuals))
    legend_below(figure, [plan, bars])
    return figure


def _extent(floor: Floor, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    if floor.extent_m is not None:
        left, right, low, high = floor.extent_m
        return np.array((left, low)), np.array((right, high))
    return extent_around(places) if len(places) else (np.zeros(2), np.ones(2))


def _draw_points(
    axes: Axes, points: Sequence[RegisteredPoint], places: FloatArray, extent: tuple[FloatArray, FloatArray]
) -> float:
    """Draw the points by source with their regions; return by how much those are magnified (a round number)."""
    if not points:
        return 1.0
    values, vectors = np.linalg.eigh(np.array([one.covariance_m2 for one in points]))
    axes_m = 2 * np.sqrt(REGION_95 * values)
    magnified = _magnified(float(np.median(axes_m.max(axis=1))), extent)
    turn = np.degrees(np.arctan2(vectors[:, 1, 1], vectors[:, 0, 1]))
    colours = [_SOURCE_COLOURS[one.source] for one in points]
    regions = EllipseCollection(
        (axes_m[:, 1] * magnified).tolist(),
        (axes_m[:, 0] * magnified).tolist(),
        turn.tolist(),
        units="xy",
        offsets=places,
        offset_transform=axes.transData,
        facecolors="none",
        edgecolors=colours,
        linewidths=0.6,
        zorder=3,
    )
    axes.add_collection(regions)
    for source, colour in _SOURCE_COLOURS.items():
        some = np.array([one.source is source for one in points])
        if some.any():
            axes.plot(*places[some].T, "s", color=colour, markersize=2.5, zorder=4, label=f"by {source.value}")
    for one, (x, y) in zip(points, places.tolist(), strict=True):
        axes.annotate(one.point, (x, y), xytext=(3, 3), textcoords="offset points", zorder=5)
    return magnified


def _magnified(length_m: float, extent: tuple[FloatArray, FloatArray]) -> float:
    """The greatest of 1, 2, 5, 10, ... by which a length stays a small share of the plan."""
    wanted = _LONGEST_SHARE * float(np.max(extent[1] - extent[0])) / max(length_m, 1e-9)
    power = 10.0 ** np.floor(np.log10(max(wanted, 1.0)))
    return float(power * max(step for step in (1, 2, 5) if step * power <= max(wanted, 1.0)))


def _draw_arrows(axes: Axes, residuals: Sequence[Residual], extent: tuple[FloatArray, FloatArray]) -> float:
    """Draw what each shot and known point is off by, from where its point lies; return how much magnified."""
    arrows = np.array([(*one.at_m, *one.by_m) for one in residuals if one.at_m and one.by_m]).reshape(-1, 4)
    if not len(arrows):
        return 1.0
    magnified = _magnified(float(np.hypot(*arrows[:, 2:].T).max()), extent)
    by_m = arrows[:, 2:] * magnified
    axes.quiver(*arrows[:, :2].T, *by_m.T, angles="xy", scale_units="xy", scale=1, width=0.002, color=TRUTH, zorder=6)
    axes.plot([], [], color=TRUTH, linewidth=0.8, label="residual")
    return magnified


def _draw_residuals(axes: Axes, residuals: Sequence[Residual]) -> None:
    """Draw how often residuals are how large, in sigmas, beside where measurements begin to be odd."""
    sigmas = np.abs([one.sigmas for one in residuals])
    axes.hist(
        sigmas, bins=np.arange(0, max(_ODD_SIGMAS + 1, sigmas.max(initial=0.0) + 0.5), 0.25).tolist(), color=QUIET
    )
    axes.axvline(_ODD_SIGMAS, color=LANDMARK, linewidth=0.8, linestyle="--", label="3 sigmas")
    axes.set_xlabel("residual / its standard deviation")
    axes.set_ylabel("measurements kept")
    axes.set_title("Residuals", loc="left")
