"""Noise levels and weights: expectation maximisation that climbs, finds the truth and doubts what is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from tests.drifting import loops
from tests.estimation.dense import as_matrix, whitened_rows
from tests.estimation.test_factors import linearised
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.context import TrackerNoise
from vislam2tag.estimation import reweighting
from vislam2tag.estimation.factors import LEAST_DRIFT, LinearWalk, Model, sighting_variance
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.least_squares import solve
from vislam2tag.estimation.reweighting import (
    BROKEN_STRETCHES,
    FEWEST_OBSERVATIONS,
    ExpectedSquares,
    NoiseSquares,
    equivalent_variances,
    expected_squares,
    reweighted,
)
from vislam2tag.estimation.smoother import solve_walk
from vislam2tag.estimation.tracker_errors import (
    DEGREES_OF_FREEDOM,
    ESTIMATED,
    LANDMARK_DOF,
    PRIOR_WEIGHT,
    SHEET_DOF,
    SIGHTING_DOF,
    USUAL,
    DriftSource,
    NoiseEvidence,
    NoiseLevels,
    VarianceFactors,
)

CALM = NoiseLevels(position_m=0.008, heading_rad=0.0015, scale=0.001, sighting_m=0.045, sheet_rad=0.015)
TYPICAL = NoiseLevels(position_m=0.016, heading_rad=0.003, scale=0.002, sighting_m=0.09, sheet_rad=0.03)
ROUGH = NoiseLevels(position_m=0.04, heading_rad=0.008, scale=0.005, sighting_m=0.2, sheet_rad=0.08)


def one_round(model: Model, priors: LandmarkPriors, variance_factors: VarianceFactors) -> VarianceFactors:
    solution = solve(LinearWalk(model, priors, variance_factors).normal_equations())
    return reweighted(model, variance_factors, expected_squares(LinearWalk(model, priors, variance_factors), solution))


def log_posterior(model: Model, priors: LandmarkPriors, variance_factors: VarianceFactors) -> float:
    """Log-likelihood of all observations, states and landmarks integrated out, plus the prior of the noise levels."""
    noise = variance_factors.noise
    matrix, right = as_matrix(LinearWalk(model, priors, variance_factors).normal_equations())
    _, values = whitened_rows(model, priors, variance_factors)
    drift = sum(noise.level(source) ** 2 * unit for source, unit in model.stretches.items()) + LEAST_DRIFT
    passes = model.observations.passes
    sighting = noise.sighting_m**2 * (1 + passes.distance_m**2) / 2
    deviance = (
        np.linalg.slogdet(drift)[1].sum()
        + 2 * np.log(sighting).sum()
        + model.headed.sum() * np.log(noise.sheet_rad**2)
        + np.linalg.slogdet(matrix)[1]
        + values @ values
        - right @ np.linalg.solve(matrix, right)
    )
    for name in ("position_m", "heading_rad", "scale", "sighting_m", "sheet_rad"):
        level, usual = getattr(noise, name), getattr(USUAL, name)
        deviance += PRIOR_WEIGHT * (np.log(level**2) + usual**2 / level**2)
    return -0.5 * float(deviance)


@pytest.mark.parametrize("truth", [CALM, TYPICAL, ROUGH])
def test_without_tails_no_round_makes_the_observations_less_likely(
    truth: NoiseLevels, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reweighting, "DEGREES_OF_FREEDOM", dict.fromkeys(DriftSource, 1e12))
    for name in ("SIGHTING_DOF", "SHEET_DOF", "LANDMARK_DOF"):
        monkeypatch.setattr(reweighting, name, 1e12)
    monkeypatch.setattr(reweighting, "_evidence", lambda _: NoiseEvidence(1.0, 1.0))  # a prior that stays where it is
    walk = loops(1, truth, marks=8, laps=2, survey_m=0.02)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks())
    model = linearised(walk)
    variance_factors = VarianceFactors.even(USUAL, len(model.observations.passes.at), 8)
    likelihood = [log_posterior(model, priors, variance_factors)]
    for _ in range(12):
        variance_factors = one_round(model, priors, variance_factors)
        likelihood.append(log_posterior(model, priors, variance_factors))
    assert np.diff(likelihood).min() > -1e-4
    assert likelihood[-1] >= likelihood[0]


def estimated(truth: NoiseLevels, seed: int) -> tuple[float, ...]:
    """Noise levels of a walk of 300 m past 64 landmarks, after many rounds about the tracker's own path."""
    walk = loops(seed, truth, marks=16, laps=4, survey_m=0.02)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks())
    model = linearised(walk)
    variance_factors = VarianceFactors.even(USUAL, len(model.observations.passes.at), 16)
    for _ in range(20):
        variance_factors = one_round(model, priors, variance_factors)
    noise = variance_factors.noise
    return noise.position_m, noise.heading_rad, noise.scale, noise.sighting_m, noise.sheet_rad


