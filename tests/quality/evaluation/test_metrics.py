from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.quality.evaluation.metrics import average, summarise


def test_summary() -> None:
    summary = summarise(np.array([1.0, 2.0, 3.0, np.nan]))
    assert (summary.count, summary.labelled_share, summary.mean_m) == (4, 0.75, 2.0)
    assert (summary.median_m, summary.p75_m, summary.p95_m, summary.max_m) == pytest.approx((2.0, 2.5, 2.9, 3.0))
    assert summary.rmse_m == pytest.approx((14 / 3) ** 0.5)
    nothing = summarise(np.array([np.nan]))
    assert nothing.labelled_share == 0
    assert np.isnan(nothing.mean_m)


def test_each_walk_counts_once() -> None:
    long, short, nothing = np.full(900, 1.0), np.array([3.0, np.nan]), np.array([np.nan])
    walks = average([summarise(errors) for errors in (long, short, nothing)])
    assert (walks.count, walks.mean_m, walks.max_m) == (903, 2.0, 2.0)
    assert walks.labelled_share == pytest.approx(0.5)
    assert np.isnan(average([]).mean_m)
