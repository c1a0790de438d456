"""Is the stated uncertainty true, and what does a limit on it cost and bring?

Errors and covariances reduce to counts (:class:`.ErrorRecord`) that add up over sessions; the
reliability and the coverage-accuracy curve follow from the counts alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from vislam2tag.common import log_bins
from vislam2tag.core.arrays import FloatArray
from vislam2tag.labeling.results import ErrorRecord, SigmaRow

_Key = TypeVar("_Key", int, str)

PERCENTS = 100
"""Bins of the regions' probabilities."""


def region_probability(error_m: FloatArray, covariance_m2: FloatArray) -> FloatArray:
    """Probability (n,) of the smallest region of N(0, P) that holds the error (n, 2), for covariances P (n, 2, 2).

    It is the chi-squared distribution (2 degrees of freedom) of the squared Mahalanobis distance, and uniform on 0 to 1
    where the errors are drawn from what is stated. NaN where an error or a covariance is not known, or P is singular.
    """
    ex, ey = error_m.T
    xx, xy, yy = covariance_m2[:, 0, 0], covariance_m2[:, 0, 1], covariance_m2[:, 1, 1]
    determinant = xx * yy - xy**2
    proper = (xx > 0) & (determinant > 0)
    squared = (yy * ex**2 - 2 * xy * ex * ey + xx * ey**2) / np.where(proper, determinant, np.nan)
    return np.asarray(-np.expm1(-squared / 2))


def reduce_errors(source: str, error_m: FloatArray, covariance_m2: FloatArray) -> ErrorRecord:
    """Count the errors (n, 2), NaN without a label, of one session by stated region, and by sigma and length."""
    labelled = np.isfinite(error_m).all(axis=1)
    probability = region_probability(error_m[labelled], covariance_m2[labelled])
    stated = probability[np.isfinite(probability)]
    inside = np.bincount(np.minimum((stated * PERCENTS).astype(np.int64), PERCENTS - 1), minlength=PERCENTS)
    length = np.linalg.norm(error_m[labelled], axis=1)
    sigma = np.sqrt(np.trace(covariance_m2[labelled], axis1=1, axis2=2) / 2)
    return ErrorRecord(sources={source: 1}, points=len(error_m), inside=inside.tolist(), rows=_rows(length, sigma))


def _rows(length_m: FloatArray, sigma_m: FloatArray) -> list[SigmaRow]:
    """Errors (n,) counted by the sigma (n,) stated, NaN where none is; metres."""
    known = np.isfinite(sigma_m)
    index = np.where(known, log_bins.bins_of(np.where(known, sigma_m, 0.0)), -1)
    return [
        SigmaRow(
            sigma=None if value < 0 else value,
            sum_m=round(float(length_m[index == value].sum()), 6),
            errors=log_bins.counts_of(length_m[index == value]),
        )
        for value in np.unique(index).tolist()
    ]


def added(first: ErrorRecord, second: ErrorRecord) -> ErrorRecord:
    """Add up two records; the sum is no larger than the bins allow."""
    rows = {row.sigma: row for row in first.rows}
    for row in second.rows:
        other = rows.get(row.sigma, SigmaRow(sigma=row.sigma, sum_m=0.0, errors={}))
        rows[row.sigma] = SigmaRow(
            sigma=row.sigma, sum_m=round(row.sum_m + other.sum_m, 6), errors=_summed(row.errors, other.errors)
        )
    return ErrorRecord(
        sources=_summed(first.sources, second.sources),
        points=first.points + second.points,
        inside=[a + b for a, b in zip(first.inside, second.inside, strict=True)],
        rows=[rows[sigma] for sigma in sorted(rows, key=lambda sigma: -1 if sigma is None else sigma)],
    )


def _summed(first: Mapping[_Key, int], second: Mapping[_Key, int]) -> dict[_Key, int]:
    total = Counter(first)
    total.update(second)
    return dict(sorted(total.items()))


@dataclass(frozen=True)
class ReliabilityCurve:
    """Share of the errors ``observed`` (99,) inside the region whose probability is ``stated`` (99,), 0.01 to 0.99."""

    stated: FloatArray
    observed: FloatArray
    errors: int


def reliability_curve(record: ErrorRecord) -> ReliabilityCurve | None:
    """Stated against observed shares; None where no label states a covariance. True uncertainty is the diagonal."""
    upto = np.cumsum(record.inside)
    if not len(upto) or upto[-1] == 0:
        return None
    stated = np.arange(1, PERCENTS) / PERCENTS
    return ReliabilityCurve(stated, upto[:-1] / upto[-1], int(upto[-1]))


@dataclass(frozen=True)
class CoverageCurve:
    """What remains labelled, and how good it is, at each limit of sigma (k,), rising.

    ``max_sigma_m`` is NaN for labels that state no sigma, which no limit marks; ``labelled`` is the share of the true
    points, 0 to 1; ``mean_m`` and ``p95_m`` are of the errors up to the limit, metres.
    """

    max_sigma_m: FloatArray
    labelled: FloatArray
    mean_m: FloatArray
    p95_m: FloatArray


def coverage_curve(record: ErrorRecord) -> CoverageCurve | None:
    """Share labelled against error as the limit of sigma rises; None where no true point has a label."""
    if not record.rows:
        return None
    limits = [np.nan if row.sigma is None else log_bins.lower_edge_m(row.sigma + 1) for row in record.rows]
    counts = np.cumsum([sum(row.errors.values()) for row in record.rows])
    upto: dict[int, int] = {}
    p95 = []
    for row in record.rows:
        upto = _summed(upto, row.errors)
        p95.append(log_bins.quantile_m(upto, 0.95))
    mean = np.cumsum([row.sum_m for row in record.rows]) / counts
    return CoverageCurve(np.array(limits), counts / record.points, mean, np.array(p95))
