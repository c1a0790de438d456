"""Print figures of a site: plans with landmarks, the labelling workflow, walkable space, registration residuals."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
import polars as pl
from matplotlib.figure import Figure

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.preparation.registration.record import PositionSource, RegisteredPoint, Registration, Residual
from vislam2tag.site.model import Floor, Site
from vislam2tag.site.walkable.graph import CorridorGraph, NodeKind
from vislam2tag.site.walkable.space import WalkableSpace
from vislam2tag.views.floor_map import site_layers
from vislam2tag.views.layers import (
    BLUE,
    GREEN,
    GREY,
    HALO,
    MANY_COLOURS,
    VERMILION,
    Chart,
    Trace,
    area,
    arrows,
    axis,
    dots,
    grid_cells,
    joined,
    line,
    one_colour,
    written,
)
from vislam2tag.views.panels import MARGIN_M, Extent, PlanPanel, colour_of, extent_around, extent_of, printed

TRUTH = "#000000"


def scan_labels(floor: Floor, landmarks: Landmarks, wifi: pl.DataFrame) -> Figure:
    """Draw the label of every reading of a walk, a colour for each scan, and each scan's mean.

    ``wifi`` is the labelled table with ``scan``, ``x`` and ``y`` (BCS, metres, null without a label); at least one
    reading has a label.
    """
    extent = extent_around(wifi.drop_nulls("x").select("x", "y").to_numpy())
    return printed([PlanPanel("", floor, [*site_layers(floor, landmarks, ids=False), *scan_layers(wifi)], extent)])


def scan_layers(wifi: pl.DataFrame) -> list[Trace]:
    """The labelled readings of a table as dots, coloured by scan, and the mean of each scan."""
    labelled = wifi.drop_nulls("x").sort("scan")
    rank = labelled["scan"].rank("dense").to_list()
    means = labelled.group_by("scan", maintain_order=True).agg(pl.col("x", "y").mean())
    colours = [MANY_COLOURS[each % len(MANY_COLOURS)] for each in rank]
    return [
        dots("reading, by scan", labelled.select("x", "y").to_numpy(), colours),
        dots("mean of a scan", means.select("x", "y").to_numpy(), TRUTH, 10, "star"),
    ]


def walk_layer(trajectory: Trajectory, name: str, colour: str) -> Trace:
    """The mapped frames as a line, broken where frames have no position."""
    counted = (trajectory.status != Status.DUPLICATE) & (trajectory.status != Status.INVALID)
    return line(name, trajectory.position_bcs[counted, :2], colour)


def recorded(camera: CameraTrack, log: LandmarkLog) -> PlanPanel:
    """A walk as recorded in the tracker's frame, with all logged positions of its landmarks."""
    known = np.unique(np.round(log.plane_acs[~log.lost], 2), axis=0)
    layers = [
        line("camera", camera.plane_acs[camera.usable], GREY),
        dots("landmarks as logged", known, VERMILION, 4),
    ]
    return PlanPanel("Recorded walk", None, layers)


def landmark_configuration(site: Site) -> Figure:
    """Draw every floor that has landmarks: its plan, the landmarks with their ids, the control points."""
    floors = [floor for floor in site.floors if len(site.landmarks.on_floor(floor.number).ids)]
    panels = [
        PlanPanel(f"Floor {floor.number}", floor, site_layers(floor, site.landmarks), extent_of(floor, site.landmarks))
        for floor in floors
    ]
    return printed(panels)


def workflow(
    floor: Floor,
    landmarks: Landmarks,
    camera: CameraTrack,
    log: LandmarkLog,
    trajectory: Trajectory,
    wifi: pl.DataFrame,
) -> Figure:
    """Draw the steps of labelling: surveyed landmarks, recorded walk, mapped walk, labelled Wi-Fi readings.

    ``wifi`` is the labelled table (see :func:`vislam2tag.labeling.tables.label_readings`).
    """
    extent, below = extent_of(floor, landmarks), site_layers(floor, landmarks, ids=False)
    walk = walk_layer(trajectory, "mapped, without discarded frames", colour_of("local-corrected"))
    return printed(
        [
            PlanPanel("Surveyed landmarks", floor, site_layers(floor, landmarks), extent),
            recorded(camera, log),
            PlanPanel("Mapped walk", floor, [*below, walk], extent),
            PlanPanel("Labelled readings", floor, [*below, *scan_layers(wifi)], extent),
        ]
    )


_BAR_STEPS = (1.0, 2.0, 5.0)
_AXIS_SHARE, _BAR_SHARE, _NORTH_SHARE = 0.12, 0.25, 0.08
"""Share of the longer side of the drawing."""


def site_plan(floors: Sequence[Floor], landmarks: Landmarks) -> Figure:
    """Draw each floor: its plan, landmarks with their ids, control points, the BCS axes at its origin, a scale bar,
    and north if the floor has a georeference.
    """
    panels = []
    for floor in floors:
        extent = _shown(floor, landmarks)
        layers = [*site_layers(floor, landmarks), *_bearings(floor, extent), *_scale_bar(extent)]
        panels.append(PlanPanel(floor.name, floor, layers, extent))
    return printed(panels)


