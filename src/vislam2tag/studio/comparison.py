"""Two outputs of the survey's walks compared, for the page."""

from __future__ import annotations

import numpy as np

from vislam2tag.datasets.label_comparison import Labelled, Positions, compare_labels
from vislam2tag.studio.survey_view import output_view
from vislam2tag.studio.work_messages import ComparisonView
from vislam2tag.studio.workspace import Workspace


def comparison(workspace: Workspace, a: str, b: str) -> ComparisonView:
    """Compare two outputs by their names; raises KeyError where there is none of a name."""
    first, second = workspace.outputs[a], workspace.outputs[b]
    pairs = ((id, _labelled(workspace, id, a), _labelled(workspace, id, b)) for id in workspace.now.ids)
    found = compare_labels((pair for pair in pairs if any(pair[1:])), first.settings(), second.settings())
    return ComparisonView(
        a=output_view(first),
        b=output_view(second),
        sessions=found.sessions,
        totals=found.totals,
        settings=found.settings,
    )


def _labelled(workspace: Workspace, id: str, output: str) -> Labelled | None:
    """A walk in one output, by its session's id."""
    result, track = workspace.result(id, output), workspace.track(id, output)
    if result is None:
        return None
    if track is None:
        return Labelled(result, None)
    x, y = (track.columns[axis].astype(np.float64) for axis in ("x", "y"))
    return Labelled(result, Positions(np.column_stack((x, y)), track.columns["floor"], track.positioned))
