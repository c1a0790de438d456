"""Landmarks of a session where other sessions tell that they hang."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.walks import landmarks_at
from vislam2tag.core.arrays import FloatArray
from vislam2tag.sessions.told_landmarks import ToldLandmarks


def shared(count: int) -> FloatArray:
    """Errors that all landmarks have in common, and some of their own."""
    return np.asarray(np.eye(3 * count) * 0.01 + 0.04, dtype=np.float64)


def told(*ids: str) -> ToldLandmarks:
    k = len(ids)
    return ToldLandmarks(
        ids,
        np.zeros(k, dtype=np.int64),
        np.arange(2.0 * k).reshape(k, 2),
        np.linspace(0.0, 0.1 * (k - 1), k),
        shared(k),
        sessions=3,
    )


SURVEY = replace(landmarks_at({"a": (1.0, 2.0), "b": (3.0, 4.0)}, sigma_m=0.1), source=("f:2", "f:3"))


def test_places_are_those_told_and_new_ones_are_added() -> None:
    given = told("c", "b").onto(SURVEY)
    assert given.ids == ("a", "b", "c")
    assert given.position_bcs.tolist() == [[1, 2], [2, 3], [0, 1]]
    assert given.heading_rad[1:].tolist() == [0.1, 0.0]
    assert given.source == ("f:2", "f:3", "")
    assert given.surveyed.all()


def test_errors_that_are_shared_stay_shared_and_others_apart() -> None:
    given = told("c", "b").onto(SURVEY)
    assert given.joint_covariance is not None
    rows = [4, 5, 2, 3, 8, 7]  # x, y of c and b, then their headings
    assert given.joint_covariance[np.ix_(rows, rows)] == pytest.approx(shared(2))
    assert given.joint_covariance[np.ix_([0, 1], [0, 1])] == pytest.approx(0.01 * np.eye(2))
    assert not given.joint_covariance[np.ix_([0, 1], rows)].any()
    assert given.covariance_bcs[1] == pytest.approx(0.01 * np.eye(2) + 0.04)
    assert given.heading_sigma_rad[1:] == pytest.approx(np.sqrt(0.05))


def test_the_part_of_some_landmarks_keeps_what_they_share() -> None:
    given = told("c", "b").onto(SURVEY)
    some = given.select([2, 0])
    assert some.joint_covariance is not None
    assert some.joint_covariance.shape == (6, 6)
    assert some.joint_covariance[0, 1] == pytest.approx(0.04)
    assert some.joint_covariance[0, 2] == 0


def test_an_unknown_heading_stays_unknown() -> None:
    one = replace(told("b"), heading_rad=np.array([np.nan])).onto(SURVEY)
    assert np.isnan([one.heading_rad[1], one.heading_sigma_rad[1]]).all()
