"""The linear model against what it linearises.

Normal equations of a walk against its least-squares rows written out one by one.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import Drifting, loops
from tests.estimation.dense import as_matrix, whitened_rows
from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.factors import (
    LinearWalk,
    Model,
    landmark_origin,
    sighting_variance,
)
from vislam2tag.estimation.landmark_priors import LandmarkPriors, survey_precisions
from vislam2tag.estimation.least_squares import solve
from vislam2tag.estimation.tracker_errors import USUAL, DriftSource, NoiseLevels, VarianceFactors


@pytest.mark.parametrize("which", range(4))
def test_a_small_error_of_the_state_moves_the_landmark_as_stated(which: int) -> None:
    model = linearised(loops(1, USUAL, marks=5, laps=1))
    small = np.zeros(4)
    small[which] = 1e-6
    x, y, scale, heading = small
    camera = model.path[model.observations.passes.at] + x + 1j * y
    moved = camera + model.offset * (1 + scale) * np.exp(1j * heading) - model.seen_at
    stated = model.sighting_jacobian @ small
    np.testing.assert_allclose(moved, stated[:, 0] + 1j * stated[:, 1], atol=1e-11)


def test_the_reference_sees_landmarks_where_they_are() -> None:
    walk = loops(2, marks=5, laps=2, drifted=False)
    model = linearised(walk)
    landmark = model.observations.passes.landmark
    np.testing.assert_allclose(model.seen_at, walk.place[landmark], atol=1e-9)
    np.testing.assert_allclose(np.exp(1j * model.heading_rad), np.exp(1j * walk.heading_rad[landmark]), atol=1e-9)


def test_sheets_tell_nothing_while_the_heading_is_not_known_roughly() -> None:
    walk = loops(3, marks=5, laps=1)
    assert linearised(walk).headed.all()
    assert not linearised(walk, rough=True).headed.any()


def test_each_source_has_as_many_numbers_as_its_drift() -> None:
    ranks = linearised(loops(4, marks=5, laps=1)).ranks
    assert set(ranks[DriftSource.POSITION]) == {2}
    assert ranks[DriftSource.HEADING].min() >= 1
    assert ranks[DriftSource.HEADING].max() <= 3
    assert set(ranks[DriftSource.JUMP]) == {0}


def test_heading_and_scale_drift_alike_in_a_rough_model() -> None:
    model = linearised(loops(5, marks=5, laps=1), rough=True)
    stretch = model.stretches[DriftSource.HEADING][2]
    assert stretch[2, 2] == pytest.approx(stretch[3, 3])
    assert stretch[0, 0] == pytest.approx(stretch[1, 1])
    assert not model.stretches[DriftSource.SCALE].any()


def test_the_drift_that_a_reference_already_has_is_the_sum_of_its_turns() -> None:
    model = bent(linearised(loops(6, marks=5, laps=1)))
    a, b = 70, 400
    turned = np.diff(np.angle(model.turn / model.turn[0]))[a:b]
    led = np.sum(1j * turned * (model.path[b] - model.path[a + 1 : b + 1]))
    had = model.reference_drift(np.array([a]), np.array([b]))[0]
    np.testing.assert_allclose(had, (led.real, led.imag, 0, turned.sum()), atol=1e-9)
    assert not linearised(loops(6, marks=5, laps=1)).reference_drift(np.array([a]), np.array([b])).any()


def linearised(walk: Drifting, *, rough: bool = False) -> Model:
    """A walk about the tracker's own path, laid on the true start and heading (left in its own frame where rough)."""
    observations = walk.observations()
    path = observations.odometry.path
    if rough:
        return Model(observations, path, np.ones_like(path), rough=True)
    turn = walk.factor[0] / abs(walk.factor[0])
    return Model(observations, walk.truth[0] + turn * (path - path[0]), np.full_like(path, turn), rough=False)


def bent(model: Model, rad: float = 0.1) -> Model:
    """The same about a reference whose heading wavers, as if part of the drift had been solved for before."""
    n = len(model.path)
    heading = rad * np.sin(np.linspace(0, 7, n))
    middle = np.exp(1j * (heading[1:] + heading[:-1]) / 2)
    path = model.path[0] + np.concatenate(([0.0], np.cumsum(np.diff(model.path) * middle)))
    return replace(model, path=path, turn=model.turn * np.exp(1j * heading))


