"""Positions between taps, and how honest their sigma is on real walks."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vislam2tag.core.interpolation import label_by_interpolation
from vislam2tag.core.status import Status
from vislam2tag.datasets.logged_walks import PACE_M2_S, TAP_SIGMA_M, Waypoints, trajectory_between

S = 1_000_000_000


def taps(*rows: tuple[float, float, float, int]) -> Waypoints:
    table = np.array(rows, dtype=float).reshape(-1, 4)
    return Waypoints.of((table[:, 0] * S).astype(np.int64), table[:, 1:3], table[:, 3].astype(np.int64))


def test_positions_lie_on_the_way_at_their_own_time() -> None:
    trajectory = trajectory_between(taps((10, 0, 0, 1), (20, 10, 5, 1), (24, 10, 9, 1)))
    labels = label_by_interpolation(np.array([10, 13, 20, 21, 24]) * S, trajectory, 1.0)
    assert labels.position_bcs[:, :2] == pytest.approx(np.array([[0, 0], [3, 1.5], [10, 5], [10, 6], [10, 9]]))
    assert np.isnan(labels.position_bcs[:, 2]).all()
    assert labels.floor.tolist() == [1] * 5


def test_sigma_grows_between_taps() -> None:
    trajectory = trajectory_between(taps((0, 0, 0, 1), (16, 16, 0, 1)))
    labels = label_by_interpolation(np.array([0, 4, 8, 12, 16]) * S, trajectory, 1.0)
    middle = np.sqrt(TAP_SIGMA_M**2 + PACE_M2_S * 4)
    assert labels.sigma_m[[0, 2, 4]] == pytest.approx([TAP_SIGMA_M, middle, TAP_SIGMA_M])
    assert labels.sigma_m[1] == pytest.approx(labels.sigma_m[3])
    assert TAP_SIGMA_M < labels.sigma_m[1] < middle


def test_nothing_is_known_outside_the_taps_nor_between_floors() -> None:
    trajectory = trajectory_between(taps((0, 0, 0, 1), (4, 4, 0, 1), (8, 4, 0, 2), (12, 0, 0, 2)))
    labels = label_by_interpolation(np.array([-1, 2, 5, 6, 7, 10, 13]) * S, trajectory, 1.0)
    expected = [Status.OUTSIDE_FRAMES, Status.OK, Status.GAP, Status.GAP, Status.GAP, Status.OK, Status.OUTSIDE_FRAMES]
    assert labels.status.tolist() == expected
    assert labels.floor[[1, 5]].tolist() == [1, 2]
    assert taps((0, 0, 0, 1), (4, 4, 0, 1), (8, 4, 9, 2)).leg_m.tolist() == [4, 0]


def test_nothing_is_known_between_taps_far_apart_in_time() -> None:
    apart = taps((0, 0, 0, 1), (4, 4, 0, 1), (10**9, 8, 0, 1), (10**9 + 4, 8, 4, 1))
    trajectory = trajectory_between(apart)
    labels = label_by_interpolation(np.array([2, 5, 10**8, 10**9 - 1, 10**9 + 2]) * S, trajectory, 1.0)
    assert labels.status.tolist() == [Status.OK, Status.GAP, Status.GAP, Status.GAP, Status.OK]
    assert len(trajectory.time_ns) < 50
    assert apart.leg_m.tolist() == [4, 0, 4]


@pytest.mark.parametrize("rows", [(), ((1, 2, 3, 0),)])
def test_too_few_taps_to_walk_between(rows: tuple[tuple[float, float, float, int], ...]) -> None:
    trajectory = trajectory_between(taps(*rows))
    assert trajectory.time_ns.tolist() == [row[0] * S for row in rows]
    labels = label_by_interpolation(np.array([2 * S]), trajectory, 1.0)
    assert labels.status.tolist() == [Status.OUTSIDE_FRAMES]


def test_of_two_taps_at_one_time_the_first_counts() -> None:
    both = taps((4, 7, 7, 1), (0, 0, 0, 1), (4, 9, 9, 1))
    assert both.position.tolist() == [[0, 0], [7, 7]]


@settings(max_examples=50)
@given(st.lists(st.tuples(st.integers(0, 10**12), st.integers(-50, 50), st.sampled_from([0, 1])), max_size=6))
def test_every_tap_is_a_frame_and_times_grow(rows: list[tuple[int, int, int]]) -> None:
    found = Waypoints.of(
        np.array([row[0] for row in rows], dtype=np.int64),
        np.array([(row[1], row[1]) for row in rows], dtype=float).reshape(-1, 2),
        np.array([row[2] for row in rows], dtype=np.int64),
    )
    trajectory = trajectory_between(found)
    assert np.all(np.diff(trajectory.time_ns) > 0)
    at = np.searchsorted(trajectory.time_ns, found.time_ns)
    assert trajectory.time_ns[at].tolist() == found.time_ns.tolist()
    assert trajectory.position_bcs[at, :2] == pytest.approx(found.position)
    assert np.all(trajectory.status[at] == Status.OK)
    assert trajectory.sigma_m[at] == pytest.approx(TAP_SIGMA_M)
    assert trajectory.floor[at].tolist() == found.floor.tolist()
