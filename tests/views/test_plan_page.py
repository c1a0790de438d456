"""The page of a plan: on which side of a sheet its id stands, and where sheets go.

Drawings of plans.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.preparation.planning.floors import nothing_given, ring
from vislam2tag.preparation.planning.floor import FloorDesign, plan_floor
from vislam2tag.preparation.planning.records import FloorPlanRecord, PlannedLandmark, floor_summary, new_ids
from vislam2tag.preparation.planning.settings import PlanSettings
from vislam2tag.site.model import ControlPoints, Floor
from vislam2tag.views.plan_page import ASIDE_M, SHEET_IN, _sheets, landmark_plan, sigma_figure


def sheet(name: str, heading_rad: float) -> PlannedLandmark:
    return PlannedLandmark(
        id=name,
        floor=1,
        x_m=1.0,
        y_m=2.0,
        z_m=1.5,
        heading_rad=heading_rad,
        sheet="A4",
        width_m=0.2,
        pass_m=1,
        visible_m=3,
    )


@pytest.mark.parametrize(
    ("heading_rad", "side"),
    [(0.0, "top center"), (math.pi / 2, "middle left"), (math.pi, "bottom center"), (-math.pi / 2, "middle right")],
)
def test_an_id_stands_on_the_side_of_the_wall(heading_rad: float, side: str) -> None:
    drawn = _sheets([sheet("<7>", heading_rad)])
    assert drawn["textposition"] == [side]
    assert drawn["text"] == ["<b>&lt;7&gt;</b>"]
    assert drawn["hovertext"] == ["landmark &lt;7&gt;, A4: x 1.00 m, y 2.00 m, height 1.50 m"]


SETTINGS = PlanSettings(further=2)
FLOOR = Floor(2, "Second", 30.0, 16.0, None, None, ControlPoints((), np.empty((0, 2))))


@pytest.fixture(scope="module")
def design() -> FloorDesign:
    return plan_floor(*ring(), SETTINGS, replace(nothing_given(), fixed=np.array([(10.0, 0.0)]), names=("door",)))


@pytest.fixture(scope="module")
def summary(design: FloorDesign) -> FloorPlanRecord:
    return floor_summary(design, 2, "Second", new_ids(len(design.place), 31, ()))


def test_the_plan_shows_ids_sizes_the_tour_and_what_hangs_already(
    design: FloorDesign, summary: FloorPlanRecord
) -> None:
    figure = landmark_plan(design, FLOOR, summary)
    (axes,) = figure.axes
    texts = {text.get_text() for text in axes.texts}
    assert {f"{one.id}\n{one.sheet}" for one in summary.landmarks} <= texts
    assert "door" in texts
    labels = axes.get_legend_handles_labels()[1]
    assert {"tour", "sheet to hang up", "existing landmark", "start and end of the tour", "ways"} <= set(labels)
    assert f"tour {summary.tour.length_m:.0f} m" in axes.get_title(loc="left")
    assert figure.get_figwidth() == SHEET_IN[0]
    tour = next(line for line in axes.lines if line.get_label() == "tour").get_xydata()
    off = np.abs(np.asarray(tour)[:, 1] - 1.0)
    assert np.isclose(off, ASIDE_M).any()


def test_the_map_shows_the_sigma_and_what_would_gain(design: FloorDesign, summary: FloorPlanRecord) -> None:
    figure = sigma_figure(design, FLOOR, summary)
    axes = figure.axes[0]
    shown = np.asarray(axes.images[0].get_array())
    assert np.nanmin(shown) == np.nanmin(design.sigma.sigma_m)
    texts = {text.get_text() for text in axes.texts}
    assert f"+1: {100 * summary.further[0].gain_m:.2f} cm" in texts
