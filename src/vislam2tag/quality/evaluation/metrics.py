"""Errors reduced to what tables show: mean, median, root mean square, quantiles, maximum, share labelled.

Of one walk: of one strategy in one session against one truth.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vislam2tag.common import log_bins
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.quality.evaluation.point_errors import PointErrors
from vislam2tag.quality.evaluation.record import DenseFigures, StrategyErrors


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


def points_within_sigma(points: PointErrors, max_sigma_m: float) -> PointErrors:
    """Take away the labels whose stated sigma exceeds ``max_sigma_m``, metres; labels without a sigma stay."""
    unsure = points.sigma_m > max_sigma_m
    return replace(points, label_bcs=np.where(unsure[:, None], np.nan, points.label_bcs))


def frames_within_sigma(trajectory: Trajectory, max_sigma_m: float) -> BoolArray:
    """Mask (n,) of the frames with a position that is as sure as that."""
    return np.asarray(has_position(trajectory.status) & ~(trajectory.sigma_m > max_sigma_m))


def strategy_errors(
    points: PointErrors, method: str, strategy: str, dense: DenseFigures | None = None
) -> StrategyErrors:
    """Reduce errors to the figures of one walk."""
    error = points.error_m[points.labelled]
    summary = summarise(points.error_m)
    return StrategyErrors(
        truth=points.kind,
        method=method,
        strategy=strategy,
        points=len(points),
        labelled=len(error),
        headed=int(np.isfinite(points.along_m).sum()),
        along_m=_mean(np.abs(points.along_m)),
        across_m=_mean(np.abs(points.across_m)),
        ahead_m=_mean(points.along_m),
        errors=log_bins.counts_of(error),
        truth_sigma_m=_root_mean_square(points.truth_sigma_m),
        sum_m=round(float(error.sum()), 6),
        sum_m2=round(float((error**2).sum()), 6),
        dense=dense,
        **{name: _rounded(getattr(summary, name)) for name in FIGURES},
    )


def retention(local: BoolArray, strategy: BoolArray) -> float | None:
    """Share of the frames labelled by ``local`` (n,) that a strategy (n,) labels; None where there are none."""
    return _rounded(float((local & strategy).sum() / local.sum())) if local.any() else None


def _root_mean_square(values: FloatArray) -> float | None:
    """Over the values (n,) that are known; None where none is."""
    known = values[np.isfinite(values)]
    return _rounded(float(np.sqrt(np.mean(known**2)))) if len(known) else None


def _mean(values: FloatArray) -> float | None:
    """Mean of the finite ones of values (n,); None where there is none."""
    known = values[np.isfinite(values)]
    return _rounded(float(known.mean())) if len(known) else None


def _rounded(value: float) -> float | None:
    return round(value, 6) if np.isfinite(value) else None
