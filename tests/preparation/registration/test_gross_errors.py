from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.preparation.registration.least_squares import NoiseLevel, ValueChange, adjust, explanations, mistyped

NUMBERS = st.decimals(min_value=-999, max_value=999, places=3).map(float)


@pytest.mark.parametrize(
    ("right", "typed", "what"),
    [
        (12.34, 21.34, "digits exchanged"),
        (12.34, 13.24, "digits exchanged"),
        (12.34, -12.34, "sign"),
        (12.34, 1.234, "decimal mark"),
        (12.34, 17.34, "one digit wrong"),
    ],
)
def test_slips_lead_back_to_what_was_meant(right: float, typed: float, what: str) -> None:
    found = {round(value, 6): text for value, text in mistyped(typed, 3 if what == "decimal mark" else 2)}
    assert found[right] == what


@given(NUMBERS)
def test_no_slip_is_small_or_the_value_itself(value: float) -> None:
    assert all(abs(other - value) >= 0.09 for other, _ in mistyped(value, 3))


@given(NUMBERS)
def test_an_exchange_of_digits_goes_both_ways(value: float) -> None:
    for other, what in mistyped(value, 3):
        if what == "digits exchanged" and min(abs(other), abs(value)) >= 100:  # a leading zero would be lost
            assert any(abs(back - value) < 1e-9 for back, _ in mistyped(other, 3))


def test_a_certain_value_that_fits_beats_leaving_out_and_equals_cannot_be_told() -> None:
    groups = [np.array([i]) for i in range(9)]
    misclosure = np.array((0.0, 0, 0, 0, 900, 0, 0, 0, 0))
    adjusted = adjust(np.ones((9, 1)), misclosure, 10.0)[1]
    change = ValueChange("typed", (4,), np.array([4]), np.array([-900.0]), 100)
    sigma_m = np.full(9, 0.003)
    (best,) = explanations(adjusted, groups, sigma_m, NoiseLevel(1, 10), [4], [change])
    assert (best.text, best.measurements) == ("typed", (4,))
    pair = adjust(np.ones((2, 1)), np.array((0.0, 900)), 10.0)[1]
    both = explanations(pair, groups[:2], sigma_m[:2], NoiseLevel(1, 10), [0, 1], [])
    assert sorted(one.measurements for one in both) == [(0,), (1,)]
