"""Landmarks that contradict all others are named, with the size of it; no others are.

Slips between two passes: reported where the tracker led far off, and only there.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import Drifting, loops
from vislam2tag.core.status import Contradiction, EventKind, TrackerEvent
from vislam2tag.core.tracks import Landmarks
from vislam2tag.estimation.fault_detection import contradictions, may_have_slipped, slips
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import WalkObservations
from vislam2tag.estimation.smoother import SolvedWalk, solve_walk
from vislam2tag.estimation.tracker_errors import NoiseLevels

TYPICAL = NoiseLevels(position_m=0.016, heading_rad=0.003, scale=0.002, sighting_m=0.09, sheet_rad=0.03)


def named(walk: Drifting, survey: Landmarks) -> tuple[Contradiction, ...]:
    smoothed = solve_walk(walk.observations(), LandmarkPriors.of(walk.ids, survey))
    assert smoothed is not None
    return contradictions(smoothed)


def test_no_landmark_and_no_slip_is_named_on_clean_walks() -> None:
    for seed in range(8):
        walk = loops(seed, TYPICAL, marks=8, laps=2, survey_m=0.02)
        smoothed = solve_walk(walk.observations(), LandmarkPriors.of(walk.ids, walk.landmarks()))
        assert smoothed is not None
        assert (contradictions(smoothed), slips(smoothed)) == ((), ())


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("offset", [(1.0, 0.0), (-0.6, 0.8), (3.0, -5.0)])
def test_a_mis_surveyed_landmark_is_named_with_its_size(seed: int, offset: tuple[float, float]) -> None:
    walk = loops(seed, TYPICAL, marks=8, laps=2, survey_m=0.02)
    survey = walk.landmarks()
    survey.position_bcs[3] += offset
    found = named(walk, survey)
    assert [one.landmark for one in found] == ["L3"]
    one = found[0]
    size = float(np.hypot(*offset))
    assert abs(one.size_m - size) < 3 * one.sigma_m + 0.02
    assert one.sigma_m < 0.5 * size
    np.testing.assert_allclose(one.offset_bcs_m, -np.array(offset), atol=4 * one.sigma_m)
    assert one.passes == 2


def test_two_bad_landmarks_are_named_the_worse_first() -> None:
    walk = loops(5, TYPICAL, marks=10, laps=2)
    survey = walk.landmarks()
    survey.position_bcs[2] += (0.0, 1.5)
    survey.position_bcs[7] += (-4.0, 0.0)
    assert [one.landmark for one in named(walk, survey)] == ["L7", "L2"]


def test_two_swapped_landmarks_are_both_named() -> None:
    walk = loops(6, TYPICAL, marks=10, laps=2)
    survey = walk.landmarks()
    survey.position_bcs[[4, 5]] = survey.position_bcs[[5, 4]]
    assert {one.landmark for one in named(walk, survey)} == {"L4", "L5"}


def test_with_two_landmarks_nobody_can_tell_which_is_wrong() -> None:
    walk = loops(7, TYPICAL, marks=2, laps=2)
    survey = walk.landmarks()
    survey.position_bcs[1] += (1.0, 0.0)
    assert named(walk, survey) == ()


def test_what_is_less_than_anybody_cares_for_is_not_named() -> None:
    noise = NoiseLevels(position_m=0.001, heading_rad=0.0003, scale=0.0002, sighting_m=0.005, sheet_rad=0.01)
    walk = loops(9, noise, marks=8, laps=3)
    for off_m, names in ((0.1, []), (0.3, ["L3"])):
        survey = walk.landmarks()
        survey.covariance_bcs[:] = np.eye(2) * 0.005**2
        survey.position_bcs[3] += (off_m, 0.0)
        assert [one.landmark for one in named(walk, survey)] == names


def test_a_stated_survey_error_is_no_contradiction() -> None:
    walk = loops(8, TYPICAL, marks=8, laps=2)
    survey = walk.landmarks()
    survey.position_bcs[3] += (0.8, 0.0)
    survey.covariance_bcs[3] = np.eye(2)
    assert named(walk, survey) == ()


def found(walk: Drifting, observations: WalkObservations) -> tuple[TrackerEvent, ...]:
    smoothed = solve_walk(observations, LandmarkPriors.of(walk.ids, walk.landmarks()))
    assert smoothed is not None
    return slips(smoothed)


def slipped(observations: WalkObservations, step: int, by: complex) -> WalkObservations:
    """Lead all frames after a step elsewhere, without any trace in the odometry."""
    path = observations.odometry.path.copy()
    path[step + 1 :] += by
    return replace(observations, odometry=replace(observations.odometry, path=path))


@pytest.mark.parametrize("by", [0.6j, 2.0j, -2.0 + 2.0j])
def test_a_slip_is_found_in_its_stretch_with_its_size(by: complex) -> None:
    walk = loops(6, TYPICAL, marks=8, laps=2, survey_m=0.02)
    observations = walk.observations()
    step = int(observations.nodes[6:8].mean())
    (event,) = found(walk, slipped(observations, step, by))
    assert event.kind is EventKind.SLIP
    assert observations.nodes[6] <= event.frame <= observations.nodes[7]
    assert event.size_m == pytest.approx(abs(by), abs=0.4)
    assert event.turn_rad == pytest.approx(0.0, abs=0.1)


def test_what_usual_drift_explains_is_no_slip() -> None:
    walk = loops(6, TYPICAL, marks=8, laps=2, survey_m=0.02)
    observations = walk.observations()
    assert found(walk, slipped(observations, int(observations.nodes[6:8].mean()), 0.25)) == ()


def test_a_doubtful_step_says_when_it_happened_and_a_known_jump_is_not_told_twice() -> None:
    walk = loops(7, TYPICAL, marks=8, laps=2, survey_m=0.02)
    observations = walk.observations()
    step = int(observations.nodes[6]) + 10
    doubt = np.zeros(len(observations.odometry.path) - 1, dtype=np.complex128)
    doubt[step] = 0.01j
    observations = slipped(observations, step, 2.0j)
    (event,) = found(walk, replace(observations, odometry=replace(observations.odometry, doubt=doubt)))
    assert event.frame == step + 1
    priors = replace(observations.odometry, doubt=doubt, jumped=doubt != 0)
    assert found(walk, replace(observations, odometry=priors)) == ()


def test_a_larger_doubt_across_does_not_say_when() -> None:
    walk = loops(7, TYPICAL, marks=8, laps=2, survey_m=0.02)
    observations = walk.observations()
    across, step = int(observations.nodes[6]) + 4, int(observations.nodes[6]) + 10
    doubt = np.zeros(len(observations.odometry.path) - 1, dtype=np.complex128)
    doubt[across], doubt[step] = 0.7, 0.6j
    observations = slipped(observations, step, 2.0j)
    (event,) = found(walk, replace(observations, odometry=replace(observations.odometry, doubt=doubt)))
    assert event.frame == step + 1


STRETCH = 4


def drift_residual(by_m: float, usual_m: float) -> SolvedWalk:
    """A walk found to have led this far off over one stretch, of a tracker that usually drifts so much there."""
    walk = loops(1, marks=8, laps=1, drifted=False)
    smoothed = solve_walk(walk.observations(), LandmarkPriors.of(walk.ids, walk.landmarks()))
    assert smoothed is not None
    state = np.zeros_like(smoothed.solution.state)
    state[STRETCH + 1 :, 0] = by_m
    way_m = float(np.ptp(walk.time_s[smoothed.model.observations.nodes[STRETCH : STRETCH + 2]]))  # at 1 m/s
    noise = NoiseLevels(position_m=usual_m / np.sqrt(way_m), heading_rad=0.0, scale=0.0)
    linear = replace(smoothed.linear, variance_factors=replace(smoothed.variance_factors, noise=noise))
    return replace(smoothed, linear=linear, solution=replace(smoothed.solution, state=state))


@pytest.mark.parametrize(("by_m", "usual_m", "slip"), [(0.7, 0.2, False), (0.9, 0.2, True), (0.33, 0.02, True)])
def test_a_slip_leads_farther_off_than_four_times_the_usual_drift(by_m: float, usual_m: float, slip: bool) -> None:
    assert len(slips(drift_residual(by_m, usual_m))) == slip


@pytest.mark.parametrize(("by_m", "asked"), [(0.12, False), (0.18, True), (0.27, True)])
def test_other_sensors_are_asked_where_less_than_a_slip_may_be_made_good(by_m: float, asked: bool) -> None:
    smoothed = drift_residual(by_m, 0.02)
    assert may_have_slipped(smoothed) == asked
    assert slips(smoothed) == ()
