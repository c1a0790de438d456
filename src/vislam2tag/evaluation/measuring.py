"""One strategy in one session against one truth, reduced to its record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vislam2tag.common import log_bins
from vislam2tag.core.arrays import BoolArray, FloatArray
from vislam2tag.core.status import has_position
from vislam2tag.core.tracks import Trajectory
from vislam2tag.evaluation.metrics import FIGURES, summarise
from vislam2tag.evaluation.point_errors import PointErrors
from vislam2tag.evaluation.record import DenseFigures, Measured


def sure_points(points: PointErrors, max_sigma_m: float) -> PointErrors:
    """Take away the labels whose stated sigma exceeds ``max_sigma_m``, metres; labels without a sigma stay."""
    unsure = points.sigma_m > max_sigma_m
    return replace(points, label_bcs=np.where(unsure[:, None], np.nan, points.label_bcs))


def sure_frames(trajectory: Trajectory, max_sigma_m: float) -> BoolArray:
    """Mask (n,) of the frames with a position that is as sure as that."""
    return np.asarray(has_position(trajectory.status) & ~(trajectory.sigma_m > max_sigma_m))


def measured(points: PointErrors, way: str, strategy: str, dense: DenseFigures | None = None) -> Measured:
    """Reduce errors to the figures of one walk."""
    error = points.error_m[points.labelled]
    summary = summarise(points.error_m)
    return Measured(
        truth=points.kind,
        way=way,
        strategy=strategy,
        points=len(points),
        labelled=len(error),
        headed=int(np.isfinite(points.along_m).sum()),
        along_m=_mean(np.abs(points.along_m)),
        across_m=_mean(np.abs(points.across_m)),
        ahead_m=_mean(points.along_m),
        errors=log_bins.counts_of(error),
        sum_m=round(float(error.sum()), 6),
        sum_m2=round(float((error**2).sum()), 6),
        dense=dense,
        **{name: _rounded(getattr(summary, name)) for name in FIGURES},
    )


def retention(local: BoolArray, strategy: BoolArray) -> float | None:
    """Share of the frames labelled by ``local`` (n,) that a strategy (n,) labels; None where there are none."""
    return _rounded(float((local & strategy).sum() / local.sum())) if local.any() else None


def _mean(values: FloatArray) -> float | None:
    known = values[np.isfinite(values)]
    return _rounded(float(known.mean())) if len(known) else None


def _rounded(value: float) -> float | None:
    return round(value, 6) if np.isfinite(value) else None
