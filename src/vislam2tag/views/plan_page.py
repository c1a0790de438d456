"""Planned landmarks: the page for hanging them up, and print plans and maps of the expected sigma by floor."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.path_length import arc_lengths
from vislam2tag.core.tracks import Landmarks, near_landmarks
from vislam2tag.preparation.planning.floor import FloorDesign
from vislam2tag.preparation.planning.records import FloorPlanRecord, PlannedLandmark, PlanSummary
from vislam2tag.site.model import Floor
from vislam2tag.views.floor_map import drawn_plan, site_figure
from vislam2tag.views.layers import GREY, HALO, Trace, arrows, dots, grid_cells, joined, line, plotly_text, scatter
from vislam2tag.views.page import data_uri, write_page
from vislam2tag.views.panels import PlanPanel, extent_around, printed

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
"""Position of a text beside its point, by eighths of a turn from the x axis."""


@dataclass(frozen=True)
class PlannedMap:
    """A floor on the page: its existing landmarks, and its map of sigma as PNG."""

    floor: Floor
    hanging: Landmarks
    sigma_png: bytes

    @property
    def sigma(self) -> str:
        """The map of sigma as a data URI."""
        return data_uri(self.sigma_png)

    def figure(self, plan: FloorPlanRecord) -> str:
        """The map for hanging up sheets, as Plotly's JSON."""
        image, _ = drawn_plan(self.floor)
        return site_figure(self.floor, self.hanging, image, [_tour(plan)], [_sheets(plan.landmarks)])

    def near(self, landmark: PlannedLandmark) -> str:
        """Location of a sheet relative to rooms with names and existing landmarks; empty if there are none."""
        hanging = near_landmarks(self.hanging, self.floor.number, (landmark.x_m, landmark.y_m))
        return ", ".join(filter(None, (landmark.near, hanging)))