def broken(model: Model) -> Model:
    """The same with jumps, doubtful steps and frames whose camera was elsewhere."""
    odometry = model.observations.odometry
    rng = np.random.default_rng(4)
    some = rng.random((3, len(odometry.jump_m2))) < 0.05
    doubt = np.where(some[2], rng.normal(0, 0.2, (2, len(some[2]))).T @ (1, 1j), 0)
    odometry = replace(
        odometry,
        jump_m2=np.where(some[0], rng.uniform(0.1, 4, len(some[0])), 0),
        jump_rad2=np.where(some[1], rng.uniform(0.01, 1, len(some[1])), 0),
        doubt=doubt,
        aside_m2=rng.uniform(0, 0.1, len(odometry.path)),
    )
    return replace(model, observations=replace(model.observations, odometry=odometry))


def uneven(model: Model, marks: int, seed: int) -> VarianceFactors:
    """Random factors for everything."""
    rng = np.random.default_rng(seed)
    even = VarianceFactors.even(USUAL, len(model.observations.passes.at), marks)
    return replace(
        even,
        stretch={source: rng.uniform(0.5, 20, len(ones)) for source, ones in even.stretch.items()},
        sighting=rng.uniform(0.5, 20, len(even.sighting)),
        sheet=rng.uniform(0.5, 20, len(even.sheet)),
        landmark=rng.uniform(0.5, 20, marks),
    )


@pytest.mark.parametrize("rough", [False, True])
@pytest.mark.parametrize("surveyed", [[0, 1, 2, 3, 4], [1, 3], []])
def test_normal_equations_add_up_all_rows(rough: bool, surveyed: list[int]) -> None:
    walk = loops(1, USUAL, marks=5, laps=1.4)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks(surveyed, headed=surveyed[:1]))
    model = broken(linearised(walk, rough=True) if rough else bent(linearised(walk)))
    variance_factors = uneven(model, 5, seed=2)
    matrix, right = as_matrix(LinearWalk(model, priors, variance_factors).normal_equations())
    rows, values = whitened_rows(model, priors, variance_factors)
    scale = np.sqrt(np.diag(matrix))
    np.testing.assert_allclose(matrix / np.outer(scale, scale), rows.T @ rows / np.outer(scale, scale), atol=1e-7)
    np.testing.assert_allclose(right / scale, rows.T @ values / scale, atol=1e-6 * np.abs(values).max())


def test_a_perfect_walk_about_its_true_path_needs_no_correction() -> None:
    walk = loops(3, marks=5, laps=1, drifted=False)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks(headed=[2]))
    model = linearised(walk)
    linear = LinearWalk(model, priors, VarianceFactors.even(USUAL, 5, 5))
    np.testing.assert_allclose(linear.sightings.residual, 0, atol=1e-9)
    np.testing.assert_allclose(linear.sheet_headings.residual, 0, atol=1e-9)
    solution = solve(linear.normal_equations())
    np.testing.assert_allclose(solution.state, 0, atol=1e-9)
    np.testing.assert_allclose(solution.border, 0, atol=1e-9)


def test_unsurveyed_landmarks_count_from_where_they_were_first_seen() -> None:
    walk = loops(4, marks=4, laps=2)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks([0, 1]))
    model = linearised(walk)
    origin = landmark_origin(model, priors)
    np.testing.assert_array_equal(origin[:2], priors.position[:2])
    first = [int(np.flatnonzero(model.observations.passes.landmark == j)[0]) for j in (2, 3)]
    np.testing.assert_array_equal(origin[2:], model.seen_at[first])
    (precision,) = survey_precisions(priors, np.ones(4))
    assert np.linalg.eigvalsh(precision[4:8, 4:8]).max() < 1e-6
    np.testing.assert_allclose(precision[:4, :4], np.eye(4) / 0.02**2)


def test_heading_residuals_are_the_short_way_round() -> None:
    walk = loops(5, marks=4, laps=2)
    walk.heading_rad[:] = np.pi - 0.001, -np.pi + 0.001, np.pi, 0.0
    model = linearised(walk)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks(headed=[0, 1, 2, 3]))
    priors.heading_rad[:] = -np.pi + 0.001, np.pi - 0.001, -np.pi, 0.1
    residual = LinearWalk(model, priors, VarianceFactors.even(USUAL, 8, 4)).sheet_headings.residual
    np.testing.assert_allclose(residual[:, 0], [0.002, -0.002, 0, 0.1] * 2, atol=1e-6)


