from __future__ import annotations

import numpy as np

from tests.registration.networks import survey
from vislam2tag.registration.register import FloorMeasurements, register_floor
from vislam2tag.registration.settings import RegistrationSettings
from vislam2tag.survey.model import ControlPoints, Floor
from vislam2tag.views.panels import rendered
from vislam2tag.views.site_figures import residual_figure

FLOOR = Floor(1, "", 60.0, 30.0, None, None, ControlPoints((), np.empty((0, 2))))


def test_points_regions_and_residuals_are_drawn() -> None:
    drawn = survey(1)
    found = register_floor(1, FloorMeasurements(shots=drawn.shots, known=drawn.known), RegistrationSettings())
    figure = residual_figure(FLOOR, found)
    plan, residuals = figure.axes
    assert plan.get_xlim() == (0, 60)
    assert {text.get_text() for text in plan.texts} == {one.point for one in found.landmarks}
    assert "times as large" in plan.get_title(loc="left")
    assert sum(patch.get_height() for patch in residuals.patches) == len(found.residuals)  # type: ignore[attr-defined]
    assert rendered(figure, "svg") == rendered(residual_figure(FLOOR, found), "svg")


def test_nothing_registered_is_still_a_figure() -> None:
    empty = register_floor(1, FloorMeasurements(), RegistrationSettings())
    assert rendered(residual_figure(FLOOR, empty), "png").startswith(b"\x89PNG")
