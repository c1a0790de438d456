from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.evaluation.pooling import ErrorCurve
from vislam2tag.evaluation.reliability import CoverageCurve
from vislam2tag.figures.error_figures import coverage_accuracy, error_distributions


def test_distributions_end_at_the_share_labelled() -> None:
    share = np.array([0.0, 0.5, 0.9])
    curve = ErrorCurve(np.array([0.1, 0.2, 0.4]), share, share - 0.05, share + 0.05)
    figure = error_distributions({"local": curve, "smoother": ErrorCurve(curve.error_m, share, None, None)})
    (axes,) = figure.axes
    assert [line.get_label() for line in axes.lines] == ["Local (90 % labelled)", "Smoother (90 % labelled)"]
    assert len(axes.collections) == 1


@pytest.mark.parametrize("labelled", [(0.8,), (0.01, 0.3, 0.8)])
def test_strategies_without_sigma_are_points(labelled: tuple[float, ...]) -> None:
    k = np.array(labelled)
    (axes,) = coverage_accuracy({"local": CoverageCurve(k, k, 0.1 + k, 0.2 + k)}).axes
    shown = np.asarray(axes.lines[0].get_xdata()).tolist()
    assert shown == [x for x in labelled if x >= 0.05]
    assert axes.lines[0].get_marker() == ("o" if len(shown) == 1 else "")
