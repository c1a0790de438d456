"""Visits and boundaries on hand-made walks."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.walks import camera_on, log_of, rows_of_log, to_acs
from vislam2tag.core.tracks import CameraTrack, LandmarkLog, Visit
from vislam2tag.core.visits import boundaries_of_loss, find_visits, frames_without_landmark, merge_boundaries


def straight(x: list[float], lost: list[int] | None = None) -> tuple[CameraTrack, LandmarkLog]:
    camera = camera_on(np.column_stack((x, np.zeros(len(x)))))
    position = to_acs(np.tile([5.0, 0.5], (len(x), 1)), 1.4)
    mask = np.isin(np.arange(len(x)), lost or [])
    return camera, log_of(camera, {"7": position}, mask)


def test_one_visit_a_run_at_the_least_distance() -> None:
    camera, log = straight([3, 4.5, 4.9, 5.2, 7, 5.4, 5.1, 9])
    visits = find_visits(camera, log, 1.0)
    assert [(visit.frame, visit.landmark) for visit in visits] == [(2, "7"), (6, "7")]
    assert visits[0].distance_m == pytest.approx(np.hypot(0.1, 0.5))


def test_runs_of_one_frame_and_minima_at_the_last_frame_count() -> None:
    camera, log = straight([3, 5, 7, 4.5, 4.9])
    assert [visit.frame for visit in find_visits(camera, log, 1.0)] == [1, 4]


def test_lost_rows_are_no_visit_and_split_a_run() -> None:
    camera, log = straight([4.8, 4.9, 5.0, 5.1, 5.2], lost=[2])
    assert [visit.frame for visit in find_visits(camera, log, 1.0)] == [1, 3]


def test_distance_is_three_dimensional() -> None:
    camera = camera_on(np.array([[5.0, 0.5]]), height=0.2)
    log = log_of(camera, {"7": to_acs(np.array([[5.0, 0.5]]), 1.4)})
    assert find_visits(camera, log, 1.0) == ()
    assert len(find_visits(camera, log, 1.3)) == 1


def test_unusable_frames_do_not_split_a_run() -> None:
    camera, log = straight([4.8, 4.9, 99, 5.0, 5.1])
    camera.status[2] = 10
    assert [visit.frame for visit in find_visits(camera, rows_of_log(log, log.frame != 2), 1.0)] == [3]


def test_boundaries_of_loss_are_the_ends_of_each_run() -> None:
    camera, log = straight([0, 1, 2, 3, 4, 5, 6], lost=[2, 3, 5])
    assert np.flatnonzero(frames_without_landmark(camera, log)).tolist() == [2, 3, 5]
    assert [visit.frame for visit in boundaries_of_loss(camera, log)] == [2, 3, 5, 5]


def test_frames_before_the_first_sighting_are_without_landmark() -> None:
    camera = camera_on(np.zeros((4, 2)))
    position = np.zeros((4, 3))
    position[:2] = np.nan
    log = log_of(camera, {"1": position + 0.1})
    assert [visit.frame for visit in boundaries_of_loss(camera, log)] == [0, 1]


@given(st.lists(st.tuples(st.integers(0, 50), st.sampled_from(["", "1", "2"])), max_size=20))
def test_merging_keeps_no_equal_neighbours_and_the_first_of_each(raw: list[tuple[int, str]]) -> None:
    boundaries = tuple(Visit(frame, landmark, 0.0) for frame, landmark in raw)
    merged = merge_boundaries(boundaries)
    names = [visit.landmark for visit in merged]
    assert all(a != b for a, b in pairwise(names))
    assert [visit.frame for visit in merged] == sorted(visit.frame for visit in merged)
    assert merge_boundaries(merged) == merged
    if boundaries:
        assert merged[0].frame == min(frame for frame, _ in raw)
