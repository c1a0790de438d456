"""A site as it is known before anybody walks: plans with scale and axes, landmarks, control points."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.tracks import Landmarks
from vislam2tag.figures.panels import (
    MARGIN_M,
    aspect_of,
    draw_control_points,
    draw_floor,
    extent_of,
    legend_below,
    letter,
    panel_grid,
    show,
)
from vislam2tag.figures.style import PAGE_IN, print_quality
from vislam2tag.site.model import Floor

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
        end = origin + tip
        axes.annotate(
            "",
            xy=(float(end[0]), float(end[1])),
            xytext=(float(origin[0]), float(origin[1])),
            arrowprops={"arrowstyle": "-|>", "color": "#0072b2", "shrinkA": 0, "shrinkB": 0},
            annotation_clip=False,
            zorder=8,
        )
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