def test_noise_levels_of_a_session_are_found() -> None:
    true = np.array([(t.position_m, t.heading_rad, t.scale, t.sighting_m, t.sheet_rad) for t in (CALM, TYPICAL, ROUGH)])
    found = np.array([np.median([estimated(t, seed) for seed in range(6)], axis=0) for t in (CALM, TYPICAL, ROUGH)])
    assert np.all(np.diff(found, axis=0) > 0)
    octaves = np.log2(found / true)
    np.testing.assert_allclose(octaves[:, [3, 4]], 0, atol=0.8)  # sightings, sheets
    np.testing.assert_allclose(octaves[:, 0], 0, atol=1.5)  # of the drift, heavy tails and the heading take a part
    np.testing.assert_allclose(octaves[:, 1], 0, atol=1.5)
    np.testing.assert_allclose(octaves[:, 2], 0, atol=2.0)  # hardly seen beside the scale that the walk starts with


def test_what_nothing_tells_follows_what_all_else_tells() -> None:
    walk = loops(3, TYPICAL, marks=8, laps=1, survey_m=0.02)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks())
    model = linearised(walk)
    variance_factors = VarianceFactors.even(USUAL, len(model.observations.passes.at), 8)
    solution = solve(LinearWalk(model, priors, variance_factors).normal_equations())
    squares = expected_squares(LinearWalk(model, priors, variance_factors), solution)
    position = squares.stretch[DriftSource.POSITION]
    drifting = replace(position, squared_residual=100 * position.squared_residual)
    worse = replace(squares, stretch={**squares.stretch, DriftSource.POSITION: drifting})
    usual, found = (reweighted(model, variance_factors, each).noise for each in (squares, worse))
    assert found.position_m > 2 * usual.position_m
    assert found.heading_rad > 1.3 * usual.heading_rad
    assert found.sighting_m == usual.sighting_m


def test_weights_never_trust_more_than_the_tails_allow() -> None:
    walk = loops(2, CALM, marks=8, laps=2)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks([0, 1, 2, 5]))
    model = linearised(walk)
    variance_factors = one_round(model, priors, VarianceFactors.even(ROUGH, len(model.observations.passes.at), 8))
    for source, factor in variance_factors.stretch.items():
        assert np.all(factor >= DEGREES_OF_FREEDOM[source] / (DEGREES_OF_FREEDOM[source] + model.ranks[source]) - 1e-12)
    assert variance_factors.sighting.min() >= SIGHTING_DOF / (SIGHTING_DOF + 2)
    assert variance_factors.sheet.min() >= SHEET_DOF / (SHEET_DOF + 1)
    assert variance_factors.landmark.min() >= LANDMARK_DOF / (LANDMARK_DOF + 2)
    none_of = [
        ExpectedSquares(np.zeros_like(part), np.zeros_like(part))
        for part in (variance_factors.sighting, variance_factors.sheet)
    ]
    drift = {
        source: ExpectedSquares(np.zeros_like(factor), np.zeros_like(factor))
        for source, factor in variance_factors.stretch.items()
    }
    nothing = NoiseSquares(drift, none_of[0], none_of[1], np.zeros_like(variance_factors.landmark))
    least = reweighted(model, variance_factors, nothing)
    np.testing.assert_allclose(least.sighting, SIGHTING_DOF / (SIGHTING_DOF + 2))


