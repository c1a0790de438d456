"""A session reduced to odometry and passes."""

from __future__ import annotations

import numpy as np

from tests.drifting import camera_track, loops, nothing_logged
from vislam2tag.smoother.noise import Source
from vislam2tag.smoother.observations import Walked


def test_nodes_are_the_first_frame_one_of_each_pass_and_the_last() -> None:
    walk = loops(1, marks=4, laps=1.3)
    walked = Walked.of(*walk.logged(), range_m=6.0)
    assert walked.ids == walk.ids
    assert walked.nodes[0] == 0
    assert walked.nodes[-1] == len(walk.truth) - 1
    np.testing.assert_array_equal(walked.nodes[1:-1], walked.passes.at)


def test_a_walk_past_nothing_has_two_nodes() -> None:
    walked = Walked.of(
        camera_track(np.linspace(0, 5, 50).astype(np.complex128), np.arange(50) / 10), nothing_logged(), 6.0
    )
    assert walked.nodes.tolist() == [0, 49]


def test_drift_grows_with_the_way_and_a_little_with_time() -> None:
    time_s = np.arange(200) / 10
    path = np.asarray(10 * np.tanh(time_s / 5), dtype=np.complex128)  # slows down and stands
    walked = Walked.of(camera_track(path, time_s), nothing_logged(), 6.0)
    for source in (Source.POSITION, Source.HEADING):
        variance = walked.step_variance[source]
        assert variance[:50].mean() > 5 * variance[-3:].mean() > 0
    assert not walked.step_variance[Source.JUMP].any()


def test_turning_lets_the_heading_drift_but_not_the_position() -> None:
    straight, curved = (
        Walked.of(*loops(2, marks=2, laps=1, size_m=size).logged(), range_m=6.0) for size in ((60.0, 59.0), (2.5, 2.4))
    )
    per_metre = {
        name: {source: steps.sum() / walk.odometry.walked_m.sum() for source, steps in walk.step_variance.items()}
        for name, walk in (("straight", straight), ("curved", curved))
    }
    assert per_metre["curved"][Source.HEADING] > 1.2 * per_metre["straight"][Source.HEADING]
    np.testing.assert_allclose(per_metre["curved"][Source.POSITION], per_metre["straight"][Source.POSITION], rtol=0.01)
