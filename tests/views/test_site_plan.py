"""The drawing of a site: scale bar, axes, north."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.site.plans import drawn_floor
from tests.site.plans.drawn_floor import HERE, floor_with
from tests.site.walkable.hand_made import plan
from vislam2tag.site.landmark_file import landmarks_from
from vislam2tag.site.model import ControlPoints, Floor
from vislam2tag.site.walkable.graph import NodeKind, corridor_graph
from vislam2tag.site.walkable.space import walkable_space
from vislam2tag.views.panels import rendered
from vislam2tag.views.site_figures import site_plan, walkable_figure


def floor_of(folder: Path, lower_left_m: tuple[float, float] = (0.0, 0.0)) -> Floor:
    extent = {"width_m": 20.0, "height_m": 10.0, "lower_left_m": lower_left_m}
    floor = floor_with(drawn_floor.png(folder), {"extent": extent})
    return replace(floor, width_m=20.0, height_m=10.0, lower_left_m=lower_left_m)


def test_scale_axes_and_north(tmp_path: Path) -> None:
    here = replace(floor_of(tmp_path), georeference=HERE)
    figure = site_plan([here, replace(floor_of(tmp_path), number=2, name="Two")], landmarks_from([]))
    first, second = figure.axes
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["(a) One", "(b) Two"]
    texts = [[text.get_text() for text in axes.texts] for axes in (first, second)]
    assert {"x", "y", "5 m", "N"} <= set(texts[0])
    assert "N" not in texts[1]
    corners = np.concatenate([patch.get_xy() for patch in first.patches])  # type: ignore[attr-defined]
    assert np.ptp(corners[:, 0]) == pytest.approx(5.0)
    north = np.asarray(first.lines[-3].get_xydata())
    way = north[1] - north[0]
    assert np.degrees(np.arctan2(-way[0], way[1])) == pytest.approx(HERE.bearing_deg, abs=0.1)


def test_a_plan_far_from_the_origin_fills_the_drawing(tmp_path: Path) -> None:
    (axes,) = site_plan([floor_of(tmp_path, (900.0, -500.0))], landmarks_from([])).axes
    assert axes.get_xlim() == pytest.approx((897, 923))
    assert tuple(axes.images[0].get_extent()) == (900, 920, -500, -490)


FLOOR = Floor(0, "Ground", 26.0, 22.0, None, None, ControlPoints((), np.empty((0, 2))), (-1.0, -1.0))


def test_space_and_kinds_of_nodes_are_drawn() -> None:
    space = walkable_space(plan(10))
    graph = corridor_graph(space)
    figure = walkable_figure(FLOOR, space, graph)
    (axes,) = figure.axes
    labels = {str(line.get_label()).split(" (")[0] for line in axes.lines}
    assert labels - {"wall", "way", "way in a room"} == {kind.value for kind in NodeKind if kind in graph.kinds}
    assert "m² walkable" in axes.get_title(loc="left")
    assert rendered(figure, "png") == rendered(walkable_figure(FLOOR, space, graph), "png")
