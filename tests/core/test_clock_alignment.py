"""Clocks of two recorders of one walk are aligned, or refused with the figures that say why."""

from __future__ import annotations

import numpy as np
import pytest

from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.clock_alignment import STAMPS_SIGMA_S, ClockAlignment, _line, align_by_motion
from vislam2tag.core.clock_by_levels import align_by_levels

UNIX_S = 1.7e9


def motion(seconds: float, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Times (s) every 5 ms, and the norm of turn rates as somebody has who walks: steps, turns, stops."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, seconds, 0.005)
    knots = np.arange(0, seconds + 1, 0.7)
    turns = np.interp(time_s, knots, rng.gamma(0.7, 0.6, len(knots)))
    every_5 = np.arange(0, seconds + 5, 5.0)
    steps = np.cumsum(np.interp(time_s, every_5, rng.uniform(1.6, 2.1, len(every_5)))) * 0.005
    return time_s, np.abs(turns + 0.15 * np.sin(2 * np.pi * steps) + 0.3)


def other_recorder(
    time_s: FloatArray, norm: FloatArray, *, rate_hz: float, drift: float, offset_s: float, noise: float, seed: int
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Stamps of a clock of its own, noisy samples in another unit, and when they were really taken, seconds."""
    rng = np.random.default_rng(seed)
    taken_s = np.sort(np.arange(3.0, time_s[-1] - 3, 1 / rate_hz) + rng.normal(0, 0.1 / rate_hz, 1))
    felt = 57.3 * np.interp(taken_s, time_s, norm) + rng.normal(0, 57.3 * noise * norm.std(), len(taken_s))
    return np.round((taken_s * (1 + drift) + offset_s) * 1e9).astype(np.int64), felt, taken_s


def own_recorder(time_s: FloatArray, norm: FloatArray) -> tuple[IntArray, FloatArray]:
    rng = np.random.default_rng(99)
    return np.round((time_s[::4] + 500.0) * 1e9).astype(np.int64), norm[::4] + rng.normal(0, 0.05, len(norm[::4]))


@pytest.mark.parametrize("rate_hz", [25.0, 60.0, 200.0])
@pytest.mark.parametrize("drift", [0.0, 6e-5, -6e-5])
def test_another_rate_noise_and_drift(rate_hz: float, drift: float) -> None:
    worst, within = [], []
    for seed in range(4):
        time_s, norm = motion(180.0, seed)
        our_ns, ours = own_recorder(time_s, norm)
        their_ns, theirs, taken_s = other_recorder(
            time_s, norm, rate_hz=rate_hz, drift=drift, offset_s=UNIX_S + 7.3 * seed, noise=0.3, seed=seed
        )
        found = align_by_motion(their_ns, theirs, our_ns, ours)
        error_s = np.abs(found.ours(their_ns) * 1e-9 - (taken_s + 500.0)).max()
        worst.append(error_s)
        within.append(error_s <= 3 * found.sigma_s)
    assert max(worst) < 0.02, "a fiftieth of a second anywhere on the walk"
    assert sum(within) >= 3, "and the stated sigma says so"


def test_motion_of_another_walk_is_refused_with_its_figure() -> None:
    time_s, norm = motion(180.0, 1)
    our_ns, ours = own_recorder(time_s, norm)
    their_ns, theirs, _ = other_recorder(*motion(180.0, 2), rate_hz=50, drift=0, offset_s=UNIX_S, noise=0.3, seed=1)
    found = align_by_motion(their_ns, theirs, our_ns, ours)
    assert found.offset_ns is None
    assert found.figures.startswith("correlation 0.")
    with pytest.raises(ValueError, match="correlation"):
        found.ours(their_ns)


def test_steps_as_even_as_a_clock_are_refused_for_they_fit_a_step_later_too() -> None:
    time_s = np.arange(0.0, 120.0, 0.01)
    even = np.sin(2 * np.pi * 2.0 * time_s) + np.linspace(0, 1, len(time_s)) ** 2
    time_ns = np.round(time_s * 1e9).astype(np.int64)
    found = align_by_motion(time_ns + 10**9, even, time_ns, even)
    assert found.offset_ns is None


def test_a_short_series_is_refused() -> None:
    time_s, norm = motion(20.0)
    time_ns, values = own_recorder(time_s, norm)
    found = align_by_motion(time_ns, values, time_ns, values)
    assert (found.offset_ns, found.figures) == (None, "less than 40 s of motion to compare")
    assert align_by_motion(time_ns[:0], values[:0], time_ns, values).offset_ns is None


def test_one_time_of_years_away_is_refused_before_it_fills_the_memory() -> None:
    ns = np.append(np.arange(60, dtype=np.int64) * 10**9, 4 * 10**18)
    walked = np.arange(60, dtype=np.int64) * 10**9
    for theirs, ours in ((ns, walked), (walked, ns)):
        found = align_by_motion(theirs, np.ones(len(theirs)), ours, np.ones(len(ours)))
        assert (found.offset_ns, "24 h" in found.figures) == (None, True)
        levels = align_by_levels({"a": (theirs, np.ones(len(theirs)))}, {"a": (ours, np.ones(len(ours)))})
        assert (levels.offset_ns, "too far apart" in levels.figures) == (None, True)


def test_a_clock_that_runs_faster_is_set_right_everywhere() -> None:
    clock = ClockAlignment(10_000, rate=0.25, at_ns=1000)
    ours = np.array([1000, 2000, 5000])
    theirs = ours + 10_000 + np.round(0.25 * (ours - 1000)).astype(np.int64)
    assert clock.ours(theirs).tolist() == ours.tolist()


def test_sigma_holds_at_both_ends_of_a_walk() -> None:
    """Of walks whose windows scatter evenly, the larger error of both ends is within two sigma in 95 %."""
    rng = np.random.default_rng(17)
    middles = np.linspace(0, 115, 24)
    within = 0
    for _ in range(1000):
        offset, rate, at, sigma = _line(middles, rng.normal(0, 0.003, 24))
        within += abs(np.array((offset, offset)) + rate * (middles[[0, -1]] - at)).max() <= 2 * sigma
    assert 0.94 < within / 1000 < 0.97


def test_what_all_windows_share_is_part_of_sigma() -> None:
    time_s, norm = motion(120.0, seed=3)
    their_ns, theirs, _ = other_recorder(time_s, norm, rate_hz=200.0, drift=0.0, offset_s=5.0, noise=0.0, seed=1)
    found = align_by_motion(their_ns, theirs, np.round(time_s * 1e9).astype(np.int64), norm)
    assert found.offset_ns is not None
    assert found.sigma_s > STAMPS_SIGMA_S
