"""A session reduced to odometry and passes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import about_vertical, camera_track, loops, nothing_logged
from vislam2tag.estimation.noise import DriftSource
from vislam2tag.estimation.observations import WalkObservations


def test_nodes_are_the_first_frame_one_of_each_pass_and_the_last() -> None:
    walk = loops(1, marks=4, laps=1.3)
    observations = WalkObservations.of(*walk.logged(), range_m=6.0)
    assert observations.ids == walk.ids
    assert observations.nodes[0] == 0
    assert observations.nodes[-1] == len(walk.truth) - 1
    np.testing.assert_array_equal(observations.nodes[1:-1], observations.passes.at)


def test_a_walk_past_nothing_has_two_nodes() -> None:
    observations = WalkObservations.of(
        camera_track(np.linspace(0, 5, 50).astype(np.complex128), np.arange(50) / 10), nothing_logged(), 6.0
    )
    assert observations.nodes.tolist() == [0, 49]


def test_drift_grows_with_the_way_and_a_little_with_time() -> None:
    time_s = np.arange(200) / 10
    path = np.asarray(10 * np.tanh(time_s / 5), dtype=np.complex128)  # slows down and stands
    observations = WalkObservations.of(camera_track(path, time_s), nothing_logged(), 6.0)
    for source in (DriftSource.POSITION, DriftSource.HEADING):
        variance = observations.step_variance[source]
        assert variance[:50].mean() > 5 * variance[-3:].mean() > 0
    assert not observations.step_variance[DriftSource.JUMP].any()


def test_turning_lets_the_heading_drift_but_not_the_position() -> None:
    straight, curved = (
        WalkObservations.of(*loops(2, marks=2, laps=1, size_m=size).logged(), range_m=6.0)
        for size in ((60.0, 59.0), (2.5, 2.4))
    )
    per_metre = {
        name: {source: steps.sum() / walk.odometry.step_length_m.sum() for source, steps in walk.step_variance.items()}
        for name, walk in (("straight", straight), ("curved", curved))
    }
    assert per_metre["curved"][DriftSource.HEADING] > 1.2 * per_metre["straight"][DriftSource.HEADING]
    np.testing.assert_allclose(
        per_metre["curved"][DriftSource.POSITION], per_metre["straight"][DriftSource.POSITION], rtol=0.01
    )


def test_a_radian_counts_as_four_metres_fifty_seconds_as_one_and_a_leap_of_the_heading_little() -> None:
    time_s = np.arange(501) / 10
    camera = camera_track(np.zeros(501, dtype=np.complex128), time_s)
    turned_rad = {"still": np.zeros(501), "turns": np.minimum(time_s, 1.0), "leaps": np.where(time_s < 1, 0.0, 2.0)}
    heading_m = {}
    for name, angle_rad in turned_rad.items():
        turning = replace(camera, orientation_acs=about_vertical(angle_rad))
        variance = WalkObservations.of(turning, nothing_logged(), 6.0).step_variance
        assert variance[DriftSource.POSITION].sum() == pytest.approx(1.0)
        heading_m[name] = variance[DriftSource.HEADING].sum()
    assert heading_m == pytest.approx({"still": 1.0, "turns": 1.0 + 4.0, "leaps": 1.0 + 4.0 * 0.3})
