from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes

from tests.quality.evaluation.maps import floor_with, straight_walk
from tests.walks import corridor_walk, landmarks_at, log_of, to_acs
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.core.transforms import Similarity2
from vislam2tag.estimation.settings import MappingSettings
from vislam2tag.estimation.strategy import strategy_named
from vislam2tag.quality.evaluation.metrics import ErrorCurve
from vislam2tag.quality.evaluation.press_truth import nearest_point_errors
from vislam2tag.quality.evaluation.reliability import CoverageCurve
from vislam2tag.views.error_figures import (
    control_point_errors,
    coverage_accuracy,
    error_by_landmark_movement,
    error_distributions,
    landmark_distances,
    local_mapping,
    station_overlay,
    strategies_compared,
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
    assert axes.get_title(loc="left") == "Local: 0.30 m"
    (joined,) = (line for line in axes.lines if line.get_label() == "_nolegend_")
    gap = (np.nan, np.nan)
    np.testing.assert_allclose(lines_of(axes)[axes.lines.index(joined)], [(2, 0.3), (2, 0), gap, (6, 0.3), (6, 0)])
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
    assert len(axes.patches) == 1


@pytest.mark.parametrize("labelled", [(0.8,), (0.01, 0.3, 0.8)])
def test_strategies_without_sigma_are_points(labelled: tuple[float, ...]) -> None:
    k = np.array(labelled)
    (axes,) = coverage_accuracy({"local": CoverageCurve(k, k, 0.1 + k, 0.2 + k)}).axes
    shown = np.asarray(axes.lines[0].get_xdata()).tolist()
    assert shown == [100 * x for x in labelled if x >= 0.05]
    assert axes.lines[0].get_marker() == "o"


BCS_T_ACS = Similarity2(np.exp(0.4j), 2 - 1j)
STATIONS = {"a": (5.0, 0.4), "b": (15.0, -0.4), "c": (30.0, 0.4)}
WALKED_FLOOR = floor_with(np.zeros((0, 2)), number=0)

Walk = tuple[CameraTrack, LandmarkLog, Landmarks, FloatArray]


@pytest.fixture
def walk() -> Walk:
    return corridor_walk(BCS_T_ACS, STATIONS)


def mapped_by(name: str, walk: Walk) -> Trajectory:
    return strategy_named(name, MappingSettings()).map(*walk[:3])


def lines_of(axes: Axes) -> list[FloatArray]:
    """Points (n, 2) of each line."""
    return [np.asarray(line.get_xydata(), dtype=np.float64) for line in axes.lines]


def test_distances_are_those_of_the_log(walk: Walk) -> None:
    camera, log = walk[:2]
    visits = mapped_by("local", walk).visits
    (axes,) = landmark_distances(camera, log, visits, 1.0).axes
    drawn = {line.get_label(): np.asarray(line.get_ydata(), dtype=np.float64) for line in axes.lines}
    assert {name: np.nanmin(drawn[name]) for name in STATIONS} == pytest.approx(
        {visit.landmark: visit.distance_m for visit in visits}
    )
    assert [text.get_text() for text in axes.texts] == list(STATIONS)


def test_lost_landmarks_have_no_distance(walk: Walk) -> None:
    camera = walk[0]
    lost = np.zeros(len(camera.time_ns), dtype=bool)
    lost[300:400] = True
    place = np.repeat(to_acs(BCS_T_ACS.inverse @ np.array([(5.0, 0.4)]), 1.4), len(lost), axis=0)
    (axes,) = landmark_distances(camera, log_of(camera, {"a": place}, lost), (), 1.0).axes
    (distance,) = (lines[:, 1] for lines in lines_of(axes)[:1])
    assert np.isnan(distance[lost]).all()
    assert np.isfinite(distance[~lost]).all()


def test_sub_trajectories_are_placed_one_after_another(walk: Walk) -> None:
    camera, log, landmarks, truth = walk
    figure = local_mapping(WALKED_FLOOR, camera, log, landmarks, mapped_by("local", walk))
    assert [axes.get_title(loc="left") for axes in figure.axes] == [
        "(a) Sub-trajectories as recorded",
        "(b) 1 of 2 placed",
        "(c) 2 of 2 placed",
    ]
    drawn = [points for points in lines_of(figure.axes[2]) if len(points) > len(STATIONS)]
    placed = np.concatenate(drawn)
    first = np.flatnonzero(np.isclose(truth[:, 0], placed[0, 0], atol=1e-6))[0]
    np.testing.assert_allclose(placed, truth[first : first + len(placed)], atol=1e-6)


def test_discarded_frames_are_not_drawn(walk: Walk) -> None:
    trajectory = mapped_by("local", walk)
    position, status = trajectory.position_bcs.copy(), trajectory.status.copy()
    position[500:600], status[500:600] = np.nan, Status.BREAK
    discarded = replace(trajectory, position_bcs=position, status=status)
    figure = strategies_compared(
        WALKED_FLOOR, walk[0], walk[1], walk[2], {"local": trajectory, "local-corrected": discarded}
    )
    whole, broken = (max(lines_of(axes), key=len) for axes in figure.axes[1:])
    assert np.isnan(broken[500:600]).all()
    kept = np.isfinite(broken)
    np.testing.assert_array_equal(broken[kept], whole[kept])
    assert rendered(figure, "pdf").startswith(b"%PDF")
