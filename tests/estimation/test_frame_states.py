"""States between the nodes: the same as if the frame had been a node.

Labels beside a survey that the walk does not fit are known less well, by as much as it is missed by.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.drifting import loops
from tests.estimation.test_factors import bent, linearised, uneven
from tests.estimation.test_smoother import TYPICAL, solved
from vislam2tag.core.arrays import FloatArray
from vislam2tag.core.transforms import camera_to_bcs
from vislam2tag.estimation import factors
from vislam2tag.estimation import frame_states as bridge
from vislam2tag.estimation.factors import LinearWalk, Model
from vislam2tag.estimation.frame_states import KNOT_S, ExposureInterpolation, beside_the_survey, states_between_nodes
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.least_squares import solve
from vislam2tag.estimation.smoother import SolvedWalk
from vislam2tag.estimation.tracker_errors import USUAL, NoiseLevels, VarianceFactors

WORTHLESS_M = 1e4
LIVELY = NoiseLevels(position_m=0.05, heading_rad=0.01, scale=0.005, sighting_m=0.05, sheet_rad=0.02)


def with_worthless_pass(
    model: Model, variance_factors: VarianceFactors, before: int, at: int
) -> tuple[Model, VarianceFactors]:
    """Insert a pass at a frame that says nothing, before the pass of this index; its stretch keeps its factors."""
    passes = model.observations.passes
    saying_nothing = {"at": at, "heading": 0, "spread_m": WORTHLESS_M}
    inserted = {
        name: np.insert(getattr(passes, name), before, saying_nothing.get(name, getattr(passes, name)[0]))
        for name in passes.__dataclass_fields__
    }
    observations = replace(model.observations, passes=replace(passes, **inserted))
    stretch = {source: np.insert(factor, before, factor[before]) for source, factor in variance_factors.stretch.items()}
    more = replace(
        variance_factors,
        stretch=stretch,
        sighting=np.insert(variance_factors.sighting, before, 1.0),
        sheet=np.insert(variance_factors.sheet, before, 1.0),
    )
    return replace(model, observations=observations), more


@pytest.mark.parametrize("stretch", [0, 2, 7])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_bridged_state_is_that_of_a_further_node(stretch: int, share: float, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (bridge, factors):  # the floor under each stretch would count twice for a divided one
        monkeypatch.setattr(module, "LEAST_DRIFT", np.diag([1e-12, 1e-12, 1e-16, 1e-16]))
    walk = loops(1, LIVELY, marks=7, laps=1)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks([0, 2, 3, 6]))
    model = bent(linearised(walk))
    variance_factors = replace(uneven(model, 7, seed=1), noise=LIVELY)
    linear = LinearWalk(model, priors, variance_factors)
    knots = states_between_nodes(linear, solve(linear.normal_equations()))
    first, last = model.observations.nodes[stretch : stretch + 2]
    inside = knots.at[(knots.at > first) & (knots.at < last)]
    frame = inside[int(share * len(inside))]
    at = int(np.flatnonzero(knots.at == frame)[0])
    extended = with_worthless_pass(model, variance_factors, stretch, int(frame))
    solution = solve(LinearWalk(extended[0], priors, extended[1]).normal_equations())
    np.testing.assert_allclose(knots.state[at], solution.state[stretch + 1], atol=1e-6)
    spread = np.sqrt(np.diag(solution.covariance[stretch + 1]))
    np.testing.assert_allclose(
        knots.covariance()[at] / np.outer(spread, spread),
        solution.covariance[stretch + 1] / np.outer(spread, spread),
        atol=1e-4,
    )


def test_at_the_nodes_states_and_covariances_are_the_solutions() -> None:
    walk = loops(2, USUAL, marks=6, laps=1.5)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks())
    model = linearised(walk)
    variance_factors = uneven(model, 6, seed=3)
    solution = solve(LinearWalk(model, priors, variance_factors).normal_equations())
    knots = states_between_nodes(LinearWalk(model, priors, variance_factors), solution)
    at = np.searchsorted(knots.at, model.observations.nodes)
    np.testing.assert_array_equal(knots.at[at], model.observations.nodes)
    np.testing.assert_allclose(knots.state[at], solution.state, atol=1e-6)
    np.testing.assert_allclose(knots.covariance()[at], solution.covariance, atol=1e-5)


def test_between_two_passes_the_walk_is_least_certain_in_the_middle() -> None:
    walk = loops(3, marks=4, laps=1)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks())
    model = linearised(walk)
    variance_factors = VarianceFactors.even(replace(USUAL, sighting_m=0.005), 4, 4)
    linear = LinearWalk(model, priors, variance_factors)
    knots = states_between_nodes(linear, solve(linear.normal_equations()))
    sigma = np.sqrt(np.trace(knots.covariance()[:, :2, :2], axis1=1, axis2=2) / 2)
    _, first, second, third, _, _ = np.searchsorted(knots.at, model.observations.nodes)
    for start, stop in ((first, second), (second, third)):
        peak = start + int(np.argmax(sigma[start:stop]))
        assert start + 0.3 * (stop - start) < peak < start + 0.7 * (stop - start)
        assert sigma[peak] > 1.1 * max(sigma[start], sigma[stop])
    assert np.linalg.eigvalsh(knots.covariance()).min() > 0


def test_a_pause_does_not_smear_over_the_frames_before_it() -> None:
    walk = loops(5, LIVELY, marks=4, laps=1)
    first_of_knot = np.flatnonzero(np.diff(np.floor(walk.time_s / KNOT_S)) > 0) + 1
    last = int(first_of_knot[len(first_of_knot) // 3]) + 1  # no knot but for the pause after it
    late = np.arange(len(walk.time_s)) > last
    model = linearised(replace(walk, time_s=walk.time_s + np.where(late, 600.0, 0.0)))
    trusted = np.zeros(len(late) - 1)  # as where the phone was put down: nothing else marks the pause
    odometry = replace(model.observations.odometry, jump_m2=trusted, jump_rad2=trusted)
    model = replace(model, observations=replace(model.observations, odometry=odometry))
    priors = LandmarkPriors.of(walk.ids, walk.landmarks())
    variance_factors = VarianceFactors.even(LIVELY, 4, 4)
    solution = solve(LinearWalk(model, priors, variance_factors).normal_equations())
    usual = states_between_nodes(LinearWalk(model, priors, variance_factors), solution)
    dense = states_between_nodes(LinearWalk(model, priors, variance_factors), solution, 1e-3)  # every frame is a knot
    assert last not in model.observations.nodes
    assert len(usual.at) < len(dense.at) == len(late)
    sigma = np.sqrt(np.trace(dense.covariance()[:, :2, :2], axis1=1, axis2=2) / 2)
    assert abs(sigma[last + 1] - sigma[last]) > 0.05
    near = slice(last - 2, last + 3)
    covariance = usual.at_frames(usual.covariance(), len(late))[near]
    np.testing.assert_allclose(covariance, dense.covariance()[near], atol=1e-3)
    np.testing.assert_allclose(usual.at_frames(usual.state, len(late))[near], dense.state[near], atol=1e-2)


def test_values_at_knots_are_met_at_their_frames() -> None:
    walk = loops(4, marks=4, laps=1)
    model = linearised(walk)
    priors = LandmarkPriors.of(walk.ids, walk.landmarks())
    variance_factors = VarianceFactors.even(USUAL, 4, 4)
    linear = LinearWalk(model, priors, variance_factors)
    knots = states_between_nodes(linear, solve(linear.normal_equations()))
    every = knots.at_frames(knots.covariance(), len(walk.truth))
    assert every.shape == (len(walk.truth), 4, 4)
    np.testing.assert_allclose(every[knots.at], knots.covariance())
    assert knots.at[0] == 0
    assert knots.at[-1] == len(walk.truth) - 1


TIME_S = np.arange(100) / 30.0
UPRIGHT = np.tile((0.0, 0.0, 0.0, 1.0), (100, 1))


@given(st.floats(-0.4, 0.4))
def test_a_walker_is_where_he_was_at_the_stamp(lag_s: float) -> None:
    stamped_late = TIME_S + lag_s
    at_stamps = ExposureInterpolation.of(stamped_late, lag_s).blend(np.column_stack((TIME_S, -2 * TIME_S)))
    inside = (stamped_late >= TIME_S[0]) & (stamped_late <= TIME_S[-1])
    np.testing.assert_allclose(at_stamps[inside], np.column_stack((stamped_late, -2 * stamped_late))[inside], atol=1e-9)


def test_without_a_lag_nothing_changes() -> None:
    values = np.random.default_rng(1).standard_normal((100, 2, 2))
    np.testing.assert_allclose(ExposureInterpolation.of(TIME_S, 0.0).blend(values), values)


def test_beyond_the_last_exposure_the_pose_stands_still() -> None:
    at_stamps = ExposureInterpolation.of(TIME_S, 0.2).blend(TIME_S)
    np.testing.assert_allclose(at_stamps[-6:], TIME_S[-1])


def test_what_is_not_known_stays_so_and_spoils_no_neighbour() -> None:
    height = np.where(np.arange(100) < 50, np.nan, 3.0)
    np.testing.assert_array_equal(ExposureInterpolation.of(TIME_S, 0.05).blend(height), height)


@pytest.mark.parametrize("lag_s", [0.05, -0.05])
def test_orientations_turn_with_the_walk(lag_s: float) -> None:
    heading = camera_to_bcs(UPRIGHT, 4.0 * TIME_S)  # more than a turn: the sign of w changes on the way
    wanted = camera_to_bcs(UPRIGHT, 4.0 * (TIME_S + lag_s))
    found = ExposureInterpolation.of(TIME_S + lag_s, lag_s).blend_quaternions(heading)
    np.testing.assert_allclose(found[5:-5], wanted[5:-5], atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1)
    assert np.all(found[:, 3] >= 0)


LANDMARK = 3


def walked(laps: int) -> SolvedWalk:
    """A walk that passes each landmark once a lap, all observations taken for usual."""
    smoothed = solved(loops(3, TYPICAL, marks=8, laps=laps, survey_m=0.02))
    even = (np.ones_like(part) for part in (smoothed.variance_factors.sighting, smoothed.variance_factors.landmark))
    variance_factors = replace(smoothed.variance_factors, sighting=next(even), landmark=next(even))
    return replace(smoothed, linear=replace(smoothed.linear, variance_factors=variance_factors))


def beside(smoothed: SolvedWalk) -> FloatArray:
    """(k, 2, 2) at the passes of the landmark, m^2."""
    whole = beside_the_survey(smoothed.linear, smoothed.solution)
    passes = smoothed.model.observations.passes
    return np.asarray(whole[passes.at[passes.landmark == LANDMARK]])


@pytest.mark.parametrize(
    ("passes", "refused", "doubtful"), [(1, 1, False), (2, 1, False), (2, 2, True), (4, 2, False), (4, 3, True)]
)
def test_two_refused_passes_and_most_of_all_make_a_place_doubtful(passes: int, refused: int, doubtful: bool) -> None:
    smoothed = walked(passes)
    own = np.flatnonzero(smoothed.model.observations.passes.landmark == LANDMARK)
    assert len(own) == passes
    smoothed.variance_factors.sighting[own[:refused]] = 10.0
    wider = np.trace(beside(smoothed), axis1=1, axis2=2) > 0
    assert wider.tolist() == [doubtful] * refused + [False] * (passes - refused)


@pytest.mark.parametrize(("less_certain", "share"), [(1.9, 0.0), (4.0, 0.5), (20.0, 0.9)])
def test_what_a_doubtful_place_is_missed_by_counts_as_far_as_that_is_unusual(less_certain: float, share: float) -> None:
    smoothed = walked(1)
    smoothed.variance_factors.landmark[LANDMARK] = less_certain
    (at,) = np.flatnonzero(smoothed.model.observations.passes.landmark == LANDMARK)
    model, state = smoothed.model, smoothed.solution.state[1:-1]
    miss = smoothed.linear.sightings.residual[at] - model.sighting_jacobian[at] @ state[at]
    assert np.hypot(*miss) > 0.001
    np.testing.assert_allclose(beside(smoothed), share * np.outer(miss, miss)[None], atol=1e-12)
