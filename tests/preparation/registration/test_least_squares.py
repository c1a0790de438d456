from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vislam2tag.preparation.registration.least_squares import (
    NoiseLevel,
    SingularError,
    ValueChange,
    adjust,
    explanations,
    mistyped,
    suspicious,
)


def random_problem(seed: int, rows: int = 12, unknowns: int = 4) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(rows, unknowns)), rng.normal(size=rows)


@given(st.integers(0, 10**6))
def test_solution_and_covariance_are_those_of_the_normal_equations(seed: int) -> None:
    design, misclosure = random_problem(seed)
    step, adjusted = adjust(design, misclosure)
    normal = design.T @ design
    assert step == pytest.approx(np.linalg.solve(normal, design.T @ misclosure))
    assert adjusted.cofactor == pytest.approx(np.linalg.inv(normal), rel=1e-6, abs=1e-9)
    assert design.T @ adjusted.residual == pytest.approx(np.zeros(4), abs=1e-9)


@given(st.integers(0, 10**6), st.integers(0, 11), st.floats(-5, 5))
def test_square_after_a_change_is_that_of_a_new_adjustment(seed: int, row: int, change: float) -> None:
    design, misclosure = random_problem(seed)
    adjusted = adjust(design, misclosure)[1]
    changed = misclosure.copy()
    changed[row] += change
    told = adjusted.changed_square(np.array([row]), np.array([change]))
    assert told == pytest.approx(adjust(design, changed)[1].square, rel=1e-6, abs=1e-9)


@given(st.integers(0, 10**6), st.integers(0, 10))
def test_reduction_is_that_of_leaving_rows_out(seed: int, row: int) -> None:
    design, misclosure = random_problem(seed)
    adjusted = adjust(design, misclosure)[1]
    rows = np.array([row, row + 1])
    without = adjust(np.delete(design, rows, 0), np.delete(misclosure, rows))[1]
    reduction, checks = adjusted.reduction_without(rows)
    assert checks == 2
    assert adjusted.square - reduction == pytest.approx(without.square, rel=1e-6, abs=1e-9)


def test_a_measurement_that_nothing_checks_is_never_suspicious() -> None:
    design = np.array(((1.0, 0), (1, 0), (1, 0), (0, 1)))
    adjusted = adjust(design, np.array((0.0, 0, 0, 1e6)))[1]
    assert adjusted.reduction_without(np.array([3])) == (0.0, 0)
    assert suspicious(adjusted, NoiseLevel(1, 12)) == []


def test_the_measurement_that_is_off_is_the_most_suspicious() -> None:
    adjusted = adjust(np.ones((9, 1)), np.array((0.0, 0, 0, 0, 9, 0, 0, 0, 0)))[1]
    assert suspicious(adjusted, NoiseLevel(1.0, 10))[0] == 4


@pytest.mark.parametrize("design", [np.ones((3, 2)), np.ones((1, 2)), np.array(((1.0, 0), (2, 0)))])
def test_undetermined_unknowns_are_told(design: np.ndarray) -> None:
    with pytest.raises(SingularError):
        adjust(design, np.zeros(len(design)))


def test_variance_factor_is_drawn_to_what_was_stated() -> None:
    few = adjust(np.ones((2, 1)), np.array((0.0, 20)))[1]
    many = adjust(np.ones((1001, 1)), np.tile((0.0, 4), 501)[:1001])[1]
    assert few.sigma0 == pytest.approx(200**0.5)
    assert few.variance_factor == pytest.approx(210 / 11)
    assert many.variance_factor == pytest.approx(4, rel=0.02)
    assert few.plausible is False
    assert adjust(np.ones((1, 1)), np.ones(1))[1].sigma0 is None


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
    misclosure = np.array((0.0, 0, 0, 0, 900, 0, 0, 0, 0))
    adjusted = adjust(np.ones((9, 1)), misclosure)[1]
    change = ValueChange("typed", (4,), np.array([-900.0]), 100)
    sigma_m = np.full(9, 0.003)
    (best,) = explanations(adjusted, sigma_m, NoiseLevel(1, 10), [4], [change])
    assert (best.text, best.measurements) == ("typed", (4,))
    pair = adjust(np.ones((2, 1)), np.array((0.0, 900)))[1]
    both = explanations(pair, sigma_m[:2], NoiseLevel(1, 10), [0, 1])
    assert sorted(one.measurements for one in both) == [(0,), (1,)]
