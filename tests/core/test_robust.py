"""Robust re-weighting: the iteration ends where it has converged, and says where it has not."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.robust import StoppingRule, iterate, variance_factor


def moved(before: float, after: float) -> float:
    return abs(after - before)


def halved(value: float, _number: int) -> float:
    return value / 2


def test_it_ends_at_the_first_round_that_leaves_less_than_the_tolerance() -> None:
    done = iterate("it", 1.0, halved, moved, StoppingRule(tolerance=0.1, most_rounds=50))
    assert (done.state, done.rounds, done.remaining, done.converged) == (0.0625, 4, 0.0625, True)


@pytest.mark.parametrize("rate", [0.1, 0.5, 0.9, 0.99, 0.999])
def test_however_slow_it_ends_within_the_tolerance_of_the_limit(rate: float) -> None:
    done = iterate("it", 1.0, lambda value, _: rate * value, moved, StoppingRule(tolerance=0.01, most_rounds=20_000))
    assert done.converged
    assert done.state <= 1.01 * done.remaining < 0.0101


def test_small_steps_that_grow_are_not_the_end() -> None:
    done = iterate("it", 1e-6, lambda value, _: 1.1 * value, moved, StoppingRule(tolerance=0.01, most_rounds=30))
    assert not done.converged
    assert done.remaining == np.inf


def test_numbers_as_small_as_rounding_are_the_limit() -> None:
    done = iterate(
        "it",
        1.0,
        lambda value, number: value + 1e-15 * (-1) ** number,
        moved,
        StoppingRule(tolerance=0.1, most_rounds=9),
    )
    assert done.converged


def test_it_says_that_it_has_not_converged(caplog: pytest.LogCaptureFixture) -> None:
    done = iterate("it", 1.0, lambda value, _: 0.9 * value, moved, StoppingRule(tolerance=0.1, most_rounds=7))
    assert (done.rounds, done.converged) == (7, False)
    assert done.remaining == pytest.approx(done.state)
    assert caplog.messages == ["it did not converge: 7 iterations ended about 0.48 from the limit"]


SLOW_AND_FAST = np.array((0.97, 0.5))


def shrunk(value: FloatArray, _number: int, times: float = 1.0) -> FloatArray:
    return np.asarray(value + times * (SLOW_AND_FAST - 1) * value)


def difference(before: FloatArray, after: FloatArray) -> FloatArray:
    return after - before


def test_long_steps_reach_the_same_limit_in_a_third_of_the_rounds() -> None:
    start = np.ones(2)
    short = iterate("it", start, shrunk, difference, StoppingRule(tolerance=0.01, most_rounds=900))
    long = iterate("it", start, shrunk, difference, StoppingRule(tolerance=0.01, most_rounds=900), long_step=shrunk)
    assert short.converged
    assert long.converged
    assert np.abs(long.state).max() < 0.02
    assert long.rounds < short.rounds / 3


def test_long_steps_that_overshoot_do_not_go_in_circles() -> None:
    """Slow far away and fast nearby: a long step from far away leads to the other side."""

    def step(value: FloatArray, _number: int, times: float = 1.0) -> FloatArray:
        return np.asarray(value - times * 0.6 * np.clip(value, -0.1, 0.1))

    start = np.array([5.03])
    done = iterate("it", start, step, difference, StoppingRule(tolerance=0.001, most_rounds=900), long_step=step)
    assert done.converged
    np.testing.assert_allclose(done.state, 0, atol=0.002)


def test_long_steps_end_where_short_ones_end_and_not_at_the_saddle_between() -> None:
    """Steps of ``x - x^3`` lead from 0, which is unstable, to 1; Newton's method from here would end at 0."""

    def step(value: float, _number: int, times: float = 1.0) -> float:
        return value + times * 0.1 * (value - value**3)

    done = iterate("it", 0.01, step, moved, StoppingRule(tolerance=0.01, most_rounds=900), long_step=step)
    assert done.converged
    assert done.state == pytest.approx(1, abs=0.02)


def test_rounds_are_numbered_from_one_and_the_least_are_done() -> None:
    numbers = []

    def step(value: float, number: int) -> float:
        numbers.append(number)
        return value

    assert iterate("it", 1.0, step, moved, StoppingRule(tolerance=0.1, most_rounds=50, least_rounds=3)).rounds == 3
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

    done = iterate("the mean", float(values.mean()), step, moved, StoppingRule(tolerance=1e-10, most_rounds=200))
    off = values - done.state
    assert done.converged
    assert np.sum((freedom + 1) * off / (freedom + off**2)) == pytest.approx(0, abs=1e-8)
