"""Errors reduced to what tables show: mean, median, root mean square, quantiles, maximum, share labelled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.core.arrays import FloatArray


@dataclass(frozen=True)
class ErrorSummary:
    """Statistics of label errors, metres; all but the counts are NaN where nothing is labelled."""

    count: int
    """Points asked for."""
    labelled_share: float
    """Share of them with a position."""
    mean_m: float
    median_m: float
    rmse_m: float
    p75_m: float
    p95_m: float
    max_m: float


FIGURES = ("mean_m", "median_m", "rmse_m", "p75_m", "p95_m", "max_m")
"""Fields of an :class:`ErrorSummary` in metres, in the order of every table."""
DIRECTED = ("along_m", "across_m", "ahead_m")
"""Errors along and across the direction of walking, and by how much labels are ahead; metres."""


def summarise(errors_m: FloatArray) -> ErrorSummary:
    """Reduce errors (n,), NaN where there is no label, to their statistics."""
    labelled = errors_m[np.isfinite(errors_m)]
    if labelled.size == 0:
        return ErrorSummary(len(errors_m), 0.0, *([float("nan")] * len(FIGURES)))
    median, *upper = np.quantile(labelled, (0.5, 0.75, 0.95, 1.0)).tolist()
    rmse = float(np.sqrt(np.mean(labelled**2)))
    return ErrorSummary(
        len(errors_m), labelled.size / len(errors_m), float(labelled.mean()), float(median), rmse, *upper
    )


def average(walks: Sequence[ErrorSummary]) -> ErrorSummary:
    """Average the walks' statistics, each walk counting once; walks without any label count in the share only."""
    labelled = [walk for walk in walks if walk.labelled_share > 0]
    figures = np.array([[getattr(walk, name) for name in FIGURES] for walk in labelled])
    means = figures.mean(axis=0).tolist() if labelled else [float("nan")] * len(FIGURES)
    share = float(np.mean([walk.labelled_share for walk in walks])) if walks else 0.0
    return ErrorSummary(sum(walk.count for walk in walks), share, *means)
