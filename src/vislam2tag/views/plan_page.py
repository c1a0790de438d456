"""Planned landmarks: the page to hang them by, and in print each floor's plan and map of the sigma to expect."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.core.place_names import near_landmarks
from vislam2tag.core.tracks import Landmarks
from vislam2tag.preparation.planning.floor import FloorDesign
from vislam2tag.preparation.planning.records import FloorPlanRecord, PlannedLandmark, PlanSummary
from vislam2tag.site.model import Floor
from vislam2tag.views.floor_map import drawn_plan, site_figure
from vislam2tag.views.layers import Trace, plotly_text, scatter
from vislam2tag.views.page import data_uri, write_page
from vislam2tag.views.panels import (
    LANDMARK,
    QUIET,
    arrow,
    aspect_of,
    draw_cells,
    draw_plan,
    extent_around,
    in_metres,
    panel_grid,
    print_quality,
    show,
)

_NEW, _TOUR = "#d55e00", "#0072b2"
_SIDES = (
    "middle right",
    "top right",
    "top center",
    "top left",
    "middle left",
    "bottom left",
    "bottom center",
    "bottom right",
)
"""Where a text lies beside its point, by eighths of a turn from the x axis."""


@dataclass(frozen=True)
class PlannedMap:
    """A floor on the page: the landmarks that hang there, and its map of the sigma as PNG."""

    floor: Floor
    hanging: Landmarks
    sigma_png: bytes

    @property
    def sigma(self) -> str:
        """The map of the sigma, to be placed inside the page."""
        return data_uri(self.sigma_png)

    def figure(self, plan: FloorPlanRecord) -> str:
        """The map to hang sheets by, as Plotly's JSON."""
        image, _ = drawn_plan(self.floor)
        return site_figure(self.floor, self.hanging, image, [_tour(plan)], [_sheets(plan.landmarks)])

    def near(self, landmark: PlannedLandmark) -> str:
        """Where a sheet goes, by the landmarks that hang there already; empty where none does."""
        return near_landmarks(self.hanging, self.floor.number, (landmark.x_m, landmark.y_m))


def write_plan_page(out_file: Path, summary: PlanSummary, maps: Mapping[int, PlannedMap]) -> None:
    """Write the page with each floor's map; equal input gives equal bytes.

    Raises OutputError where it cannot be written.
    """
    context = {
        "title": "Where landmarks stand",
        "summary": summary,
        "maps": maps,
        "sizes": sorted(Counter(landmark.sheet for landmark in summary.landmarks).items()),
        "errors_m": [floor.expected_error_m for floor in summary.floors if floor.expected_error_m is not None],
        "unmet": sum(len(floor.unmet) for floor in summary.floors),
    }
    write_page(out_file, "plan.html.j2", context)


def _tour(plan: FloorPlanRecord) -> Trace:
    return scatter("lines", "tour", plan.tour.line_m, line={"color": _TOUR, "width": 1.5}, hoverinfo="skip")


def _sheets(landmarks: Sequence[PlannedLandmark]) -> Trace:
    """The sheets to hang up, each with its id on the side of the wall, where no way and no other sheet is."""
    return scatter(
        "markers+text",
        "sheet to hang up",
        [(one.x_m, one.y_m) for one in landmarks],
        "%{hovertext}",
        text=[f"<b>{plotly_text(one.id)}</b>" for one in landmarks],
        textposition=[_side(one) for one in landmarks],
        textfont={"size": 13, "color": _NEW},
        marker={"symbol": "square", "size": 9, "color": _NEW},
        hovertext=[_hover(one) for one in landmarks],
    )


def _side(landmark: PlannedLandmark) -> str:
    """Into the wall: the sheet's outward normal is its X axis turned by -90 degrees."""
    into_wall = landmark.heading_rad + np.pi / 2
    return _SIDES[round(into_wall / (np.pi / 4)) % 8]


