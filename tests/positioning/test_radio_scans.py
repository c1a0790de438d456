"""Scans as sparse rows: made of readings in any order, cut by rows, seen over other access points.

Representations keep the order of levels and end at 0 and 1.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from vislam2tag.positioning.radio_scans import RadioScans, Representation, represented, scans_from_readings

NAMES = tuple(f"ap{index}" for index in range(6))


def scans_from(matrix: np.ndarray) -> RadioScans:
    rows, columns = np.nonzero(~np.isnan(matrix))
    names = np.array(NAMES, dtype=np.str_)[columns]
    return scans_from_readings(rows, names, matrix[rows, columns], len(matrix)).over(NAMES)


MATRICES = hnp.arrays(
    np.float64,
    st.tuples(st.integers(1, 8), st.just(len(NAMES))),
    elements=st.one_of(st.just(np.nan), st.integers(-100, -20).map(float)),
)


@given(MATRICES, st.data())
def test_rows_are_those_of_the_matrix(matrix: np.ndarray, data: st.DataObject) -> None:
    scans = scans_from(matrix)
    np.testing.assert_array_equal(scans.dense(), matrix)
    rows = np.array(data.draw(st.lists(st.integers(0, len(matrix) - 1), max_size=10)), dtype=np.int64)
    np.testing.assert_array_equal(scans[rows].dense(), matrix[rows])
    mask = np.isnan(matrix[:, 0])
    np.testing.assert_array_equal(scans[mask].dense(), matrix[mask])


@given(MATRICES, st.permutations(range(len(NAMES))), st.integers(1, len(NAMES)))
def test_other_columns_are_those_of_the_matrix(matrix: np.ndarray, order: list[int], kept: int) -> None:
    some = [NAMES[column] for column in order[:kept]]
    seen = scans_from(matrix).over(["not heard here", *some])
    np.testing.assert_array_equal(seen.dense()[:, 1:], matrix[:, order[:kept]])
    assert np.isnan(seen.dense()[:, 0]).all()


def test_several_readings_of_one_access_point_are_averaged_and_bad_levels_are_not_heard() -> None:
    rows = np.array([1, 1, 0, 1, 0])
    names = np.array(["b", "a", "b", "b", "a"], dtype=np.str_)
    scans = scans_from_readings(rows, names, np.array([-60.0, -50.0, np.nan, -70.0, -40.0]), 3)
    assert scans.access_points == ("a", "b")
    np.testing.assert_array_equal(scans.dense(-110.0), [[-40, -110], [-50, -65], [-110, -110]])
    np.testing.assert_array_equal(scans.heard, [1, 2, 0])


def test_no_reading_at_all() -> None:
    scans = scans_from_readings(np.empty(0, np.int64), np.empty(0, np.str_), np.empty(0), 2)
    assert scans.shape == (2, 0)
    assert scans.over(NAMES).dense().shape == (2, 6)


@pytest.mark.parametrize("representation", Representation)
def test_louder_is_more_and_not_heard_is_nothing(representation: Representation) -> None:
    levels = np.array([[np.nan, -104.0, -90.0, -60.0, -30.0, 0.0]])
    numbers = represented(scans_from(levels), representation)[0]
    assert numbers[0] == 0
    assert (np.diff(numbers) > 0).all()
    assert numbers[-1] == pytest.approx(1.0)


def test_strong_levels_count_more_when_powed() -> None:
    levels = scans_from(np.array([[-90.0, -80.0, -50.0, -40.0, np.nan, np.nan]]))
    positive, powed = (represented(levels, kind)[0] for kind in (Representation.POSITIVE, Representation.POWED))
    assert positive[1] - positive[0] == pytest.approx(positive[3] - positive[2])
    assert powed[3] - powed[2] > 2 * (powed[1] - powed[0])
