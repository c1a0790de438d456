from __future__ import annotations

import numpy as np
import pytest

from tests.evaluation.maps import floor_with, straight_walk
from tests.walks import landmarks_at
from vislam2tag.evaluation.control_points.press_truth import nearest_point_errors
from vislam2tag.evaluation.pooling import ErrorCurve
from vislam2tag.evaluation.reliability import CoverageCurve
from vislam2tag.views.error_figures import (
    control_point_errors,
    coverage_accuracy,
    error_by_landmark_movement,
    error_distributions,
    station_overlay,
)
from vislam2tag.views.panels import rendered

LANDMARKS = landmarks_at({"1": (0.0, 1.0), "2": (10.0, 1.0)})
FLOOR = floor_with(np.array([(2.0, 0.3), (6.0, 0.3)]), number=0)
PRESSES_NS = np.array([3, 7, 40]) * 10**9
"""At 2 m, 6 m, and after the walk."""


def test_labels_are_joined_to_their_control_points() -> None:
    walk = straight_walk()
    errors = nearest_point_errors(walk, PRESSES_NS, FLOOR)
    figure = control_point_errors(FLOOR, LANDMARKS, {"local": (walk, errors)})
    (axes,) = figure.axes
    assert axes.get_title(loc="left") == "(a) Local: 0.30 m"
    joined = [np.asarray(line.get_xydata()) for line in axes.lines if str(line.get_label()).startswith("_child")]
    np.testing.assert_allclose(joined, [[(2, 0.3), (2, 0)], [(6, 0.3), (6, 0)]], atol=1e-9)
    assert rendered(figure, "svg").startswith(b"<?xml")


def test_each_walk_is_a_point_by_its_movement() -> None:
    errors = {"local": np.array([0.2, 0.3]), "smoother": np.array([0.1, np.nan])}
    (axes,) = error_by_landmark_movement(np.array([0.01, 3.0]), errors).axes
    drawn = {line.get_label(): np.asarray(line.get_xydata()).tolist() for line in axes.lines}
    assert drawn["Local"] == [[0.01, 0.2], [3.0, 0.3]]
    assert drawn["Smoother"][0] == [0.01, 0.1]


def test_overlay_shows_the_measured_track_and_its_errors() -> None:
    walk = straight_walk(shift=(0.0, 0.5))
    errors = nearest_point_errors(walk, PRESSES_NS[:2], FLOOR)
    plan, below = station_overlay(FLOOR, LANDMARKS, "local", walk, errors).axes
    tracks = {line.get_label(): np.asarray(line.get_xydata()) for line in plan.lines}
    np.testing.assert_array_equal(tracks["total station"], errors.truth_bcs)
    np.testing.assert_allclose(np.asarray(below.lines[0].get_ydata(), dtype=np.float64), 0.2, atol=1e-9)


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
