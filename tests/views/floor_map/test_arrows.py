from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.labeling.results import LandmarkContradiction
from vislam2tag.views.floor_map import arrows, size_m


def contradiction(offset_m: tuple[float, float], landmark: str = "7") -> LandmarkContradiction:
    return LandmarkContradiction(
        floor=1, landmark=landmark, sessions=2, seen=5, greatest_m=9.0, surveyed_m=(10.0, 20.0), offset_m=offset_m
    )


def test_an_arrow_leads_from_the_survey_to_where_the_walks_put_it() -> None:
    (trace,) = arrows([contradiction((3.0, -4.0), "<7>")])
    points = np.array([trace["x"][:5], trace["y"][:5]]).T
    np.testing.assert_allclose(points[[0, 1, 3]], [[10, 20], [13, 16], [13, 16]])
    barbs = points[[2, 4]] - points[1]
    np.testing.assert_allclose(np.linalg.norm(barbs, axis=1), 0.25 * 5, atol=1e-3)
    np.testing.assert_allclose(barbs @ [3.0, -4.0] / 25, -0.25 * np.cos(np.pi / 7), atol=1e-3)
    assert trace["x"][5] is None
    assert trace["text"][1] == "&lt;7&gt;: 5.00 m off"
    assert "in 2 of the 5 sessions" in trace["hovertext"][0]
    assert {len(trace[name]) for name in ("x", "y", "text", "textposition", "hovertext")} == {6}


def test_the_text_stands_ahead_of_the_tip() -> None:
    (trace,) = arrows([contradiction((1.0, 0.0)), contradiction((-1.0, 0.0))])
    assert (trace["textposition"][1], trace["textposition"][7]) == ("middle right", "middle left")


def test_nothing_contradicts_nothing_is_drawn() -> None:
    assert arrows([]) == []
    assert size_m(contradiction((0.3, 0.4))) == pytest.approx(0.5)
