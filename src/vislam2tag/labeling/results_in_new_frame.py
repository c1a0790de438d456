"""The result of a session in another frame: what report and summary draw and count."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import numpy as np

from vislam2tag.common.findings import Finding, Severity
from vislam2tag.core.similarity import Similarity2
from vislam2tag.labeling.results import ContradictionMark, Drawing, Polyline, SessionResult, Stretch
from vislam2tag.site.frame_change import FrameChange

Pair = tuple[float, float]
_DECIMALS = 2
"""Of drawn points, as where they are first made."""


def changed_result(result: SessionResult, changes: Mapping[int, FrameChange]) -> SessionResult:
    """A session's result in the new frame; ``changes`` by floor hold all floors that it tells of.

    Statistics of sigmas and of errors against truth are those of the old scale: where the scale changes they are left
    out, which is a finding.
    """
    own = changes[result.floor]
    rescaled = not np.isclose(own.scale, 1.0, rtol=0, atol=1e-6)
    findings = list(result.findings)
    if rescaled and (result.sigma is not None or result.errors is not None):
        message = "statistics of sigmas and errors are left out: the plan's scale changed; process the walk anew"
        findings.append(Finding(kind="statistics_left_out", file="", count=1, message=message, severity=Severity.INFO))
    turned = turned_result(result, changes)
    return turned.model_copy(
        update={
            "fingerprint": _fingerprint(result.fingerprint, changes),
            "distance_m": result.distance_m * own.scale,
            "sigma": None if rescaled else result.sigma,
            "errors": None if rescaled else result.errors,
            "findings": findings,
            "passes": None,
        }
    )


def turned_result(result: SessionResult, changes: Mapping[int, FrameChange]) -> SessionResult:
    """A result with every place that it tells of in the new frame of its floor."""
    own = changes[result.floor]
    return result.model_copy(
        update={
            "visits": [
                mark.model_copy(update={"position": _moved(mark.position, _on(mark.floor, own, changes))})
                for mark in result.visits
            ],
            "events": [
                mark.model_copy(update={"position": _moved(mark.position, _on(mark.floor, own, changes))})
                for mark in result.events
            ],
            "contradictions": [_contradiction(mark, changes[mark.floor]) for mark in result.contradictions],
            "drawing": _drawing(result.drawing, own),
            "elsewhere": {floor: _drawing(drawing, changes[floor]) for floor, drawing in result.elsewhere.items()},
        }
    )


def floors_of_result(result: SessionResult) -> set[int]:
    """Floors that a result tells of."""
    marked = [mark.floor for mark in result.visits]
    marked += [mark.floor for mark in result.events]
    marked += [mark.floor for mark in result.contradictions]
    return {result.floor, *result.elsewhere, *(floor for floor in marked if floor is not None)}


def _fingerprint(old: str, changes: Mapping[int, FrameChange]) -> str:
    """No longer what the old site's session would have: ``process`` must not take it for done."""
    said = "\n".join(changes[floor].model_dump_json() for floor in sorted(changes))
    return hashlib.sha256(f"{old}\n{said}".encode()).hexdigest()


def _on(floor: int | None, own: FrameChange, changes: Mapping[int, FrameChange]) -> Similarity2:
    return (own if floor is None else changes[floor]).new_T_old


def _moved(point: Pair | None, change: Similarity2) -> Pair | None:
    return None if point is None else _points([point], change)[0]


def _points(points: Polyline, change: Similarity2) -> Polyline:
    moved = (change @ np.array(points, dtype=np.float64).reshape(len(points), 2)).round(_DECIMALS) + 0.0
    return [(x, y) for x, y in moved.tolist()]


def _contradiction(mark: ContradictionMark, change: FrameChange) -> ContradictionMark:
    map_ = change.new_T_old
    (offset,) = _points([mark.offset_m], Similarity2(map_.a, 0j))
    (place,) = _points([mark.surveyed_m], map_)
    return mark.model_copy(
        update={
            "size_m": mark.size_m * map_.scale,
            "sigma_m": mark.sigma_m * map_.scale,
            "surveyed_m": place,
            "offset_m": offset,
        }
    )


def _drawing(drawing: Drawing, change: FrameChange) -> Drawing:
    map_ = change.new_T_old

    def stretches(old: list[Stretch]) -> list[Stretch]:
        return [
            each.model_copy(
                update={
                    "points": _points(each.points, map_),
                    "sigma_m": [sigma_m * map_.scale for sigma_m in each.sigma_m],
                }
            )
            for each in old
        ]

    return Drawing(
        mapped=stretches(drawing.mapped),
        discarded=stretches(drawing.discarded),
        raw=_points(drawing.raw, map_),
        wifi=_points(drawing.wifi, map_),
    )