def _side_m(extent: Extent) -> float:
    return float(np.max(extent[1] - extent[0]))


def _shown(floor: Floor, landmarks: Landmarks) -> Extent:
    """Corners of the drawing: plan, surveyed points, the origin if it is close, and a margin below."""
    low, high = extent_of(floor, landmarks)
    here = landmarks.on_floor(floor.number)
    points = np.concatenate((here.position_bcs[here.surveyed], floor.control_points.position_bcs, [low, high]))
    side_m = _side_m((low, high))
    if (np.abs(np.clip(0.0, low, high)) <= side_m).all():
        points = np.concatenate((points, np.zeros((1, 2))))
    corners = points.min(axis=0) - MARGIN_M, points.max(axis=0) + MARGIN_M
    return corners[0] - (0.0, 0.06 * side_m), corners[1]


def _bearings(floor: Floor, extent: Extent) -> Iterator[Trace]:
    """The BCS axes at the origin, or near the lower left corner, and true north."""
    side_m = _side_m(extent)
    shown = (extent[0] <= 0).all() and (extent[1] >= 0).all()
    origin = np.zeros(2) if shown else extent[0] + 0.03 * side_m
    ways = [((_AXIS_SHARE * side_m, 0.0), "x"), ((0.0, _AXIS_SHARE * side_m), "y")]
    yield _named_arrows(BLUE, [(origin, np.array(way), name) for way, name in ways], ["middle right", "top center"])
    if floor.georeference is not None:
        angle = math.radians(floor.georeference.bearing_deg)
        north = _NORTH_SHARE * side_m * np.array([-math.sin(angle), math.cos(angle)])
        start = extent[1] - 1.3 * _NORTH_SHARE * side_m - north / 2
        yield _named_arrows(TRUTH, [(start, north, "N")], ["top center"])


def _named_arrows(colour: str, drawn: Sequence[tuple[FloatArray, FloatArray, str]], sides: Sequence[str]) -> Trace:
    font = {"color": colour, "size": 13, "shadow": HALO}
    ways = [((start[0], start[1]), (way[0], way[1]), "", name) for start, way, name in drawn]
    positions = [side for side in sides for _ in range(6)]
    return arrows("", colour, 2.5, ways, textfont=font, textposition=positions)


def _scale_bar(extent: Extent) -> Iterator[Trace]:
    """A bar of a round length in the lower right corner."""
    side_m = _side_m(extent)
    length_m = _round_below(_BAR_SHARE * side_m)
    left, low = extent[1][0] - length_m - 0.02 * side_m, extent[0][1] + 0.02 * side_m
    half = np.array([(0, 0), (0.5 * length_m, 0), (0.5 * length_m, 0.012 * side_m), (0, 0.012 * side_m)])
    for number, colour in enumerate((TRUTH, "#ffffff")):
        corners = half + np.array((left + number * length_m / 2, low))
        yield area("", corners, colour, 1.0)
        yield line("", np.vstack((corners, corners[:1])), TRUTH, 1.2)
    yield written([(left + length_m / 2, low + 0.012 * side_m)], [f"{length_m:g} m"], "top center")


def _round_below(value: float) -> float:
    """The largest of ..., 0.1, 0.2, 0.5, 1, 2, 5, 10, ... up to a value."""
    decade = 10.0 ** math.floor(math.log10(value))
    return max(step * decade for step in _BAR_STEPS if step * decade <= value)


_NODE_COLOURS = {
    NodeKind.JUNCTION: VERMILION,
    NodeKind.TURN: BLUE,
    NodeKind.DEAD_END: "#cc79a7",
    NodeKind.STRAIGHT: GREY,
    NodeKind.OPEN: "#009e73",
    NodeKind.DOOR: "#e69f00",
    NodeKind.ROOM: "#56b4e9",
}
"""Of Okabe and Ito."""


def walkable_figure(floor: Floor, space: WalkableSpace, graph: CorridorGraph) -> Figure:
    """Draw the plan, its walkable space and walls, and the graph with its kinds of nodes."""
    extent = extent_around(space.walls.reshape(-1, 2))
    square_m = float(space.area.mask.sum()) * space.area.cell_m**2
    corridor_m = float(graph.length_m[~graph.in_room & ~graph.shortcut].sum())
    title = f"{floor.name}: {square_m:.0f} m² walkable, {corridor_m:.0f} m of ways outside rooms"
    mask = np.where(space.area.mask, 1.0, np.nan)
    layers = [
        grid_cells("walkable", space.area.grid, mask, opacity=0.6, **one_colour("#b7e0c3")),
        line("wall", joined(space.walls), TRUTH, 1),
        *_graph_layers(graph),
    ]
    return printed([PlanPanel(title, floor, layers, extent)], extra_in=0.7)


