from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.core.path_length import STEP_NS, step_frames, step_lengths, steps_without_jumps

S = 1_000_000_000


def test_one_frame_a_half_second_counted_from_the_first() -> None:
    time_ns = np.array([7 * S + 300_000_000 + step * 100_000_000 for step in range(12)])
    assert step_frames(time_ns).tolist() == [0, 5, 10]
    assert step_frames(time_ns[:0]).tolist() == []


def test_a_pause_is_one_step() -> None:
    time_ns = np.array([0, S // 10, 10 * S, 10 * S + S // 10])
    assert step_frames(time_ns).tolist() == [0, 2]


def test_jumps_and_unknown_steps_are_no_way() -> None:
    points = np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 12.0], [np.nan, np.nan], [3.0, 13.0]])
    steps_m = step_lengths(points)
    assert steps_m[:2].tolist() == [5.0, 8.0]
    assert steps_without_jumps(steps_m, np.arange(5) * S).tolist() == [5.0, 0.0, 0.0, 0.0]


@given(st.lists(st.integers(0, 3 * STEP_NS), min_size=1, max_size=30), st.data())
def test_a_part_that_is_known_is_never_longer_than_the_whole(gaps_ns: list[int], data: st.DataObject) -> None:
    time_ns = np.cumsum(gaps_ns).astype(np.int64)
    points = np.cumsum(np.ones((len(time_ns), 2)), axis=0) * 0.3
    known = np.array(data.draw(st.lists(st.booleans(), min_size=len(time_ns), max_size=len(time_ns))))
    part = np.where(known[:, None], points, np.nan)
    frames = step_frames(time_ns)
    whole_m, part_m = (
        steps_without_jumps(step_lengths(each[frames]), time_ns[frames]).sum() for each in (points, part)
    )
    assert part_m <= whole_m
