"""Robust re-weighting: the iteration ends where it has converged, and says where it has not."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.robust import iterate, variance_factor


def moved(before: float, after: float) -> float:
    return abs(after - before)


def halved(value: float, _number: int) -> float:
    return value / 2


def test_it_ends_at_the_first_round_that_moves_less_than_the_tolerance() -> None:
    done = iterate("it", 1.0, halved, moved, tolerance=0.1, most_rounds=50)
    assert (done.state, done.rounds, done.moved, done.converged) == (0.0625, 4, 0.0625, True)


def test_it_says_that_it_has_not_converged(caplog: pytest.LogCaptureFixture) -> None:
    done = iterate("it", 1.0, lambda value, _: -value, moved, tolerance=0.1, most_rounds=7)
    assert (done.state, done.rounds, done.moved, done.converged) == (-1.0, 7, 2.0, False)
    assert caplog.messages == ["it did not converge: after 7 iterations it still changes by 2"]


def test_rounds_are_numbered_from_one_and_the_least_are_done() -> None:
    numbers = []

    def step(value: float, number: int) -> float:
        numbers.append(number)
        return value

    assert iterate("it", 1.0, step, moved, tolerance=0.1, most_rounds=50, least_rounds=3).rounds == 3
    assert numbers == [1, 2, 3]


def test_the_factor_is_one_for_what_is_usual_and_grows_with_the_square() -> None:
    assert variance_factor(2.0, 2, 4.0) == 1.0
    np.testing.assert_allclose(variance_factor(np.array([0.0, 1.0, 100.0]), 1, 4.0), [0.8, 1.0, 20.8])


def test_a_mean_by_these_factors_is_the_most_probable_one_of_student_t() -> None:
    """The derivative of the log-likelihood is zero there."""
    values, freedom = np.array([0.1, -0.2, 0.3, 0.0, 8.0]), 3.0

    def step(mean: float, _number: int) -> float:
        weight = 1 / variance_factor((values - mean) ** 2, 1, freedom)
        return float(np.sum(weight * values) / np.sum(weight))

    done = iterate("the mean", float(values.mean()), step, moved, tolerance=1e-10, most_rounds=200)
    off = values - done.state
    assert done.converged
    assert np.sum((freedom + 1) * off / (freedom + off**2)) == pytest.approx(0, abs=1e-8)
