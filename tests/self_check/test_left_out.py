"""Landmarks left out of walks drawn from the model itself."""

from __future__ import annotations

from dataclasses import replace
from unittest import mock

import numpy as np
import pytest

from tests.drifting import SURVEY_SIGMA_M, Drifting, loops
from vislam2tag.core.similarity import as_points
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.noise import NoiseLevels
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path, solve_walk
from vislam2tag.self_check import left_out
from vislam2tag.self_check.accuracy import estimate_accuracy
from vislam2tag.self_check.left_out import MOST_SOLUTIONS, leave_out

TYPICAL = NoiseLevels(position_m=0.016, heading_rad=0.003, scale=0.002, sighting_m=0.09, sheet_rad=0.03)


def smoothed(walk: Drifting, surveyed: list[int] | None = None, headed: list[int] | None = None) -> SolvedWalk:
    found = solve_walk(walk.observations(), LandmarkPriors.of(walk.ids, walk.landmarks(surveyed, headed)))
    assert found is not None
    return found


def test_a_perfect_tracker_predicts_every_landmark() -> None:
    errors = leave_out(smoothed(loops(1, marks=6)))
    assert [error.landmark for error in errors] == [f"L{i}" for i in range(6)]
    assert [error.passes for error in errors] == [2] * 6
    assert max(error.size_m for error in errors) < 0.02


def test_a_mis_surveyed_landmark_is_told_and_not_its_neighbours() -> None:
    walk = loops(2, TYPICAL, marks=8)
    moved = walk.place.copy()
    moved[3] += 1.5 - 2j
    errors = {error.landmark: error for error in leave_out(smoothed(replace(walk, surveyed_at=moved)))}
    np.testing.assert_allclose(errors["L3"].offset_m, [-1.5, 2.0], atol=0.4)
    assert errors["L3"].squared_sigmas > 50
    assert all(error.squared_sigmas < 20 for name, error in errors.items() if name != "L3")


def test_unsurveyed_landmarks_are_not_left_out_and_two_cannot_tell_of_each_other() -> None:
    walk = loops(3, TYPICAL, marks=5)
    assert [error.landmark for error in leave_out(smoothed(walk, [0, 2, 4]))] == ["L0", "L2", "L4"]
    assert leave_out(smoothed(walk, [0, 2])) == ()
    with_heading = leave_out(smoothed(walk, [0, 2], headed=[2]))
    assert [error.landmark for error in with_heading] == ["L0"]


def test_many_landmarks_cost_a_limited_number_of_solutions() -> None:
    walk = smoothed(loops(4, TYPICAL, marks=40, laps=1.0, size_m=(60.0, 30.0)))
    with mock.patch.object(left_out, "solve_walk", wraps=solve_walk) as solved:
        errors = leave_out(walk)
    assert solved.call_count == MOST_SOLUTIONS
    assert [error.landmark for error in errors] == [f"L{i}" for i in range(40)]
    assert np.median([error.size_m for error in errors]) < 0.3


@pytest.mark.parametrize("level", [1.0, pytest.param(2.0, marks=pytest.mark.slow)])
def test_estimated_mean_errors_are_those_of_walks_drawn_from_the_model(level: float) -> None:
    names = ("position_m", "heading_rad", "scale", "sighting_m", "sheet_rad")
    noise = NoiseLevels(*(level * getattr(TYPICAL, name) for name in names))
    true, estimated = [], []
    for seed in range(12):
        walk = loops(100 + seed, noise, marks=10, laps=1.5, survey_m=SURVEY_SIGMA_M)
        solved = smoothed(walk)
        position, covariance, _ = mapped_path(solved)
        found = estimate_accuracy(covariance, leave_out(solved))
        assert found is not None
        true.append(np.linalg.norm(position - as_points(walk.truth), axis=1).mean())
        estimated.append(found.estimated_m)
    ratio = np.exp(np.mean(np.log(np.array(estimated) / np.array(true))))
    assert 0.75 < ratio < 1.33
