"""What the other walks say of the landmarks that a walk passes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.estimation.landmark_survey.local_maps import building, surveyed
from tests.estimation.landmark_survey.test_landmark_map import as_stated, joined_with_usual_doubts, walks
from vislam2tag.core.arrays import joint_columns, of_landmarks
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.landmark_survey.comparison import OtherWalks
from vislam2tag.estimation.landmark_survey.landmark_map import LandmarkMap, join, solved
from vislam2tag.quality.evaluation.reliability import region_probability


def usual(seed: int) -> LandmarkMap:
    _, maps = walks(seed, [0.3, 1.0, -2.0, 2.5], noise_m=0.1)
    return joined_with_usual_doubts(maps, surveyed(building(12, seed)[0], [0, 3, 10]))


def untied(joined: LandmarkMap, number: int) -> LandmarkMap:
    out = np.arange(len(joined.maps)) == number
    turn_rad = np.where(out, np.nan, joined.turn_rad)
    return replace(joined, turn_rad=turn_rad, origin=np.where(out, np.nan, joined.origin))


def test_a_walk_is_told_what_the_map_without_it_says() -> None:
    joined = usual(5)
    for number in range(4):
        without = solved(untied(joined, number))
        told = OtherWalks(joined).told(number)
        assert told.position == pytest.approx(without.position[told.landmark], abs=1e-6)
        assert told.covariance == pytest.approx(of_landmarks(without.covariance, told.landmark), rel=1e-4, abs=1e-8)


def test_where_a_walk_should_see_landmarks_is_less_certain_by_how_far_walks_see_them_off() -> None:
    others = OtherWalks(replace(usual(5), doubts=replace(usual(5).doubts, shift_m=0.3)))
    told, seen = others.told(1), others.seen(1)
    off_m2 = np.repeat((0.3**2 * 5 / 3, 0.0), (2 * len(told.landmark), len(told.landmark)))
    assert seen.covariance == pytest.approx(told.covariance + np.diag(off_m2))
    assert seen.landmark.tolist() == told.landmark.tolist()


def test_what_a_walk_alone_saw_it_is_not_told() -> None:
    joined = usual(6)
    only = {1, 2, 6}  # of these maps, the first alone passes 1 and 2, the second 6
    maps = joined.maps[:3]
    told = OtherWalks(joined_with_usual_doubts(list(maps), joined.priors)).told(0)
    assert not np.isin([1, 2], told.landmark).any()
    assert only - {1, 2} <= set(told.landmark.tolist())


def test_a_walk_that_is_not_tied_is_told_everything() -> None:
    apart = untied(usual(7), 3)
    told = OtherWalks(apart).told(3)
    assert told.landmark.tolist() == list(range(12))
    assert told.position == pytest.approx(solved(apart).position, abs=1e-6)


def test_shared_errors_are_told_with_their_covariance_and_are_as_great_as_stated() -> None:
    probability, apart = [], []
    for seed in range(15):
        place, maps, priors = as_stated(seed)
        told = OtherWalks(join(maps, priors)).seen(0)
        miss = as_points(told.position - place[told.landmark])
        k = len(miss)
        each = np.stack([told.covariance[np.ix_((2 * i, 2 * i + 1), (2 * i, 2 * i + 1))] for i in range(k)])
        probability.append(region_probability(miss, each))
        near = [row for row, landmark in enumerate(told.landmark.tolist()) if landmark in (4, 5)]
        column = joint_columns(np.array(near), k)[:4]
        covariance = told.covariance[np.ix_(column, column)]
        difference = np.array([[-1, 0, 1, 0], [0, -1, 0, 1]])
        between = difference @ covariance @ difference.T
        apart.append(np.trace(between) / (np.trace(covariance)))
    assert 0.6 < np.mean(np.concatenate(probability) < 0.68) < 0.9
    assert np.mean(np.concatenate(probability) < 0.95) > 0.9
    assert np.mean(apart) < 1  # errors of neighbours are alike
