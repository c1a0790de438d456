from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.core.arrays import FloatArray
from vislam2tag.quality.evaluation.point_errors import PointErrors, TruthKind, walking_heading

SECOND = 1_000_000_000


def errors_at_origin(label: FloatArray, heading: FloatArray) -> PointErrors:
    count = len(label)
    time_ns = np.arange(count) * SECOND
    return PointErrors(TruthKind.DENSE, time_ns, np.zeros((count, 2)), label, np.ones(count), heading, np.zeros(count))


def test_ahead_and_left_of_a_northward_walk() -> None:
    found = errors_at_origin(np.array([[0.0, 2.0], [-3.0, 0.0]]), np.full(2, np.pi / 2))
    assert found.along_m == pytest.approx([2.0, 0.0])
    assert found.across_m == pytest.approx([0.0, 3.0])


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-7, 7))
def test_along_and_across_make_up_the_error(x: float, y: float, heading: float) -> None:
    found = errors_at_origin(np.array([[x, y]]), np.array([heading]))
    assert np.hypot(found.along_m, found.across_m) == pytest.approx(found.error_m, abs=1e-12)


def test_without_a_label_or_a_heading_nothing_is_told() -> None:
    found = errors_at_origin(np.array([[np.nan, np.nan], [1.0, 1.0]]), np.array([0.0, np.nan]))
    assert found.labelled.tolist() == [False, True]
    assert np.isnan(found.error_m).tolist() == [True, False]
    assert np.isnan(found.along_m).all()
    assert len(found.select(found.labelled)) == 1


def test_arrays_of_different_length_are_refused() -> None:
    with pytest.raises(ValueError, match="same number"):
        errors_at_origin(np.zeros((2, 2)), np.zeros(3))


def test_direction_of_walking_and_of_standing() -> None:
    time_ns = np.arange(0, 20 * SECOND, SECOND // 10)
    x = np.minimum(time_ns * 1e-9, 10.0)
    heading = walking_heading(np.array([5, 15]) * SECOND, time_ns, np.column_stack((x, -x)))
    assert heading[0] == pytest.approx(-np.pi / 4)
    assert np.isnan(heading[1])


def test_no_direction_across_an_unknown_stretch() -> None:
    time_ns = np.arange(10) * SECOND
    path = np.column_stack((np.arange(10.0), np.zeros(10)))
    path[5] = np.nan
    heading = walking_heading(np.array([2, 5, 8]) * SECOND, time_ns, path)
    assert np.isfinite(heading).tolist() == [True, False, True]