def test_levels_without_observations_stay_usual_and_never_vanish() -> None:
    model = linearised(loops(3, marks=4, laps=1))
    priors = LandmarkPriors.nothing(4)
    variance_factors = VarianceFactors.even(USUAL, 4, 4)
    for _ in range(30):
        variance_factors = one_round(model, priors, variance_factors)
    for source in ESTIMATED:
        assert variance_factors.noise.level(source) > 0.2 * USUAL.level(source)
    assert variance_factors.noise.sighting_m > 0.2 * USUAL.sighting_m


def test_a_bad_sighting_a_bad_sheet_and_a_bad_landmark_are_doubted() -> None:
    walk = loops(4, TYPICAL, marks=8, laps=3)
    observations = walk.observations()
    offset, heading = observations.passes.offset.copy(), observations.passes.heading.copy()
    offset[9] += 3.0
    heading[12] *= np.exp(0.8j)
    observations = replace(observations, passes=replace(observations.passes, offset=offset, heading=heading))
    survey = walk.landmarks()
    survey.position_bcs[5] += (2.0, -1.0)
    smoothed = solve_walk(observations, LandmarkPriors.of(walk.ids, survey))
    assert smoothed is not None
    variance_factors = smoothed.variance_factors
    passes = observations.passes.landmark
    assert variance_factors.sighting[9] > 10 * np.median(variance_factors.sighting)
    assert variance_factors.sheet[12] > 10 * np.median(variance_factors.sheet)
    doubt = variance_factors.landmark * np.array([variance_factors.sighting[passes == j].min() for j in range(8)])
    assert doubt[5] > 10 * np.median(doubt)


def test_variances_for_covariances_are_greater_than_those_for_weights() -> None:
    model = linearised(loops(5, USUAL, marks=6, laps=1))
    variance_factors = VarianceFactors.even(USUAL, 6, 6)
    stated = equivalent_variances(model, variance_factors)
    assert np.all(stated.sighting >= variance_factors.sighting)
    assert np.all(stated.sheet >= variance_factors.sheet)
    for source in DriftSource:
        assert np.all(stated.stretch[source] >= variance_factors.stretch[source])


def test_a_drift_that_few_numbers_tell_is_stated_less_certain_however_many_tell_the_sightings() -> None:
    model = linearised(loops(5, USUAL, marks=6, laps=1))

    def stated(noise: NoiseLevels) -> VarianceFactors:
        return equivalent_variances(model, VarianceFactors.even(noise, 6, 6))

    few, many = ({DriftSource.POSITION: number} for number in (1.0, 100.0))
    told = stated(replace(USUAL, sighting_observations=40.0, drift_observations=many))
    untold = stated(replace(USUAL, sighting_observations=40.0, drift_observations=few))
    assert np.all(untold.stretch[DriftSource.POSITION] > 2 * told.stretch[DriftSource.POSITION])
    np.testing.assert_allclose(told.stretch[DriftSource.POSITION], 1, atol=0.05)
    np.testing.assert_array_equal(untold.sighting, told.sighting)
    given = stated(replace(USUAL, sighting_observations=2.0, drift_observations=few))
    assert np.all(given.sighting > 1.3 * told.sighting)
    np.testing.assert_array_equal(given.stretch[DriftSource.HEADING], told.stretch[DriftSource.HEADING])
    np.testing.assert_array_equal(given.stretch[DriftSource.JUMP], told.stretch[DriftSource.JUMP])
    none = stated(replace(USUAL, sighting_observations=0.0, drift_observations=few))
    np.testing.assert_array_equal(
        none.sighting, stated(replace(USUAL, sighting_observations=FEWEST_OBSERVATIONS - PRIOR_WEIGHT)).sighting
    )
    assert np.all(none.sighting > given.sighting)