def test_far_and_scattered_sightings_are_worth_less() -> None:
    model = linearised(loops(6, marks=3, laps=1))
    passes = replace(
        model.observations.passes,
        distance_m=np.array([0.5, 5.0, 0.5]),
        spread_m=np.array([0.0, 0.0, 0.3]),
        at=np.arange(3),
    )
    variance = sighting_variance(replace(model, observations=replace(model.observations, passes=passes)), USUAL)
    assert variance[1] > 4 * variance[0]
    assert variance[2] == pytest.approx(variance[0] + 0.09)


def test_jumps_free_their_stretch_only() -> None:
    walk = loops(7, USUAL, marks=4, laps=1)
    model = linearised(walk)
    odometry = model.observations.odometry
    jump = np.zeros_like(odometry.jump_m2)
    middle = int(model.observations.nodes[1:3].mean())
    jump[middle] = 4.0
    jumped = replace(model, observations=replace(model.observations, odometry=replace(odometry, jump_m2=jump)))
    added = jumped.stretches[DriftSource.JUMP] - model.stretches[DriftSource.JUMP]
    np.testing.assert_allclose(added[1], np.diag([4.0, 4.0, 0, 0]), atol=1e-9)
    np.testing.assert_allclose(added[[0, 2, 3, 4]], 0, atol=1e-9)


def test_what_the_reference_has_taken_over_stays_drift() -> None:
    walk = loops(8, NoiseLevels(position_m=0.01, heading_rad=0.002, scale=0.001, sighting_m=0.05), marks=8, laps=1)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks())
    variance_factors = VarianceFactors.even(walk.noise, 8, 8)
    solved, spread = [], []
    plain = linearised(walk)
    for model in (plain, bent(plain, rad=0.02)):
        solution = solve(LinearWalk(model, priors, variance_factors).normal_equations())
        at = model.observations.nodes
        solved.append(model.path[at] + solution.state[:, 0] + 1j * solution.state[:, 1])
        spread.append(solution.covariance)
    np.testing.assert_allclose(solved[0], solved[1], atol=5e-3)
    np.testing.assert_allclose(spread[0], spread[1], rtol=0.2, atol=1e-4)


def survey_of(marks: int) -> tuple[LandmarkPriors, FloatArray]:
    """Landmarks that are all surveyed, and the same as a joint covariance of errors that they do not share."""
    walk = loops(1, USUAL, marks=marks, laps=1.4)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks(list(range(marks)), headed=list(range(marks))))
    joint = np.zeros((3 * marks, 3 * marks))
    x = 2 * np.arange(marks)
    for i in (0, 1):
        for j in (0, 1):
            joint[x + i, x + j] = priors.covariance[:, i, j]
    heading = np.arange(2 * marks, 3 * marks)
    joint[heading, heading] = priors.heading_sigma_rad**2
    return priors, joint


def test_landmarks_that_share_no_errors_are_as_those_that_err_apart() -> None:
    model = bent(linearised(loops(1, USUAL, marks=5, laps=1.4)))
    priors, joint = survey_of(5)
    variance_factors = uneven(model, 5, seed=2)
    one = LinearWalk(model, priors, variance_factors).normal_equations()
    other = LinearWalk(model, replace(priors, joint=joint), variance_factors).normal_equations()
    np.testing.assert_allclose(other.corner, one.corner, rtol=1e-9, atol=1e-9)


def test_an_error_that_all_landmarks_share_is_the_walks_too() -> None:
    model = linearised(loops(1, USUAL, marks=5, laps=1.4))
    priors, joint = survey_of(5)
    x = 2 * np.arange(5)
    joint[np.ix_(x, x)] += 1.0
    variance_factors = VarianceFactors.even(USUAL, len(model.observations.passes.at), 5)
    solution = solve(LinearWalk(model, replace(priors, joint=joint), variance_factors).normal_equations())
    assert solution.covariance[:, 0, 0].min() > 0.9
    assert solution.covariance[1:-1, 1, 1].max() < 0.3