def _hover(landmark: PlannedLandmark) -> str:
    place: dict[str, Any] = landmark.model_dump()
    return plotly_text("landmark {id}, {sheet}: x {x_m:.2f} m, y {y_m:.2f} m, height {z_m:.2f} m".format(**place))


SHEET_IN = (10.8, 15.6)
"""Width of a drawing on A4 and on A3 across, inches."""
MANY = 40
"""Floors with more landmarks than this are drawn for A3."""
ARROW_M = 1.2
"""Length of the arrow out of a wall."""
TOUR_COLOUR, FIXED = "#0072b2", "#000000"
ASIDE_M = 0.3
"""The tour is drawn so far right of the middle: ways that are walked both ways show as two lines."""
ARROWS_M = 8.0
"""One arrow in so many metres of the tour."""


@print_quality
def landmark_plan(design: FloorDesign, floor: Floor, summary: FloorPlanRecord) -> Figure:
    """Draw the plan to take along: sheets with id and size, which way they face, the tour."""
    figure, axes = _floor_axes(design, floor, summary)
    _draw_tour(axes, design)
    _draw_landmarks(axes, summary.landmarks, sizes=True)
    _draw_fixed(axes, design, summary)
    for gap in summary.unmet:
        axes.plot(*zip(gap.start_m, gap.stop_m, strict=True), "x", color="#cc79a7", markersize=6, label="no wall here")
    sizes = sorted({landmark.sheet for landmark in summary.landmarks})
    counts = ", ".join(f"{sum(one.sheet == size for one in summary.landmarks)} {size}" for size in sizes)
    title = f"{summary.name}: {len(summary.landmarks)} landmarks" + (f" ({counts})" if counts else "")
    minutes, seconds = divmod(round(summary.tour.duration_s), 60)
    axes.set_title(
        f"{title}; tour {summary.tour.length_m:.0f} m, {minutes} min {seconds:02d} s. "
        "Squares: sheet, id over its size of paper; arrow: where it faces to.",
        loc="left",
    )
    _legend(axes)
    return figure


@print_quality
def sigma_figure(design: FloorDesign, floor: Floor, summary: FloorPlanRecord) -> Figure:
    """Draw the label sigma to expect, and where further landmarks would gain most."""
    figure, axes = _floor_axes(design, floor, summary)
    sigma = design.sigma.sigma_m
    known = sigma[np.isfinite(sigma)]
    low, high = (float(np.quantile(known, share)) for share in (0.02, 0.98)) if known.size else (0.0, 1.0)
    scale = {"cmap": "viridis", "vmin": low, "vmax": max(high, low + 0.01)}
    image = draw_cells(axes, sigma, design.sigma.grid.extent_m, 1, alpha=0.8, **scale)
    figure.colorbar(image, ax=axes, label="label sigma to expect, per axis / m", shrink=0.6, pad=0.01)
    _draw_landmarks(axes, summary.landmarks, sizes=False)
    _draw_fixed(axes, design, summary)
    for number, one in enumerate(summary.further, start=1):
        axes.plot(
            one.x_m, one.y_m, "*", color="#e69f00", markersize=8, markeredgecolor="black", label="would gain most"
        )
        _write(axes, (one.x_m, one.y_m), f"+{number}: {100 * one.gain_m:.2f} cm", "#000000")
    error = "" if summary.expected_error_m is None else f"; mean error to expect {summary.expected_error_m:.2f} m"
    axes.set_title(f"{summary.name}: label sigma by the smoother's own model{error}", loc="left")
    _legend(axes)
    return figure


def _floor_axes(design: FloorDesign, floor: Floor, summary: FloorPlanRecord) -> tuple[Figure, Axes]:
    extent = extent_around(
        np.vstack((design.corridors.ends, design.landmarks.position, design.space.walls.reshape(-1, 2)))
    )
    width = SHEET_IN[summary.number > MANY]
    figure, (axes,) = panel_grid(1, 1, width, aspect_of(extent))
    draw_plan(axes, floor)
    for line in design.corridors.lines:
        axes.plot(*line.T, color=QUIET, linewidth=0.4, zorder=1)
    axes.lines[-1].set_label("ways")
    in_metres(axes)
    show(axes, extent)
    return figure, axes


