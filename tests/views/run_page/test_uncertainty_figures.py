from __future__ import annotations

import json

import numpy as np
import pytest

from vislam2tag.evaluation.reliability import CoverageCurve, ReliabilityCurve
from vislam2tag.views.uncertainty import coverage_figure, reliability_figure

COVERAGE = CoverageCurve(
    np.array([np.nan, 0.1, 0.4, 0.8]), np.array([0.1, 0.5, 0.8, 0.9]), np.array([1.0, 0.5, 0.6, 0.7]), np.full(4, 2.0)
)


def test_reliability_stands_against_the_diagonal() -> None:
    curve = ReliabilityCurve(np.arange(1, 100) / 100, np.linspace(0, 1, 99), 50)
    diagonal, labels = json.loads(reliability_figure(curve))["data"]
    assert diagonal["x"] == diagonal["y"] == [0, 100]
    assert labels["x"] == list(range(1, 100))
    assert labels["y"][49] == pytest.approx(50)


@pytest.mark.parametrize(("limit_m", "at"), [(0.5, [80.0]), (0.05, [10.0]), (9.0, [90.0]), (float("inf"), [])])
def test_coverage_marks_the_limit_that_is_set(limit_m: float, at: list[float]) -> None:
    figure = json.loads(coverage_figure(COVERAGE, limit_m))
    mean, p95 = figure["data"]
    assert mean["x"] == p95["x"] == [10, 50, 80, 90]
    assert (mean["y"], p95["y"]) == ([1.0, 0.5, 0.6, 0.7], [2.0] * 4)
    assert mean["hovertext"][:2] == ["no sigma stated", "sigma up to 0.10 m"]
    assert [shape["x0"] for shape in figure["layout"].get("shapes", [])] == at