def _graph_layers(graph: CorridorGraph) -> Iterator[Trace]:
    for name, wanted, colour in (("way in a room", graph.in_room, GREY), ("way", ~graph.in_room, TRUTH)):
        ways = [line for line, own in zip(graph.polylines, wanted & ~graph.shortcut, strict=True) if own]
        yield line(name, joined(ways), colour)
    for kind, colour in _NODE_COLOURS.items():
        here = graph.nodes[[each is kind for each in graph.kinds]]
        yield dots(f"{kind} ({len(here)})", here, colour, 8)


REGION_95 = 5.991
"""Squared Mahalanobis distance of the 95 % region in the plane."""
_LONGEST_SHARE = 0.08
"""Length of the longest arrow as a share of the plan's longer side."""
_SOURCE_COLOURS = {PositionSource.STATION: VERMILION, PositionSource.TAPE: GREEN, PositionSource.CLICK: "#cc79a7"}
_ODD_SIGMAS = 3.0
_CIRCLE = np.exp(2j * np.pi * np.linspace(0, 1, 41))


def residual_figure(floor: Floor, found: Registration) -> Figure:
    """Draw points with their 95 % regions and residuals on the plan, magnified, and all residuals in sigmas."""
    points = [*found.landmarks, *found.control_points]
    places = np.array([(one.x_m, one.y_m) for one in points], dtype=np.float64).reshape(-1, 2)
    extent = extent_around(places) if floor.extent_m is None else (floor.corners_m[0], floor.corners_m[1])
    regions, magnified = _regions(points, places, extent)
    ways, longer = _residual_arrows(found.residuals, extent)
    title = f"95 % regions {magnified:g} times, residuals {longer:g} times enlarged"
    layers = [*regions, *_points(points, places), ways]
    return printed(
        [PlanPanel(title, floor, layers, extent), _histogram((*found.residuals, *found.tape_residuals))], extra_in=0.7
    )


def _points(points: Sequence[RegisteredPoint], places: FloatArray) -> Iterator[Trace]:
    """The points by source, with their names."""
    for source, colour in _SOURCE_COLOURS.items():
        own = [number for number, one in enumerate(points) if one.source is source]
        text = [points[number].point for number in own]
        yield dots(f"by {source.value}", places[own], colour, 6, "square", text=text, textposition="top right")


def _regions(points: Sequence[RegisteredPoint], places: FloatArray, extent: Extent) -> tuple[list[Trace], float]:
    """The points' 95 % regions by source, and their magnification (a round number)."""
    if not points:
        return [], 1.0
    values, vectors = np.linalg.eigh(np.array([one.covariance_m2 for one in points]))
    axes_m = np.sqrt(REGION_95 * values)
    magnified = _magnified(2 * float(np.median(axes_m.max(axis=1))), extent)
    circle = np.column_stack((_CIRCLE.real, _CIRCLE.imag))
    rings = places[:, None] + magnified * np.einsum("nij,nj,kj->nki", vectors, axes_m, circle)
    layers = []
    for source, colour in _SOURCE_COLOURS.items():
        own = [ring for ring, one in zip(rings, points, strict=True) if one.source is source]
        layers.append(line("", joined(own), colour, 1.5))
    return layers, magnified


def _magnified(length_m: float, extent: Extent) -> float:
    """The largest factor of 1, 2, 5, 10, ... that keeps a length a small share of the plan."""
    return _round_below(max(_LONGEST_SHARE * _side_m(extent) / max(length_m, 1e-9), 1.0))


def _residual_arrows(residuals: Sequence[Residual], extent: Extent) -> tuple[Trace, float]:
    """The residuals of each shot and known point, drawn from its point, and their magnification."""
    known = [(one.at_m, one.by_m) for one in residuals if one.at_m and one.by_m]
    magnified = _magnified(max(math.hypot(*by_m) for _, by_m in known), extent) if known else 1.0
    drawn = [(at_m, (magnified * x, magnified * y), "", "") for at_m, (x, y) in known]
    return arrows("residual", TRUTH, 1.5, drawn), magnified


def _histogram(residuals: Sequence[Residual]) -> Chart:
    """Histogram of residuals in sigmas, with the limit for outliers."""
    sigmas = np.abs([one.sigmas for one in residuals])
    counts, edges = np.histogram(sigmas, np.arange(0, max(_ODD_SIGMAS + 1, sigmas.max(initial=0.0) + 0.5), 0.25))
    middles = (0.5 * (edges[:-1] + edges[1:])).tolist()
    bars = {"type": "bar", "name": "", "x": middles, "y": counts.tolist(), "marker": {"color": GREY}}
    top = 1.05 * max(1, counts.max(initial=0))
    odd = line(f"{_ODD_SIGMAS:g} sigmas", [(_ODD_SIGMAS, 0), (_ODD_SIGMAS, top)], VERMILION, 2, "dash")
    y = axis("measurements kept", rangemode="tozero")
    return Chart([bars, odd], axis("residual / its standard deviation", grid=False), y, "Residuals", {"bargap": 0.0})
