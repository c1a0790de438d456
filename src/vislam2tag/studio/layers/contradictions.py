"""Landmarks that contradict the rest: from where the survey has them to where the walks put them."""

from __future__ import annotations

from vislam2tag.common.findings import Severity
from vislam2tag.studio.layer_registry import Layer, register
from vislam2tag.studio.work_messages import Feature, Title
from vislam2tag.studio.workspace import Workspace
from vislam2tag.views.run_summary import LandmarkTally


def contradictions(workspace: Workspace, floor: int) -> list[Feature]:
    """One line for each landmark of a floor, over all sessions."""
    tally, said_by = LandmarkTally(), dict[str, list[str]]()
    for id in workspace.now.ids:
        result = workspace.result(id)
        if result is not None:
            tally.add(result)
            for mark in result.contradictions:
                said_by.setdefault(mark.landmark, []).append(id)
    return [
        Feature(
            id=f"contradictions:{floor}:{found.landmark}",
            shape="line",
            floor=floor,
            coordinates=[
                found.surveyed_m,
                (found.surveyed_m[0] + found.offset_m[0], found.surveyed_m[1] + found.offset_m[1]),
            ],
            label=f"{found.landmark}: {found.greatest_m:.2f} m",
            text=f"landmark {found.landmark} contradicts the rest in {found.sessions} of {found.seen} sessions, by "
            f"up to {found.greatest_m:.2f} m: measure it again",
            severity=Severity.WARNING,
            landmarks=[found.landmark],
            sessions=said_by[found.landmark],
        )
        for found in tally.all()
        if found.floor == floor
    ]


_TITLE = Title(en="Contradictions", de="Widersprüche")
register(Layer("contradictions", _TITLE, contradictions, shown=True))
