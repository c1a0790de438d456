"""Which references agree, which contradict all others and which nothing can be compared with, by the last diagnosis."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from vislam2tag.common.findings import Severity
from vislam2tag.estimation.landmark_survey.comparison import Verdict
from vislam2tag.quality.diagnosis.record import Reference
from vislam2tag.studio.layer_registry import Layer, register
from vislam2tag.studio.work_messages import Feature, Title
from vislam2tag.studio.workspace import Workspace

_AGREES, _ALONE = "#00664a", "#6e7781"
"""As on the page of conflicts."""


def conflicts(workspace: Workspace, floor: int) -> list[Feature]:
    """A dot for each landmark; a line to where each survey or walk has it that contradicts the others.

    None before a diagnosis of the survey as it is.
    """
    found = workspace.diagnosis
    if found is None or found[1] != workspace.refresh().sessions:
        return []
    here = found[0].references.on_floor(floor)
    return [*_dots(here), *_lines(here)]


def _dots(here: Sequence[Reference]) -> Iterator[Feature]:
    """Green where something said of a landmark could be compared, grey where nothing could."""
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


_TITLE = Title(en="Conflicts, by the last diagnosis", de="Konflikte, nach der letzten Diagnose")
register(Layer("conflicts", _TITLE, conflicts))
