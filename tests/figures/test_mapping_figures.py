from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes

from tests.evaluation.maps import floor_with
from tests.walks import corridor_walk, log_of, to_acs
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.similarity import Similarity2
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Landmarks, Trajectory
from vislam2tag.mapping.registry import strategy_named
from vislam2tag.mapping.settings import MappingSettings
from vislam2tag.views.error_figures import landmark_distances, local_mapping, strategies_compared
from vislam2tag.views.panels import rendered

BCS_T_ACS = Similarity2(np.exp(0.4j), 2 - 1j)
STATIONS = {"a": (5.0, 0.4), "b": (15.0, -0.4), "c": (30.0, 0.4)}
FLOOR = floor_with(np.zeros((0, 2)), number=0)

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
    figure = local_mapping(FLOOR, camera, log, landmarks, mapped_by("local", walk))
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
    figure = strategies_compared(FLOOR, walk[0], walk[1], walk[2], {"local": trajectory, "local-corrected": discarded})
    whole, broken = (max(lines_of(axes), key=len) for axes in figure.axes[1:])
    assert np.isnan(broken[500:600]).all()
    kept = np.isfinite(broken)
    np.testing.assert_array_equal(broken[kept], whole[kept])
    assert rendered(figure, "pdf").startswith(b"%PDF")
