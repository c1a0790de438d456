"""Lengths counted in bins and their quantiles; walks drawn with replacement, and the intervals that follow."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.error_statistics import (
    BINS,
    PER_OCTAVE,
    ROUNDS,
    bins_of,
    counts_of,
    draws,
    interval,
    lower_edge_m,
    multiplicities,
    quantile_m,
)

LENGTHS = st.lists(st.floats(2e-3, 900.0), min_size=1, max_size=60)


@given(LENGTHS)
def test_every_length_lies_within_its_bin(lengths_m: list[float]) -> None:
    for length, index in zip(lengths_m, bins_of(np.array(lengths_m)), strict=True):
        assert lower_edge_m(index) * (1 - 1e-12) <= length <= lower_edge_m(index + 1) * (1 + 1e-12)


def test_what_is_too_small_or_too_great_is_counted_at_the_ends() -> None:
    assert bins_of(np.array([0.0, 1e-9, 1e9, np.inf])).tolist() == [0, 0, BINS - 1, BINS - 1]


@given(LENGTHS, st.floats(0.01, 1.0))
def test_quantiles_come_back_to_the_width_of_a_bin(lengths_m: list[float], share: float) -> None:
    counts = counts_of(np.array(lengths_m))
    assert sum(counts.values()) == len(lengths_m)
    exact = np.quantile(lengths_m, share, method="inverted_cdf")
    assert quantile_m(counts, share) == pytest.approx(exact, rel=2 ** (1 / PER_OCTAVE) - 1 + 1e-9)


def test_the_quantile_of_nothing_is_unknown() -> None:
    assert np.isnan(quantile_m({}, 0.5))


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
