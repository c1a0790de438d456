"""What dense truth tells of each strategy, summed over sessions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vislam2tag.evaluation.dense import SINCE_EDGES_M, SPEED_EDGES_M_S, drift_per_metre
from vislam2tag.evaluation.evaluation_record import Bin, DenseFigures, DenseRow, SessionEvaluation

RELATIVE, SINCE_LANDMARK, SPEED = "relative error", "since landmark", "speed"


def dense_rows(sessions: Sequence[SessionEvaluation], strategies: Sequence[str]) -> list[DenseRow]:
    """Rows of each strategy: relative errors, errors by the way since the last landmark, and by speed."""
    rows = []
    for strategy in strategies:
        figures = _figures(sessions, strategy)
        if figures:
            rows += _relative_rows(strategy, figures)
            since, speed = ([getattr(one, name) for one in figures] for name in ("since_landmark", "speed"))
            rows += _bin_rows(strategy, SINCE_LANDMARK, SINCE_EDGES_M, since)
            rows += _bin_rows(strategy, SPEED, SPEED_EDGES_M_S, speed)
    return rows


def survey_drift(sessions: Sequence[SessionEvaluation], strategies: Sequence[str]) -> dict[str, float | None]:
    """By how much each strategy's error grows with a metre since the last landmark; none without dense truth."""
    found = {}
    for strategy in strategies:
        figures = _figures(sessions, strategy)
        if figures:
            slope = drift_per_metre([one.drift for one in figures])
            found[strategy] = None if slope is None else round(slope, 6)
    return found


def _figures(sessions: Sequence[SessionEvaluation], strategy: str) -> list[DenseFigures]:
    return [
        one.dense
        for session in sessions
        for one in session.measured
        if one.strategy == strategy and one.dense is not None
    ]


def _relative_rows(strategy: str, figures: Sequence[DenseFigures]) -> list[DenseRow]:
    rows = []
    for same in zip(*(one.relative for one in figures), strict=True):
        pairs, way = sum(one.pairs for one in same), same[0].distance_m
        rows.append(
            DenseRow(
                strategy=strategy,
                what=RELATIVE,
                low=way,
                high=way,
                points=pairs,
                mean_m=round(sum(one.sum_m for one in same) / pairs, 4) if pairs else None,
                rmse_m=round((sum(one.sum_m2 for one in same) / pairs) ** 0.5, 4) if pairs else None,
            )
        )
    return rows


def _bin_rows(strategy: str, what: str, edges: Sequence[float], sessions: Sequence[Sequence[Bin]]) -> list[DenseRow]:
    """One row for each bin in which there are points."""
    rows = []
    for low, high, same in zip(edges, edges[1:], zip(*sessions, strict=True), strict=False):
        points, labelled = sum(one.points for one in same), sum(one.labelled for one in same)
        if points:
            rows.append(
                DenseRow(
                    strategy=strategy,
                    what=what,
                    low=low,
                    high=high if np.isfinite(high) else None,
                    points=points,
                    mean_m=round(sum(one.sum_m for one in same) / labelled, 4) if labelled else None,
                    labelled=round(labelled / points, 4),
                )
            )
    return rows
