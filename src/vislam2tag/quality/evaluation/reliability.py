"""Is the stated uncertainty true, and what does a limit on it cost and bring?

Errors and covariances reduce to counts (:class:`.ErrorRecord`) that add up over sessions; the
reliability and the coverage-accuracy curve follow from the counts alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

import numpy as np

from vislam2tag.common.error_statistics import FEWEST_WALKS, bins_of, counts_of, lower_edge_m, quantile_m
from vislam2tag.core.arrays import FloatArray
from vislam2tag.labeling.results import ErrorRecord, SigmaRow

_Key = TypeVar("_Key", int, str)

PERCENTS = 100
"""Bins of the regions' probabilities."""
MOST_TRUTH_PART = 0.5
"""Where more of an error's variance than this is the truth's own, on average, the truth cannot judge the labels."""
ABOUT_TRUE = 1.25
"""Stated sigmas within this factor of the true ones are called about true."""
_PERCENT = 68
"""The region by which that is judged."""


def region_probability(error_m: FloatArray, covariance_m2: FloatArray) -> FloatArray:
    """Probability (n,) of the smallest region of N(0, P) that contains the error (n, 2), for covariances P (n, 2, 2).

    It is the chi-squared distribution (2 degrees of freedom) of the squared Mahalanobis distance, and uniform on 0 to 1
    where the errors are drawn from what is stated. NaN where an error or a covariance is not known, or P is singular.
    """
    ex, ey = error_m.T
    xx, xy, yy = covariance_m2[:, 0, 0], covariance_m2[:, 0, 1], covariance_m2[:, 1, 1]
    determinant = xx * yy - xy**2
    proper = (xx > 0) & (determinant > 0)
    squared = (yy * ex**2 - 2 * xy * ex * ey + xx * ey**2) / np.where(proper, determinant, np.nan)
    return np.asarray(-np.expm1(-squared / 2))


def reduce_errors(
    source: str, error_m: FloatArray, covariance_m2: FloatArray, truth_covariance_m2: FloatArray
) -> ErrorRecord:
    """Count the errors (n, 2), NaN without a label, of one session by region, and by sigma and length.

    An error is the label's less the truth's, so its region is that of the sum of both covariances (n, 2, 2), m^2: of
    what the labels state and of the truth's own.
    """
    labelled = np.isfinite(error_m).all(axis=1)
    own_m2 = truth_covariance_m2[labelled]
    whole_m2 = covariance_m2[labelled] + own_m2
    probability = region_probability(error_m[labelled], whole_m2)
    known = np.isfinite(probability)
    stated = probability[known]
    truth_part = _variance(own_m2[known]) / _variance(whole_m2[known])
    inside = np.bincount(np.minimum((stated * PERCENTS).astype(np.int64), PERCENTS - 1), minlength=PERCENTS)
    length = np.linalg.norm(error_m[labelled], axis=1)
    return ErrorRecord(
        sources={source: 1},
        points=len(error_m),
        inside=inside.tolist(),
        rows=_rows(length, np.sqrt(_variance(covariance_m2[labelled]))),
        truth_part=round(float(truth_part.sum()), 6),
    )


def _variance(covariance_m2: FloatArray) -> FloatArray:
    """Variance (n,) along an axis, the mean of all, of covariances (n, 2, 2), m^2."""
    return np.asarray(np.trace(covariance_m2, axis1=1, axis2=2) / 2)


def _rows(length_m: FloatArray, sigma_m: FloatArray) -> list[SigmaRow]:
    """Errors (n,) counted by the sigma (n,) stated, NaN where none is; metres."""
    known = np.isfinite(sigma_m)
    index = np.where(known, bins_of(np.where(known, sigma_m, 0.0)), -1)
    return [
        SigmaRow(
            sigma=None if value < 0 else value,
            sum_m=round(float(length_m[index == value].sum()), 6),
            errors=counts_of(length_m[index == value]),
        )
        for value in np.unique(index).tolist()
    ]


def added(first: ErrorRecord, second: ErrorRecord) -> ErrorRecord:
    """Add up two records; the sum is not larger than the bins allow."""
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
        truth_part=round(first.truth_part + second.truth_part, 6),
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

    @property
    def times_as_large(self) -> float:
        """By how much errors are larger than stated, by the region that should contain 68 % of them; infinite where not
        even the largest does.
        """
        share = _PERCENT / PERCENTS
        if self.observed[-1] < share:
            return float("inf")
        region = float(np.interp(share, self.observed, self.stated))
        return float(np.sqrt(np.log1p(-region) / np.log1p(-share)))


class Verdict(StrEnum):
    """Whether stated uncertainty is true."""

    ABOUT_TRUE = "about true"
    TOO_SURE = "too sure"
    TOO_CAUTIOUS = "too cautious"


def verdict(record: ErrorRecord) -> Verdict | None:
    """Judge stated sigmas by a factor of :data:`ABOUT_TRUE`; None where truth or number of walks do not allow it.

    Errors of one walk are alike, so that fewer than :data:`.FEWEST_WALKS` of them say nothing.
    """
    curve = reliability_curve(record)
    if curve is None or sum(record.sources.values()) < FEWEST_WALKS:
        return None
    if curve.times_as_large > ABOUT_TRUE:
        return Verdict.TOO_SURE
    return Verdict.TOO_CAUTIOUS if curve.times_as_large < 1 / ABOUT_TRUE else Verdict.ABOUT_TRUE


def truth_can_tell(record: ErrorRecord) -> bool:
    """Whether the truth is exact enough to judge the labels' stated uncertainty."""
    return record.truth_part <= MOST_TRUTH_PART * sum(record.inside)


def reliability_curve(record: ErrorRecord) -> ReliabilityCurve | None:
    """Stated against observed shares; None where no label states a covariance or the truth cannot judge them.

    True uncertainty is the diagonal.
    """
    upto = np.cumsum(record.inside)
    if not len(upto) or upto[-1] == 0 or not truth_can_tell(record):
        return None
    stated = np.arange(1, PERCENTS) / PERCENTS
    return ReliabilityCurve(stated, upto[:-1] / upto[-1], int(upto[-1]))


@dataclass(frozen=True)
class CoverageCurve:
    """What remains labelled, and how good it is, at each limit of sigma (k,), rising.

    ``max_sigma_m`` is NaN for labels that state no sigma, which no limit marks. ``labelled`` is the share of the true
    points, 0 to 1. ``mean_m`` and ``p95_m`` are of the errors up to the limit, metres.
    """

    max_sigma_m: FloatArray
    labelled: FloatArray
    mean_m: FloatArray
    p95_m: FloatArray


def coverage_curve(record: ErrorRecord) -> CoverageCurve | None:
    """Share labelled against error as the limit of sigma rises; None where no true point has a label."""
    if not record.rows:
        return None
    limits = [np.nan if row.sigma is None else lower_edge_m(row.sigma + 1) for row in record.rows]
    counts = np.cumsum([sum(row.errors.values()) for row in record.rows])
    upto: dict[int, int] = {}
    p95 = []
    for row in record.rows:
        upto = _summed(upto, row.errors)
        p95.append(quantile_m(upto, 0.95))
    mean = np.cumsum([row.sum_m for row in record.rows]) / counts
    return CoverageCurve(np.array(limits), counts / record.points, mean, np.array(p95))
