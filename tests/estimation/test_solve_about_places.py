"""A walk solved by where it was at some moments: without landmarks, with some, and with a wrong place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import Drifting, loops
from vislam2tag.core.arrays import ComplexArray, FloatArray, IntArray
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.fault_detection import contradictions, slips
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.observations import Passes, WalkObservations
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path, solve_about_places, solve_walk
from vislam2tag.estimation.tracker_errors import NoiseLevels

TYPICAL = NoiseLevels(position_m=0.016, heading_rad=0.003, scale=0.002, sighting_m=0.09, sheet_rad=0.03)
SIGMA_M = 0.2


def without_landmarks(walk: Drifting) -> WalkObservations:
    seen = walk.observations()
    none = np.empty(0, dtype=np.int64)
    passes: Passes = seen.passes.select(none)
    return WalkObservations((), seen.odometry, passes)


def places_of(walk: Drifting, seed: int = 0, sigma_m: float = SIGMA_M) -> tuple[IntArray, ComplexArray, FloatArray]:
    """Frames every 5 m, where the walk was then, with errors, and the turn of the tracker's frame."""
    rng = np.random.default_rng(seed)
    at = np.arange(25, len(walk.truth), 50)
    error = sigma_m * (rng.standard_normal(len(at)) + 1j * rng.standard_normal(len(at)))
    return at, walk.truth[at] + error, np.angle(walk.factor[at])


def solved(
    walk: Drifting,
    observations: WalkObservations,
    places: tuple[IntArray, ComplexArray, FloatArray],
    priors: LandmarkPriors | None = None,
    sigma_m: float = SIGMA_M,
) -> SolvedWalk:
    known = LandmarkPriors.nothing(len(observations.ids)) if priors is None else priors
    covariance_m2 = np.eye(2 * len(places[0])) * sigma_m**2
    return solve_about_places(observations, known, *places, covariance_m2)


def errors_m(walk: Drifting, smoothed: SolvedWalk) -> FloatArray:
    return np.asarray(np.linalg.norm(mapped_path(smoothed)[0] - as_points(walk.truth), axis=1))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_exact_places_map_a_perfect_tracker_exactly(seed: int) -> None:
    walk = loops(seed, marks=4, laps=1)
    smoothed = solved(walk, without_landmarks(walk), places_of(walk, sigma_m=0.0), sigma_m=0.02)
    assert errors_m(walk, smoothed).max() < 0.02
    turned = walk.factor / np.abs(walk.factor)
    np.testing.assert_allclose(np.exp(1j * mapped_path(smoothed)[2]), turned, atol=0.01)
    assert smoothed.mean_scale()[0] == pytest.approx(abs(walk.factor[0]), abs=0.002)


def test_places_with_errors_are_smoothed_and_sigma_says_so() -> None:
    walk = loops(4, TYPICAL, marks=4, laps=2)
    places = places_of(walk)
    smoothed = solved(walk, without_landmarks(walk), places)
    own_m = float(np.mean(np.abs(places[1] - walk.truth[places[0]])))
    assert errors_m(walk, smoothed).mean() < 0.7 * own_m
    sigma_m = np.sqrt(np.trace(mapped_path(smoothed)[1], axis1=1, axis2=2) / 2)
    assert 0.5 < np.sqrt(np.mean((errors_m(walk, smoothed) / sigma_m) ** 2) / 2) < 1.5
    assert smoothed.unreached_sigmas < 0.5


def test_a_turn_that_changes_along_the_walk_is_followed() -> None:
    walk = loops(5, NoiseLevels(0.005, 0.03, 0.0, 0.09, 0.03), marks=4, laps=2)
    assert np.ptp(np.unwrap(np.angle(walk.factor))) > 0.2
    smoothed = solved(walk, without_landmarks(walk), places_of(walk))
    assert errors_m(walk, smoothed).max() < 0.6


def test_one_wrong_place_is_not_believed() -> None:
    walk = loops(4, TYPICAL, marks=4, laps=2)
    at, place, turn_rad = places_of(walk)
    before = errors_m(walk, solved(walk, without_landmarks(walk), (at, place, turn_rad)))
    place[7] += 6 - 5j
    after = errors_m(walk, solved(walk, without_landmarks(walk), (at, place, turn_rad)))
    assert after.max() < before.max() + 0.4


def test_landmarks_help_beside_places() -> None:
    walk = loops(4, TYPICAL, marks=8, laps=2, survey_m=0.02)
    places = places_of(walk, sigma_m=0.5)
    alone = solved(walk, without_landmarks(walk), places, sigma_m=0.5)
    both = solved(walk, walk.observations(), places, LandmarkPriors.of(walk.ids, walk.landmarks()), 0.5)
    assert errors_m(walk, both).mean() < 0.7 * errors_m(walk, alone).mean()
    assert len(both.landmark_position) == 8 + len(places[0])
    assert both.landmark_position[:8] == pytest.approx(walk.place, abs=0.15)


def test_places_are_no_landmarks_that_contradict_and_show_no_slips() -> None:
    walk = loops(4, TYPICAL, marks=8, laps=2, survey_m=0.02)
    at, place, turn_rad = places_of(walk)
    place[[3, 9]] += 4.0
    smoothed = solved(walk, walk.observations(), (at, place, turn_rad), LandmarkPriors.of(walk.ids, walk.landmarks()))
    assert contradictions(smoothed) == ()
    assert slips(smoothed) == ()
    survey = walk.landmarks()
    survey.position_bcs[3] += (1.5, 0.0)
    off = solved(walk, walk.observations(), places_of(walk), LandmarkPriors.of(walk.ids, survey))
    assert [one.landmark for one in contradictions(off)] == ["L3"]


def test_a_map_that_turned_during_a_loss_is_turned_back_by_the_places() -> None:
    walk = loops(4, TYPICAL, marks=4, laps=2)
    observations, frame, turn = without_landmarks(walk), 600, np.exp(1.5j)
    path, jump_rad2 = observations.odometry.path.copy(), observations.odometry.jump_rad2.copy()
    path[frame:] = path[frame] + (path[frame:] - path[frame]) * turn
    jump_rad2[frame - 1] = 1.0
    lost = replace(observations, odometry=replace(observations.odometry, path=path, jump_rad2=jump_rad2))
    at, place, turn_rad = places_of(walk)
    turn_rad = np.where(at < frame, turn_rad, turn_rad - 1.5)
    error_m = errors_m(walk, solved(walk, lost, (at, place, turn_rad)))
    assert np.delete(error_m, slice(frame - 30, frame + 30)).max() < 0.6


def test_between_places_no_slip_is_reported() -> None:
    walk = loops(4, TYPICAL, marks=8, laps=2, survey_m=0.02)
    observations = walk.observations()
    path = observations.odometry.path.copy()
    path[603:] += 3.0
    slipped = replace(observations, odometry=replace(observations.odometry, path=path))
    priors = LandmarkPriors.of(walk.ids, walk.landmarks())
    alone = solve_walk(slipped, priors)
    assert alone is not None
    assert len(slips(alone)) == 1
    assert slips(solved(walk, slipped, places_of(walk), priors)) == ()
