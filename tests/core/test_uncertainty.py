"""What is too uncertain says so by its status and keeps everything else."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.core.status import Status
from vislam2tag.core.tracks import Trajectory
from vislam2tag.core.uncertainty import mark_uncertain

SIGMAS = st.lists(st.one_of(st.just(float("nan")), st.floats(0.0, 5.0)), min_size=1, max_size=20)


def trajectory(sigma_m: list[float], status: list[int] | None = None) -> Trajectory:
    n = len(sigma_m)
    return Trajectory(
        np.arange(n, dtype=np.int64),
        np.random.default_rng(0).normal(size=(n, 3)),
        np.zeros((n, 4)),
        np.eye(2) * np.square(sigma_m)[:, None, None],
        np.array(status or [Status.OK] * n, dtype=np.int8),
    )


@given(SIGMAS, st.floats(0.01, 4.0))
def test_exactly_the_frames_above_the_limit_are_uncertain_and_nothing_is_lost(
    sigma_m: list[float], limit: float
) -> None:
    walk = trajectory(sigma_m)
    marked = mark_uncertain(walk, limit)
    np.testing.assert_array_equal(marked.status == Status.UNCERTAIN, walk.sigma_m > limit)
    assert set(marked.status) <= {Status.OK, Status.UNCERTAIN}
    np.testing.assert_array_equal(marked.position_bcs, walk.position_bcs)
    np.testing.assert_array_equal(marked.sigma_m, walk.sigma_m)
    assert (walk.status == Status.OK).all()


@given(SIGMAS)
def test_infinite_marks_nothing(sigma_m: list[float]) -> None:
    assert (mark_uncertain(trajectory(sigma_m), float("inf")).status == Status.OK).all()


def test_only_ok_becomes_uncertain() -> None:
    causes = [status for status in Status if status != Status.OK]
    walk = trajectory([9.0] * len(causes), list(causes))
    np.testing.assert_array_equal(mark_uncertain(walk, 0.5).status, walk.status)
