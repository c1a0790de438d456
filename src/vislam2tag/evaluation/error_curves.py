"""Cumulative distributions of errors, with bands, from the sessions' counts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vislam2tag.common import log_bins
from vislam2tag.common.bootstrap import FEWEST_WALKS, LEVEL, draws, multiplicities
from vislam2tag.core.arrays import FloatArray
from vislam2tag.evaluation.record import Measured


@dataclass(frozen=True)
class ErrorCurve:
    """Share (k,) of *all* true points whose label is at most ``error_m`` (k,) off: it ends at the share labelled.

    ``low`` and ``high`` (k,) bound it in 95 of 100 such surveys; None of too few walks.
    """

    error_m: FloatArray
    share: FloatArray
    low: FloatArray | None
    high: FloatArray | None


def error_curve(walks: Sequence[Measured]) -> ErrorCurve | None:
    """Add up the walks of one strategy against one truth; None where no point has a label."""
    errors = np.zeros((len(walks), log_bins.BINS))
    for row, one in zip(errors, walks, strict=True):
        row[list(one.errors)] = list(one.errors.values())
    used = np.flatnonzero(errors.any(axis=0))
    if not len(used):
        return None
    bins = np.arange(max(used[0] - 1, 0), used[-1] + 1)
    upto = np.cumsum(errors, axis=1)[:, bins]
    points = np.array([one.points for one in walks], dtype=np.float64)
    low, high = None, None
    if len(walks) >= FEWEST_WALKS:
        times = multiplicities(draws(len(walks)))
        shares = (times @ upto) / (times @ points)[:, None]
        low, high = np.quantile(shares, ((1 - LEVEL) / 2, (1 + LEVEL) / 2), axis=0)
    edges = np.array([log_bins.lower_edge_m(int(index) + 1) for index in bins])
    return ErrorCurve(edges, upto.sum(axis=0) / points.sum(), low, high)
