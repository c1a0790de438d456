"""Labels between frames: linear, never across a discarded stretch or a long gap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.core.interpolation import label_by_interpolation, label_by_next_frame
from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory

S = 10**9


def trajectory(time_s: list[float], x: list[float], status: list[Status]) -> Trajectory:
    n = len(time_s)
    position = np.column_stack((x, np.zeros(n), np.full(n, np.nan)))
    position[np.array(status) != Status.OK] = np.nan
    return Trajectory(
        (np.array(time_s) * S).astype(np.int64),
        position,
        np.full((n, 4), np.nan),
        np.full((n, 2, 2), np.nan),
        np.array(status, dtype=np.int8),
    )


def labelled(walk: Trajectory, time_s: list[float], max_gap_s: float = 1.0) -> tuple[list[float], list[str]]:
    labels = label_by_interpolation((np.array(time_s) * S).astype(np.int64), walk, max_gap_s)
    return labels.position_bcs[:, 0].tolist(), [Status(code).label for code in labels.status]


def test_linear_between_frames_exact_at_them() -> None:
    walk = trajectory([0, 0.5, 1], [0, 1, 4], [Status.OK] * 3)
    x, status = labelled(walk, [0, 0.25, 0.5, 0.75, 1])
    assert x == pytest.approx([0, 0.5, 1, 2.5, 4])
    assert status == ["ok"] * 5


def test_outside_the_frames() -> None:
    walk = trajectory([1, 1.5], [0, 1], [Status.OK] * 2)
    x, status = labelled(walk, [0.999, 1.501])
    assert status == ["outside_frames"] * 2
    assert np.isnan(x).all()


def test_never_across_a_discarded_stretch() -> None:
    causes = [Status.OK, Status.TRACKING_LOST, Status.TRACKING_LOST, Status.OK, Status.BREAK, Status.OK]
    walk = trajectory([0, 0.1, 0.2, 0.3, 0.4, 0.5], [0] * 6, causes)
    x, status = labelled(walk, [0.05, 0.15, 0.25, 0.3, 0.35, 0.45])
    assert status == ["tracking_lost", "tracking_lost", "tracking_lost", "ok", "break", "break"]
    assert np.isnan(x).tolist() == [True, True, True, False, True, True]


def test_gap_is_longer_than_max_gap() -> None:
    walk = trajectory([0, 1, 2.5], [0, 1, 2], [Status.OK] * 3)
    assert labelled(walk, [0.5, 1, 2])[1] == ["ok", "ok", "gap"]
    assert labelled(walk, [0.5, 2], max_gap_s=2)[1] == ["ok", "ok"]


def test_unusable_frames_are_skipped_and_named_where_long() -> None:
    walk = trajectory(
        [0, 0.1, 0.2, 5, 5.1, 9],
        [0, 9, 2, 3, 3, 4],
        [Status.OK, Status.INVALID, *[Status.OK] * 2, Status.INVALID, Status.OK],
    )
    x, status = labelled(walk, [0.1, 3, 7])
    assert status == ["ok", "gap", "invalid"]
    assert x[0] == pytest.approx(1)


def test_uncertain_is_kept() -> None:
    walk = trajectory([0, 0.1, 0.2], [0, 1, 2], [Status.OK] * 3)
    walk.status[1] = Status.UNCERTAIN
    assert labelled(walk, [0.05, 0.1])[1] == ["uncertain", "uncertain"]


def test_no_frame_at_all() -> None:
    empty = trajectory([], [], [])
    times = np.array([5], dtype=np.int64)
    for labels in (label_by_interpolation(times, empty, 1.0), label_by_next_frame(times, empty)):
        assert labels.status.tolist() == [Status.OUTSIDE_FRAMES]


def test_next_frame_rule() -> None:
    walk = trajectory([0, 1, 2, 3], [0, 1, 2, 3], [Status.BEFORE_FIRST_LANDMARK, Status.OK, Status.OK, Status.BREAK])
    labels = label_by_next_frame((np.array([0, 0.2, 1, 1.1, 2.5, 3.1]) * S).astype(np.int64), walk)
    assert [Status(code).label for code in labels.status] == [
        "before_first_landmark", "ok", "ok", "ok", "break", "outside_frames",
    ]  # fmt: skip
    np.testing.assert_array_equal(labels.position_bcs[1:4, 0], [1, 1, 2])


@given(
    st.lists(st.integers(1, 900_000_000), min_size=2, max_size=30),
    st.integers(0, 2**32 - 1),
)
def test_a_straight_uniform_walk_is_reproduced_anywhere(steps_ns: list[int], seed: int) -> None:
    time_ns = np.cumsum(steps_ns).astype(np.int64)
    position = np.column_stack((time_ns * 1.3e-9, time_ns * -0.4e-9, time_ns * 1e-10))
    n = len(time_ns)
    walk = Trajectory(time_ns, position, np.zeros((n, 4)), np.ones((n, 2, 2)), np.zeros(n, dtype=np.int8))
    at = np.random.default_rng(seed).integers(time_ns[0], time_ns[-1], 20, endpoint=True)
    labels = label_by_interpolation(at, walk, 1.0)
    assert (labels.status == Status.OK).all()
    np.testing.assert_allclose(labels.position_bcs, np.column_stack((at * 1.3e-9, at * -0.4e-9, at * 1e-10)), atol=1e-6)


def test_height_is_interpolated_and_the_floor_is_the_nearer_frames() -> None:
    walk = trajectory([0, 1, 2], [0, 0, 0], [Status.OK] * 3)
    walk.position_bcs[:, 2] = 1.0, 2.0, 4.0
    walk = replace(walk, floor=np.array([0, 1, 3]))
    time_ns = (np.array([-1, 0, 0.4, 0.6, 1, 1.75, 9]) * S).astype(np.int64)
    labels = label_by_interpolation(time_ns, walk, 2.0)
    assert labels.position_bcs[1:-1, 2] == pytest.approx([1.0, 1.4, 1.6, 2.0, 3.5])
    assert labels.floor.tolist() == [0, 0, 0, 1, 1, 3, 3]
    assert label_by_next_frame(time_ns, walk).floor.tolist() == [0, 0, 1, 1, 1, 3, 3]


def test_where_the_trajectory_tells_no_floors_labels_do_not() -> None:
    walk = trajectory([0, 1], [0, 0], [Status.OK] * 2)
    nobody = trajectory([], [], [])
    time_ns = np.array([S // 2])
    for labels in (label_by_interpolation(time_ns, walk, 2.0), label_by_next_frame(time_ns, walk)):
        assert len(labels.floor) == 0
    assert len(label_by_interpolation(time_ns, nobody, 2.0).floor) == 0