def test_sightings_between_breaks_are_stated_less_certain() -> None:
    model = linearised(loops(5, USUAL, marks=6, laps=1))
    odometry = model.observations.odometry
    jump_m2 = np.zeros_like(odometry.jump_m2)
    jump_m2[model.observations.nodes[1:4] + 1] = 1.0
    broken = replace(model, observations=replace(model.observations, odometry=replace(odometry, jump_m2=jump_m2)))
    few, many = (VarianceFactors.even(replace(USUAL, sighting_observations=n), 6, 6) for n in (5.0, 40.0))
    assert np.count_nonzero(broken.ranks[DriftSource.JUMP]) == BROKEN_STRETCHES
    as_if = VarianceFactors.even(replace(USUAL, sighting_observations=2.5), 6, 6)
    np.testing.assert_allclose(equivalent_variances(broken, few).sighting, equivalent_variances(model, as_if).sighting)
    np.testing.assert_allclose(equivalent_variances(broken, many).sighting, equivalent_variances(model, many).sighting)


def test_the_numbers_that_tell_each_level_are_counted_for_each() -> None:
    walk = loops(3, TYPICAL, marks=8, laps=3, survey_m=0.02)
    model = linearised(walk)
    variance_factors = VarianceFactors.even(USUAL, len(model.observations.passes.at), 8)
    noise = one_round(model, LandmarkPriors.of(walk.ids, walk.landmarks()), variance_factors).noise
    assert set(noise.drift_observations) == set(ESTIMATED)
    passes = len(model.observations.passes.at)
    assert passes < noise.sighting_observations < 2 * passes
    assert all(0 <= number < passes for number in noise.drift_observations.values())
    assert noise.evidence.observations == pytest.approx(
        noise.sighting_observations + sum(noise.drift_observations.values())
    )
    assert 0 < noise.evidence.squares < 4 * noise.evidence.observations


def of_five_sigmas(model: Model) -> VarianceFactors:
    """Weights where every number is five of its standard deviations from what is expected; these are given."""
    drift = {source: np.full(model.ranks[source].shape, 25.0 * USUAL.level(source) ** 2) for source in DriftSource}
    passes, marks = len(model.observations.passes.at), len(model.observations.ids)
    given = VarianceFactors.even(USUAL, passes, marks, TrackerNoise(times_usual=1.0, effective_observations=1e12))
    squares = NoiseSquares(
        {source: ExpectedSquares(each * model.ranks[source], np.zeros_like(each)) for source, each in drift.items()},
        ExpectedSquares(np.asarray(50.0 * sighting_variance(model, USUAL), dtype=np.float64), np.zeros(passes)),
        ExpectedSquares(np.zeros(passes), np.zeros(passes)),
        np.full(marks, 50.0),
    )
    return reweighted(model, given, squares)


def test_what_is_far_from_usual_counts_as_little_as_the_tail_of_its_kind_says() -> None:
    """A variance with such a prior (scaled inverse chi-squared), after so many numbers of five sigmas."""

    def factor(freedom: float, numbers: npt.ArrayLike) -> FloatArray:
        return np.asarray((freedom + 25 * np.asarray(numbers)) / (freedom + np.asarray(numbers)), dtype=np.float64)

    model = linearised(loops(5, USUAL, marks=6, laps=1))
    variance_factors = of_five_sigmas(model)
    drift = {DriftSource.POSITION: 2, DriftSource.HEADING: 4, DriftSource.SCALE: 20}
    for source, freedom in drift.items():
        assert model.ranks[source].min() >= 2
        np.testing.assert_allclose(variance_factors.stretch[source], factor(freedom, model.ranks[source]), rtol=1e-6)
    np.testing.assert_allclose(variance_factors.sighting, factor(3, 2), rtol=1e-6)
    np.testing.assert_allclose(variance_factors.landmark, factor(2, 2), rtol=1e-6)
