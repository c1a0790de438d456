"""Layers of landmarks that contradict the others (from labels), and of all references (from the last diagnosis)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from vislam2tag.common.findings import Severity
from vislam2tag.estimation.landmark_survey.comparison import Verdict
from vislam2tag.quality.diagnosis.record import Reference
from vislam2tag.studio.layer_registry import Layer, register
from vislam2tag.studio.work_messages import Feature, Title
from vislam2tag.studio.workspace import Workspace
from vislam2tag.views.run_summary import LandmarkTally

_CONTRADICTS = "#cc79a7"
"""Neither as walks nor as faults."""


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
            text=f"landmark {found.landmark} contradicts the others in {found.sessions} of {found.seen} sessions by "
            f"up to {found.greatest_m:.2f} m: measure it again",
            colour=_CONTRADICTS,
            landmarks=[found.landmark],
            sessions=said_by[found.landmark],
        )
        for found in tally.all()
        if found.floor == floor
    ]


_CONTRADICTIONS = Title(en="Contradictions", de="Widersprüche")
register(Layer("contradictions", _CONTRADICTIONS, contradictions, shown=True))


_AGREES, _ALONE = "#00664a", "#6e7781"
"""As on the page of conflicts."""


def conflicts(workspace: Workspace, floor: int) -> list[Feature]:
    """A dot for each landmark; a line to its position in each contradicting survey or walk.

    None before a diagnosis of the survey as it is.
    """
    found = workspace.diagnosis
    if found is None or found[1] != workspace.searched():
        return []
    here = found[0].references.on_floor(floor)
    return [*_dots(here), *_lines(here)]


def _dots(here: Sequence[Reference]) -> Iterator[Feature]:
    """Green if references of a landmark could be compared, otherwise grey."""
    compared = {one.landmark for one in here if one.verdict is not Verdict.NOTHING}
    for one in {one.landmark: one for one in here}.values():
        yield Feature(
            id=f"conflicts:{one.floor}:{one.landmark}",
            shape="point",
            floor=one.floor,
            coordinates=[(one.x_m, one.y_m)],
            colour=_AGREES if one.landmark in compared else _ALONE,
            landmarks=[one.landmark],
        )


def _lines(here: Sequence[Reference]) -> Iterator[Feature]:
    for number, one in enumerate(here):
        if one.verdict is Verdict.CONTRADICTS and one.offset_m is not None:
            x, y = one.offset_m
            yield Feature(
                id=f"conflicts:{one.floor}:{one.landmark}:{number}",
                shape="line",
                floor=one.floor,
                coordinates=[(one.x_m, one.y_m), (one.x_m + x, one.y_m + y)],
                severity=Severity.ERROR,
                landmarks=[one.landmark],
            )


_CONFLICTS = Title(en="Conflicts (last diagnosis)", de="Konflikte (letzte Diagnose)")
register(Layer("conflicts", _CONFLICTS, conflicts))
