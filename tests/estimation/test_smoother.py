"""A whole walk solved: exact without noise, equivariant, robust, with covariances that hold what they say.

Places that other walks tell: believed as far as they are known, and no farther.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from calibration import apart, without_acceleration

from tests.drifting import Drifting, loops
from tests.estimation.test_factors import linearised
from vislam2tag.core.arrays import FloatArray, IntArray
from vislam2tag.core.context import PlaceTies
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation import smoother
from vislam2tag.estimation.factors import LinearWalk
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.least_squares import solve
from vislam2tag.estimation.observations import Passes, WalkObservations
from vislam2tag.estimation.smoother import (
    SolvedWalk,
    first_problem,
    mapped_path,
    relinearise_until_converged,
    solve_in_own_frame,
    solve_walk,
    solve_with_ties,
)
from vislam2tag.estimation.tracker_errors import NoiseLevels, VarianceFactors
from vislam2tag.quality.evaluation.reliability import region_probability

TYPICAL = NoiseLevels(position_m=0.016, heading_rad=0.003, scale=0.002, sighting_m=0.09, sheet_rad=0.03)


def solved(
    walk: Drifting,
    surveyed: list[int] | None = None,
    headed: list[int] | None = None,
    observations: WalkObservations | None = None,
) -> SolvedWalk:
    priors = LandmarkPriors.of(walk.ids, walk.landmarks(surveyed, headed))
    smoothed = solve_walk(walk.observations() if observations is None else observations, priors)
    assert smoothed is not None
    return smoothed


def errors(walk: Drifting, smoothed: SolvedWalk) -> FloatArray:
    """(n, 2) metres."""
    position, _, _ = mapped_path(smoothed)
    return np.asarray(position - as_points(walk.truth))


def lengths(error: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.norm(error, axis=1))


@pytest.mark.parametrize(("surveyed", "headed"), [(None, []), ([0, 4], []), ([1, 2, 6], []), ([3], [3])])
def test_a_perfect_tracker_is_mapped_exactly(surveyed: list[int] | None, headed: list[int]) -> None:
    walk = loops(1, marks=8, laps=2, drifted=False)
    smoothed = solved(walk, surveyed, headed)
    np.testing.assert_allclose(errors(walk, smoothed), 0, atol=1e-3)
    np.testing.assert_allclose(smoothed.landmark_position, walk.place, atol=1e-3)
    _, covariance, rotation = mapped_path(smoothed)
    np.testing.assert_allclose(np.angle(np.exp(1j * rotation)), 0, atol=1e-4)
    assert np.linalg.eigvalsh(covariance).min() > 0


def test_any_start_heading_and_scale_of_the_tracker_is_found() -> None:
    for seed in range(5):
        walk = loops(seed, marks=6, laps=1)
        smoothed = solved(walk)
        assert lengths(errors(walk, smoothed)).max() < 0.05
        np.testing.assert_allclose(np.exp(1j * mapped_path(smoothed)[2]), walk.factor / np.abs(walk.factor), atol=0.01)


@pytest.mark.parametrize(("turn_rad", "shift"), [(0.4, 3 - 2j), (-2.9, 1000 + 500j), (1.6, 0j)])
def test_turning_and_moving_the_survey_turns_and_moves_the_result(turn_rad: float, shift: complex) -> None:
    walk = loops(7, TYPICAL, marks=7, laps=1.5, survey_m=0.02)
    surveyed, headed = [0, 2, 3, 5], [2]
    observations = walk.observations()
    doubt = np.where(np.arange(len(observations.odometry.path) - 1) % 50, 0, 0.2 + 0.1j)
    observations = replace(observations, odometry=replace(observations.odometry, doubt=doubt))
    plain = mapped_path(solved(walk, surveyed, headed, observations))
    turn = np.exp(1j * turn_rad)
    elsewhere = replace(walk, surveyed_at=walk.surveyed_at * turn + shift, heading_rad=walk.heading_rad + turn_rad)
    position, covariance, rotation = mapped_path(solved(elsewhere, surveyed, headed, observations))
    back = as_points((position @ [1, 1j] - shift) / turn)
    np.testing.assert_allclose(back, plain[0], atol=1e-6)
    axes = np.array([[turn.real, -turn.imag], [turn.imag, turn.real]])
    np.testing.assert_allclose(covariance, axes @ plain[1] @ axes.T, rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(np.exp(1j * rotation), turn * np.exp(1j * plain[2]), atol=1e-6)


def test_one_landmark_with_a_heading_is_enough_and_says_how_sure_it_is() -> None:
    walk = loops(9, TYPICAL, marks=1, laps=2)
    smoothed = solved(walk, [0], [0])
    _, covariance, _ = mapped_path(smoothed)
    sigma = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    error = lengths(errors(walk, smoothed))
    assert error.mean() < 1.5
    assert np.mean(error < 3 * sigma) > 0.9
    at = smoothed.model.observations.passes.at
    assert sigma[at].max() < 0.5 * sigma.max()


def test_sigma_grows_before_the_first_and_after_the_last_landmark() -> None:
    walk = loops(10, TYPICAL, marks=10, laps=0.9)
    smoothed = solved(walk, [3, 4, 5])
    passes = smoothed.model.observations.passes
    surveyed = passes.at[np.isin(passes.landmark, [3, 4, 5])]
    _, covariance, _ = mapped_path(smoothed)
    sigma = np.sqrt(np.trace(covariance, axis1=1, axis2=2) / 2)
    before, after = sigma[: surveyed[0] : 20], sigma[surveyed[-1] :: 20]
    assert before[0] > 2 * before[-1]
    assert after[-1] > 2 * after[0]
    assert np.all(np.diff(after) > -0.01)


def test_unsurveyed_landmarks_help_where_they_are_passed_again() -> None:
    gain = []
    for seed in range(5):
        walk = loops(seed, TYPICAL, marks=10, laps=3)
        observations = walk.observations()
        few = np.isin(observations.passes.landmark, [0, 5])
        with_all, without = (
            lengths(errors(walk, solved(walk, [0, 5], observations=one))).mean()
            for one in (
                observations,
                replace(
                    observations, passes=Passes(**{name: part[few] for name, part in vars(observations.passes).items()})
                ),
            )
        )
        gain.append(without / with_all)
    assert np.median(gain) > 1.05


def test_unsurveyed_landmarks_get_a_position_within_its_sigma() -> None:
    squared = []
    for seed in range(8):
        walk = loops(seed, TYPICAL, marks=10, laps=2)
        smoothed = solved(walk, [0, 3, 6])
        miss = as_points(smoothed.landmark_position - walk.place)[[1, 2, 4, 5, 7, 8, 9]]
        covariance = smoothed.landmark_covariance()[[1, 2, 4, 5, 7, 8, 9]]
        squared += np.einsum("mi,mij,mj->m", miss, np.linalg.inv(covariance), miss).tolist()
    assert np.mean(np.array(squared) < 9.2) > 0.9  # 99 % of a chi-squared with 2 degrees of freedom
    assert np.median(squared) > 0.2


def test_bad_sightings_do_not_bend_the_walk() -> None:
    walk = loops(11, TYPICAL, marks=8, laps=2)
    observations = walk.observations()
    clean = lengths(errors(walk, solved(walk, observations=observations))).mean()
    offset = observations.passes.offset.copy()
    offset[[3, 9]] += (4.0 - 2.0j, -5.0j)
    bad = replace(observations, passes=replace(observations.passes, offset=offset))
    assert lengths(errors(walk, solved(walk, observations=bad))).max() < 3 * clean + 0.3


def test_a_jump_in_an_unknown_direction_bends_only_its_own_stretch() -> None:
    walk = loops(12, TYPICAL, marks=8, laps=1)
    observations = walk.observations()
    clean = lengths(errors(walk, solved(walk, observations=observations)))
    step = int(observations.nodes[3:5].mean())
    path = observations.odometry.path.copy()
    path[step + 1 :] += 3.0 + 2.0j
    freedom = np.zeros(len(path) - 1)
    freedom[step] = 1.0
    jumped = replace(observations, odometry=replace(observations.odometry, path=path, jump_m2=freedom))
    smoothed = solved(walk, observations=jumped)
    error = lengths(errors(walk, smoothed))
    outside = np.ones(len(path), dtype=bool)
    outside[observations.nodes[3] : observations.nodes[4]] = False
    assert error[outside].max() < 2 * clean.max() + 0.1


@pytest.mark.parametrize("along", [True, False])
def test_a_slip_is_put_at_the_doubtful_step_that_it_fits(*, along: bool) -> None:
    walk = loops(12, TYPICAL, marks=8, laps=1)
    observations = walk.observations()
    first, last = observations.nodes[3], observations.nodes[4]
    early, late = int(0.2 * last + 0.8 * first), int(0.8 * last + 0.2 * first)
    slip = 1.2 * np.exp(0.7j)
    path = observations.odometry.path.copy()
    path[late + 1 :] += slip
    doubt = np.zeros(len(path) - 1, dtype=np.complex128)
    doubt[early], doubt[late] = 0.3j * slip, (0.3 if along else 0.3j) * slip
    observations = replace(observations, odometry=replace(observations.odometry, path=path, doubt=doubt))
    middle = slice(early + 1, late + 1)
    error = lengths(errors(walk, solved(walk, observations=observations)))[middle].mean()
    assert error < 0.15 if along else error > 0.3


def shares_inside(probability: list[FloatArray]) -> tuple[float, float]:
    """Shares of all errors that lie inside their regions of 68 % and of 95 %."""
    pooled = np.concatenate(probability)
    return float(np.mean(pooled < 0.68)), float(np.mean(pooled < 0.95))


def test_with_the_noise_given_covariances_hold_what_they_say() -> None:
    found = []
    for seed in range(200):
        walk = loops(seed, TYPICAL, marks=10, laps=1.5, survey_m=0.02)
        priors = LandmarkPriors.of(walk.ids, walk.landmarks([0, 2, 5, 7]))
        model = linearised(walk)
        nodes, variance_factors = (
            model.observations.nodes,
            VarianceFactors.even(TYPICAL, len(model.observations.passes.at), 10),
        )
        state = solve(LinearWalk(model, priors, variance_factors).normal_equations())
        error = model.path[nodes] + state.state[:, 0] + 1j * state.state[:, 1] - walk.truth[nodes]
        found.append(region_probability(as_points(error), state.covariance[:, :2, :2]))
    of_68, of_95 = shares_inside(found)
    assert of_68 == pytest.approx(0.68, abs=0.04)
    assert of_95 == pytest.approx(0.95, abs=0.015)


@pytest.mark.campaign
def test_with_the_noise_estimated_covariances_are_not_too_small_and_hardly_too_great() -> None:
    found = []
    for seed in range(60):
        walk = loops(seed, TYPICAL, marks=10, laps=1.5, survey_m=0.02)
        smoothed = solved(walk, [0, 2, 5, 7])
        found.append(region_probability(errors(walk, smoothed), mapped_path(smoothed)[1]))
    of_68, of_95 = shares_inside(found)
    assert 0.68 < of_68 < 0.85
    assert 0.94 < of_95 < 0.99


def test_regions_beside_a_survey_that_does_not_fit_hold_labels_that_follow_it() -> None:
    walk = loops(3, TYPICAL, marks=10, laps=3, survey_m=0.02)
    observations = walk.observations()
    elsewhere, step = np.isin(np.arange(10), [3, 4]), np.array([1.6, -1.2])
    off = elsewhere * complex(*step)
    smoothed = solved(replace(walk, surveyed_at=walk.surveyed_at + off), observations=observations)
    error, covariance = errors(walk, smoothed), mapped_path(smoothed)[1]
    passes = observations.passes
    beside = elsewhere[passes.landmark]
    following = region_probability(error - step, covariance)[passes.at]
    assert np.all(following[beside] < 0.95)
    assert np.all(following[~beside] > 0.99)
    usual = mapped_path(solved(walk, observations=observations))[1]
    sigma_m = (np.sqrt(np.trace(one, axis1=1, axis2=2) / 2)[passes.at] for one in (covariance, usual))
    grown = np.divide(*sigma_m)
    assert grown[beside].min() > 2 * grown[~beside].max()


def test_a_walk_in_its_own_frame_keeps_its_shape_and_maps_its_landmarks() -> None:
    walk = loops(13, marks=6, laps=2, drifted=False)
    smoothed = solve_in_own_frame(walk.observations())
    position, _, _ = mapped_path(smoothed)
    np.testing.assert_allclose(position, as_points(walk.truth), atol=1e-3)
    np.testing.assert_allclose(smoothed.landmark_position, walk.place, atol=1e-3)
    sigma = np.sqrt(np.trace(smoothed.landmark_covariance(), axis1=1, axis2=2) / 2)
    assert np.argmin(sigma) == smoothed.model.observations.passes.landmark[0]
    assert np.all(np.isfinite(smoothed.landmark_heading_rad))


@pytest.mark.parametrize("seed", range(4))
def test_a_walk_ends_close_to_where_short_steps_end(seed: int) -> None:
    """Without acceleration, from the same start."""
    walk = loops(seed, TYPICAL.times(2.0), marks=6, laps=1.5, survey_m=0.02)
    start = first_problem(walk.observations(), LandmarkPriors.of(walk.ids, walk.landmarks()))
    assert start is not None
    moved, changed = apart(relinearise_until_converged(start), without_acceleration(start)[0])
    assert moved < 0.1
    assert changed < 0.05


def test_reweighting_goes_on_until_it_has_converged_and_says_where_it_does_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    walk = loops(4, marks=8, laps=2)
    done = solved(walk)
    assert done.unreached_sigmas == 0
    monkeypatch.setattr(smoother, "CONVERGED_SIGMAS", 1e-4)
    further = solved(walk)
    sigma_m = np.sqrt(np.trace(mapped_path(done)[1], axis1=1, axis2=2) / 2)
    assert (lengths(mapped_path(further)[0] - mapped_path(done)[0]) / sigma_m).max() < 0.1
    monkeypatch.setattr(smoother, "CONVERGED_SIGMAS", 0.0)
    assert solved(walk).unreached_sigmas > 0


@pytest.mark.parametrize(("apart_m", "heading_is_known"), [(0.4, False), (0.6, True)])
def test_landmarks_closer_than_half_a_metre_give_no_heading(apart_m: float, heading_is_known: bool) -> None:
    walk = loops(8, marks=2, laps=1)
    place = walk.place[0] + np.array([0.0, apart_m])
    beside = replace(walk, place=place, surveyed_at=place)
    found = solve_walk(beside.observations(), LandmarkPriors.of(walk.ids, beside.landmarks()))
    assert (found is not None) == heading_is_known


DRIFTING = replace(TYPICAL, heading_rad=0.02, position_m=0.05)
EVERY = 40


def walk_past_few(seed: int) -> tuple[Drifting, SolvedWalk, IntArray]:
    """A walk past two surveyed landmarks near each other, as smoothed, and the times of its frames."""
    walk = loops(seed, DRIFTING, marks=8, laps=2)
    smoothed = solved(walk, [0, 1])
    return walk, smoothed, np.rint(smoothed.model.observations.odometry.time_s * 1e9).astype(np.int64)


def ties_of(walk: Drifting, time_ns: IntArray, off: FloatArray, sigma_m: float) -> PlaceTies:
    at = np.arange(EVERY, len(time_ns), EVERY)
    return PlaceTies(time_ns[at], as_points(walk.truth[at]) + off, np.eye(2 * len(at)) * sigma_m**2)


def test_places_known_well_lead_the_walk_there_and_sigma_says_so() -> None:
    for seed in range(3):
        walk, smoothed, time_ns = walk_past_few(seed)
        tied = solve_with_ties(smoothed, time_ns, ties_of(walk, time_ns, np.zeros(2), 0.05))
        assert lengths(errors(walk, tied)).mean() < 0.5 * lengths(errors(walk, smoothed)).mean()
        assert np.trace(mapped_path(tied)[1].mean(axis=0)) < 0.5 * np.trace(mapped_path(smoothed)[1].mean(axis=0))


def test_an_error_that_all_places_share_leads_the_walk_nowhere() -> None:
    walk, smoothed, time_ns = walk_past_few(0)
    alone = ties_of(walk, time_ns, np.array([1.0, 0.0]), 1.0)
    count = len(alone.time_ns)
    alike = np.full((count, count), 0.99) + 0.01 * np.eye(count)
    shared = replace(alone, covariance_m2=np.asarray(np.kron(alike, np.eye(2)), dtype=np.float64))
    bent, kept = (errors(walk, solve_with_ties(smoothed, time_ns, ties)) for ties in (alone, shared))
    assert abs(kept[:, 0].mean()) < 0.5 * abs(bent[:, 0].mean())


def test_nothing_told_changes_nothing() -> None:
    walk, smoothed, time_ns = walk_past_few(2)
    late = ties_of(walk, time_ns + 10**12, np.zeros(2), 0.1)
    assert solve_with_ties(smoothed, time_ns, late) is smoothed
    unknown = solve_with_ties(smoothed, time_ns, ties_of(walk, time_ns, np.ones(2), 1e3))
    moved = lengths(mapped_path(unknown)[0] - mapped_path(smoothed)[0])
    assert moved.max() < 0.5 * np.sqrt(np.trace(mapped_path(smoothed)[1], axis1=1, axis2=2).max())


@pytest.mark.parametrize("off_m", [3.0, 100.0])
def test_a_place_far_off_is_not_believed_and_makes_no_label_less_certain(off_m: float) -> None:
    walk, smoothed, time_ns = walk_past_few(1)
    ties = ties_of(walk, time_ns, np.zeros(2), 0.3)
    wild = replace(ties, position_bcs=ties.position_bcs + np.eye(len(ties.time_ns), 2, -5) * off_m)
    right, bent = (solve_with_ties(smoothed, time_ns, one) for one in (ties, wild))
    assert lengths(errors(walk, bent) - errors(walk, right)).max() < 0.3
    assert np.sqrt(np.trace(mapped_path(bent)[1], axis1=1, axis2=2) / 2).max() < 1.0


def test_who_hangs_on_the_same_landmarks_makes_them_no_surer() -> None:
    walk, smoothed, time_ns = walk_past_few(0)
    off = np.kron(np.full((8, 8), 0.25), np.eye(2)) + 1e-4 * np.eye(16)
    joint = np.full((24, 24), np.nan)
    joint[:16, :16] = off
    unknown = np.full(8, np.nan)
    landmarks = LandmarkPriors(walk.place, np.tile(0.25 * np.eye(2), (8, 1, 1)), unknown, unknown, joint)
    alone = solve_walk(smoothed.model.observations, landmarks)
    assert alone is not None
    tied = solve_with_ties(alone, time_ns, ties_of(walk, time_ns, np.zeros(2), 0.05))
    assert mapped_path(tied)[1][:, 0, 0].min() > 0.8 * 0.25


@pytest.mark.parametrize(("away_s", "tied"), [(0.4, True), (0.6, False)])
def test_a_moment_more_than_half_a_second_from_every_frame_ties_nothing(away_s: float, tied: bool) -> None:
    walk, smoothed, time_ns = walk_past_few(0)
    end = as_points(walk.truth[-1:] + 3.0)
    tie = PlaceTies(time_ns[-1:] + int(away_s * 1e9), end, np.eye(2) * 0.05**2)
    assert (solve_with_ties(smoothed, time_ns, tie) is not smoothed) == tied
