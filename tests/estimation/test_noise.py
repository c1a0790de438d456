"""What walks of a device tell of its tracker: capped, rounded, and believed where a walk knows no better."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import loops
from vislam2tag.core.context import TrackerNoise
from vislam2tag.estimation.factors import VarianceFactors
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.noise import (
    ESTIMATED,
    GREATEST_TIMES,
    PRIOR_WEIGHT,
    STEP,
    STEP_OBSERVATIONS,
    USUAL,
    NoiseLevels,
    noise_of_other_walks,
)
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path, solve_in_own_frame, solve_walk


def walk(times: float, numbers: float = 20.0) -> NoiseLevels:
    """Levels so many times the usual ones, as so many numbers tell of sightings and one of each drift."""
    return replace(
        USUAL.times(times), sighting_observations=numbers, drift_observations=dict.fromkeys(ESTIMATED, numbers / 20)
    )


def test_each_walk_is_told_what_the_others_do() -> None:
    told = noise_of_other_walks([walk(0.5), walk(0.5), walk(0.5), walk(2.0)])
    assert all(one is not None for one in told)
    times = [one.times_usual for one in told if one is not None]
    assert times[0] == times[1] == times[2] > 1.0 > times[3]


def test_one_walk_whose_tracker_broke_does_not_decide() -> None:
    told = noise_of_other_walks([walk(1.0), walk(1.0), walk(1.0), walk(100.0)])
    assert told[0] is not None
    assert told[0].times_usual <= GREATEST_TIMES / STEP


def test_walks_that_tell_nothing_are_told_nothing_and_tell_nothing() -> None:
    assert noise_of_other_walks([]) == []
    assert noise_of_other_walks([walk(3.0)]) == [None]
    assert noise_of_other_walks([walk(3.0), walk(3.0, numbers=0.0)])[0] is None
    alone, beside = (
        noise_of_other_walks([walk(1.0), walk(3.0)]),
        noise_of_other_walks([walk(1.0), walk(3.0), walk(9.0, 0.0)]),
    )
    assert beside[:2] == alone


def test_what_is_told_is_rounded_and_never_counts_as_more_than_walks_are_alike() -> None:
    many = noise_of_other_walks([walk(1.3, 1000.0)] * 50)[0]
    assert many is not None
    assert many.effective_observations == 10.0
    assert many.effective_observations % STEP_OBSERVATIONS == 0
    steps = np.log(many.times_usual) / np.log(STEP)
    np.testing.assert_allclose(steps, np.rint(steps))
    assert noise_of_other_walks([walk(1.3, 1000.0)] * 51)[0] == many


def mapped(told: TrackerNoise | None, laps: float, marks: int = 8) -> SolvedWalk:
    observed = loops(3, USUAL.times(0.5), marks=marks, laps=laps, survey_m=0.02)
    smoothed = solve_walk(observed.observations(), LandmarkPriors.of(observed.ids, observed.landmarks()), told)
    assert smoothed is not None
    return smoothed


def test_the_usual_noise_told_is_what_is_assumed_where_nobody_tells() -> None:
    alone, told = mapped(None, 2), mapped(TrackerNoise(1.0, PRIOR_WEIGHT), 2)
    assert told.noise == alone.noise
    np.testing.assert_array_equal(mapped_path(told)[0], mapped_path(alone)[0])


@pytest.mark.parametrize("times", [0.5, 3.0])
def test_a_walk_that_few_numbers_tell_takes_on_the_device_s_noise_and_one_with_many_keeps_its_own(times: float) -> None:
    told, nearer = TrackerNoise(times, 8.0), []
    for laps, marks in ((0.5, 4), (6, 16)):
        own, both = mapped(None, laps, marks).noise.sighting_m, mapped(told, laps, marks).noise.sighting_m
        nearer.append(np.log(both / own) / np.log(USUAL.times(times).sighting_m / own))
    assert nearer[0] > 0.4
    assert nearer[1] < 0.4  # of logarithms: 8 numbers of 36 times the variance beside 190
    assert nearer[1] < 0.6 * nearer[0]


def test_sheets_stay_as_they_are() -> None:
    assert USUAL.times(3.0).sheet_rad == USUAL.sheet_rad


def test_levels_of_a_walk_in_its_own_frame_can_be_told() -> None:
    levels = [solve_in_own_frame(loops(seed, USUAL, marks=6, laps=3).observations()).noise for seed in range(3)]
    assert all(one is not None and 0.5 <= one.times_usual <= 2 for one in noise_of_other_walks(levels))


def test_weights_carry_what_was_told() -> None:
    told = TrackerNoise(2.0, 6.0)
    assert mapped(told, 1).variance_factors.prior_noise is told
    assert VarianceFactors.even(USUAL, 2, 1).prior_noise is None
