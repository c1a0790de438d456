"""Landmarks that contradict all others are named, with the size of it; no others are."""

from __future__ import annotations

import numpy as np
import pytest

from tests.drifting import Drifting, loops
from vislam2tag.core.faults import Contradiction
from vislam2tag.core.tracks import Landmarks
from vislam2tag.estimation.contradictions import contradictions
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.noise import NoiseLevels
from vislam2tag.estimation.smoothing import smooth

TYPICAL = NoiseLevels(position_m=0.016, heading_rad=0.003, scale=0.002, sighting_m=0.09, sheet_rad=0.03)


def named(walk: Drifting, survey: Landmarks) -> tuple[Contradiction, ...]:
    smoothed = smooth(walk.observations(), LandmarkPriors.of(walk.ids, survey))
    assert smoothed is not None
    return contradictions(smoothed)


def test_no_landmark_is_named_on_clean_walks() -> None:
    names = [named(walk := loops(seed, TYPICAL, marks=8, laps=2, survey_m=0.02), walk.landmarks()) for seed in range(8)]
    assert names == [()] * 8


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