def _draw_landmarks(axes: Axes, landmarks: Sequence[PlannedLandmark], *, sizes: bool) -> None:
    for one in landmarks:
        normal = np.array((-np.sin(one.heading_rad), np.cos(one.heading_rad))) * -1.0
        tip = np.array((one.x_m, one.y_m)) + ARROW_M * normal
        arrow(axes, (one.x_m, one.y_m), tip, color=LANDMARK, linewidth=0.8, shrinkA=0, shrinkB=0, zorder=5)
        axes.plot(one.x_m, one.y_m, "s", color=LANDMARK, markersize=3.5, zorder=6, label="sheet to hang up")
        behind = np.array((one.x_m, one.y_m)) - 0.3 * normal
        _write(axes, behind, f"{one.id}\n{one.sheet}" if sizes else one.id, LANDMARK, away=-normal)


def _draw_fixed(axes: Axes, design: FloorDesign, summary: FloorPlanRecord) -> None:
    for name, place in zip(summary.fixed, design.constraints.fixed, strict=True):
        axes.plot(*place, "s", color=FIXED, markersize=3.5, zorder=6, label="hangs already")
        _write(axes, place, name, FIXED)


def _draw_tour(axes: Axes, design: FloorDesign) -> None:
    """The tour a little right of the middle, with arrows, and where it begins."""
    line = _aside(design.tour.line)
    axes.plot(*line.T, color=TOUR_COLOUR, linewidth=0.7, alpha=0.8, zorder=3, label="tour")
    at = arc_lengths(line)
    middles = np.arange(ARROWS_M / 2, at[-1], ARROWS_M)
    for here, there in zip(middles, middles + 0.3, strict=True):
        start, stop = ([float(np.interp(s, at, line[:, axis])) for axis in (0, 1)] for s in (here, there))
        arrow(axes, start, stop, color=TOUR_COLOUR, linewidth=0.5, mutation_scale=6, zorder=3)
    axes.plot(*line[0], "o", color=TOUR_COLOUR, markersize=5, zorder=4, label="start and end of the tour")


def _aside(line: FloatArray) -> FloatArray:
    """A line (k, 2) shifted to the right of its direction."""
    keep = np.concatenate(([True], np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-6))
    line = line[keep]
    step = np.diff(line, axis=0)
    unit = step / np.linalg.norm(step, axis=1, keepdims=True)
    right = np.column_stack((unit[:, 1], -unit[:, 0])) * ASIDE_M
    return np.stack((line[:-1] + right, line[1:] + right), axis=1).reshape(-1, 2)


def _write(
    axes: Axes, place: FloatArray | tuple[float, float], text: str, colour: str, away: FloatArray | None = None
) -> None:
    shift = np.array((0.7, 0.7)) if away is None else away
    written = axes.annotate(
        text,
        (float(place[0]), float(place[1])),
        xytext=(float(5 * shift[0]), float(5 * shift[1])),
        textcoords="offset points",
        color=colour,
        fontsize=6,
        ha="center" if abs(shift[0]) < 0.5 else "left" if shift[0] > 0 else "right",
        va="center" if abs(shift[1]) < 0.5 else "bottom" if shift[1] > 0 else "top",
        linespacing=0.95,
    )
    written.set(zorder=7, path_effects=[withStroke(linewidth=1.5, foreground="white")])


def _legend(axes: Axes) -> None:
    """Explain each thing once, above the drawing's corner."""
    handles, labels = axes.get_legend_handles_labels()
    shown = dict(zip(labels, handles, strict=True))
    axes.legend(list(shown.values()), list(shown), loc="upper left", bbox_to_anchor=(0, -0.06), ncols=6)
