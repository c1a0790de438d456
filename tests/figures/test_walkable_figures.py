from __future__ import annotations

import numpy as np

from tests.walkable.hand_made import plan
from vislam2tag.survey.model import ControlPoints, Floor
from vislam2tag.views.panels import rendered
from vislam2tag.views.site_figures import walkable_figure
from vislam2tag.walkable.graph import NodeKind, corridor_graph
from vislam2tag.walkable.space import walkable_space

FLOOR = Floor(0, "Ground", 26.0, 22.0, None, None, ControlPoints((), np.empty((0, 2))), (-1.0, -1.0))


def test_space_and_kinds_of_nodes_are_drawn() -> None:
    space = walkable_space(plan(10))
    graph = corridor_graph(space)
    figure = walkable_figure(FLOOR, space, graph)
    (axes,) = figure.axes
    labels = {str(line.get_label()).split(" (")[0] for line in axes.lines}
    assert labels == {kind.value for kind in NodeKind if kind in graph.kinds}
    assert "m² can be walked" in axes.get_title(loc="left")
    assert rendered(figure, "png") == rendered(walkable_figure(FLOOR, space, graph), "png")