def write_plan_page(out_file: Path, summary: PlanSummary, maps: Mapping[int, PlannedMap]) -> None:
    """Write the page with each floor's map; equal input gives equal bytes.

    Raises OutputError if it cannot be written.
    """
    context = {
        "title": "Landmark plan",
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
    """The sheets to hang up, each with its id on the wall side, away from the way and other sheets."""
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
"""Width of a drawing on landscape A4 and A3, inches."""
MANY = 40
"""Floors with more landmarks than this are drawn for A3."""
ARROW_M = 1.2
"""Length of the arrow out of a wall."""
ASIDE_M = 0.3
"""Offset of the tour to the right, so that ways walked in both directions show as two lines."""
ARROWS_M = 8.0
"""Metres of the tour per arrow."""


def landmark_plan(design: FloorDesign, floor: Floor, summary: FloorPlanRecord) -> Figure:
    """Draw the plan to take along: sheets with id, size and direction, and the tour."""
    sizes = Counter(landmark.sheet for landmark in summary.landmarks)
    counts = ", ".join(f"{count} {size}" for size, count in sorted(sizes.items()))
    title = f"{summary.name}: {len(summary.landmarks)} landmarks" + (f" ({counts})" if counts else "")
    minutes, seconds = divmod(round(summary.tour.duration_s), 60)
    title += (
        f"; tour {summary.tour.length_m:.0f} m, {minutes} min {seconds:02d} s. "
        "Squares: sheets with id and paper size; arrows: direction that they face."
    )
    ends = [end for gap in summary.unmet for end in (gap.start_m, gap.stop_m)]
    layers = [
        *_tour_layers(design),
        *_landmark_layers(design, summary, [f"{one.id}<br>{one.sheet}" for one in summary.landmarks]),
        dots("no suitable wall", ends, "#cc79a7", 14, "x-thin-open", edge={"width": 2}),
    ]
    return _floor_drawing(design, floor, summary, title, layers)


def sigma_figure(design: FloorDesign, floor: Floor, summary: FloorPlanRecord) -> Figure:
    """Draw the expected label sigma, and where further landmarks would help most."""
    sigma = design.sigma.sigma_m
    known = sigma[np.isfinite(sigma)]
    low, high = (float(np.quantile(known, share)) for share in (0.02, 0.98)) if known.size else (0.0, 1.0)
    bar = {"title": {"text": "expected label sigma per axis / m"}}
    scale: dict[str, Any] = {"colorscale": "viridis", "zmin": low, "zmax": max(high, low + 0.01), "colorbar": bar}
    gains = [f"+{number}: {100 * one.gain_m:.2f} cm" for number, one in enumerate(summary.further, start=1)]
    places = [(one.x_m, one.y_m) for one in summary.further]
    layers = [
        grid_cells("", design.sigma.grid, sigma, opacity=0.8, **scale),
        *_landmark_layers(design, summary, [one.id for one in summary.landmarks]),
        dots(
            "best place for one more",
            places,
            "#e69f00",
            20,
            "star",
            edge={"color": "#000000", "width": 1},
            **_named(gains),
        ),
    ]
    error = "" if summary.expected_error_m is None else f"; expected mean error {summary.expected_error_m:.2f} m"
    return _floor_drawing(
        design, floor, summary, f"{summary.name}: label sigma according to the smoother's model{error}", layers
    )


def _floor_drawing(
    design: FloorDesign, floor: Floor, summary: FloorPlanRecord, title: str, layers: Sequence[Trace]
) -> Figure:
    extent = extent_around(
        np.vstack((design.corridors.ends, design.landmarks.position, design.space.walls.reshape(-1, 2)))
    )
    ways = line("ways", joined(design.corridors.lines), GREY, 1)
    return printed([PlanPanel(title, floor, [ways, *layers], extent)], width_in=SHEET_IN[summary.number > MANY])


def _landmark_layers(design: FloorDesign, summary: FloorPlanRecord, texts: Sequence[str]) -> list[Trace]:
    """Sheets with texts on the wall side and arrows in the direction they face, and existing landmarks."""
    headings = np.array([one.heading_rad for one in summary.landmarks])
    facing = np.column_stack((np.sin(headings), -np.cos(headings))) * ARROW_M
    places = [(one.x_m, one.y_m) for one in summary.landmarks]
    drawn = [(place, tuple(way), "", "") for place, way in zip(places, facing.tolist(), strict=True)]
    sides, fixed = [_side(one) for one in summary.landmarks], [plotly_text(name) for name in summary.fixed]
    return [
        arrows("", _NEW, 2, drawn),
        dots("sheet to hang up", places, _NEW, 9, "square", **_named(texts, sides, _NEW)),
        dots("existing landmark", design.constraints.fixed, "#000000", 9, "square", **_named(fixed)),
    ]


def _named(text: Sequence[str], side: str | Sequence[str] = "top right", colour: str = "#000000") -> dict[str, Any]:
    return {"text": text, "textposition": side, "textfont": {"color": colour, "size": 12, "shadow": HALO}}


def _tour_layers(design: FloorDesign) -> list[Trace]:
    """The tour, offset to the right, with arrows and its start."""
    way = _aside(design.tour.line)
    at = arc_lengths(way)
    middles = np.arange(ARROWS_M / 2, at[-1], ARROWS_M)
    start, stop = (
        np.column_stack([np.interp(middles + ahead, at, way[:, axis]) for axis in (0, 1)]) for ahead in (0.0, 0.3)
    )
    heads = [(tuple(one), tuple(tip), "", "") for one, tip in zip(start.tolist(), (stop - start).tolist(), strict=True)]
    return [
        line("tour", way, _TOUR, 1.8, opacity=0.8),
        arrows("", _TOUR, 1.5, heads, 1.0),
        dots("start and end of the tour", way[:1], _TOUR, 12),
    ]


def _aside(line: FloatArray) -> FloatArray:
    """A line (k, 2) shifted to the right of its direction."""
    keep = np.concatenate(([True], np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-6))
    line = line[keep]
    step = np.diff(line, axis=0)
    unit = step / np.linalg.norm(step, axis=1, keepdims=True)
    right = np.column_stack((unit[:, 1], -unit[:, 0])) * ASIDE_M
    return np.stack((line[:-1] + right, line[1:] + right), axis=1).reshape(-1, 2)
