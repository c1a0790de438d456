from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.common.log_bins import BINS, PER_OCTAVE, bins_of, counts_of, lower_edge_m, quantile_m

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
