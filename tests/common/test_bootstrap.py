"""Walks drawn with replacement, and the intervals that follow."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.common.bootstrap import ROUNDS, draws, interval, multiplicities


def test_every_round_draws_as_many_walks_as_there_are_each_as_often_as_another() -> None:
    drawn = draws(8)
    assert drawn.shape == (ROUNDS, 8)
    assert set(np.unique(drawn)) == set(range(8))
    np.testing.assert_array_equal(drawn, draws(8))
    # A walk is drawn 1000 times on average; the standard deviation is that of a binomial count.
    assert np.abs(np.bincount(drawn.ravel()) - ROUNDS).max() < 4 * np.sqrt(ROUNDS * 7 / 8)


def test_multiplicities_count_each_walk_in_each_round() -> None:
    drawn = np.array([[0, 0, 2], [1, 1, 1]])
    assert multiplicities(drawn).tolist() == [[2, 0, 1], [0, 3, 0]]


def test_the_interval_leaves_out_a_fortieth_at_each_end() -> None:
    values = np.append(np.arange(201.0), [np.nan, np.inf])
    assert interval(values) == pytest.approx((5.0, 195.0))
    assert interval(np.array([np.nan])) is None
