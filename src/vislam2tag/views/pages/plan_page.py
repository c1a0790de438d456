"""The page about planned landmarks: on each floor a map to hang them by, lists, what to expect."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from vislam2tag.core.place_names import near_landmarks
from vislam2tag.core.tracks import Landmarks
from vislam2tag.planning.records import FloorPlanRecord, PlannedLandmark, PlanSummary
from vislam2tag.survey.model import Floor
from vislam2tag.views.floor_map.figures import site_figure
from vislam2tag.views.floor_map.layers import Trace, plotly_text
from vislam2tag.views.floor_map.plan import drawn_plan
from vislam2tag.views.page import data_uri, write_page

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
    line = np.array(plan.tour.line_m).reshape(-1, 2)
    return {
        "type": "scatter",
        "mode": "lines",
        "name": "tour",
        "x": line[:, 0].tolist(),
        "y": line[:, 1].tolist(),
        "line": {"color": _TOUR, "width": 1.5},
        "hoverinfo": "skip",
    }


def _sheets(landmarks: Sequence[PlannedLandmark]) -> Trace:
    """The sheets to hang up, each with its id on the side of the wall, where no way and no other sheet is."""
    return {
        "type": "scatter",
        "mode": "markers+text",
        "name": "sheet to hang up",
        "x": [one.x_m for one in landmarks],
        "y": [one.y_m for one in landmarks],
        "text": [f"<b>{plotly_text(one.id)}</b>" for one in landmarks],
        "textposition": [_side(one) for one in landmarks],
        "textfont": {"size": 13, "color": _NEW},
        "marker": {"symbol": "square", "size": 9, "color": _NEW},
        "hovertext": [_hover(one) for one in landmarks],
        "hovertemplate": "%{hovertext}<extra></extra>",
    }


def _side(landmark: PlannedLandmark) -> str:
    """Into the wall: the sheet's outward normal is its X axis turned by -90 degrees."""
    into_wall = landmark.heading_rad + np.pi / 2
    return _SIDES[round(into_wall / (np.pi / 4)) % 8]


def _hover(landmark: PlannedLandmark) -> str:
    place: dict[str, Any] = landmark.model_dump()
    return plotly_text("landmark {id}, {sheet}: x {x_m:.2f} m, y {y_m:.2f} m, height {z_m:.2f} m".format(**place))
