"""The page of a plan: on which side of a sheet its id stands, and where sheets go."""

from __future__ import annotations

import math

import pytest

from vislam2tag.planning.records import PlannedLandmark
from vislam2tag.views.plan_page import _sheets


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
