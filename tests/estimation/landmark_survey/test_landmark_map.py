"""Local maps and a survey joined to one map of all landmarks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.estimation.landmark_survey.local_maps import building, seen_from, surveyed
from vislam2tag.core.arrays import ComplexArray
from vislam2tag.core.transforms import as_points
from vislam2tag.estimation.landmark_priors import LandmarkPriors
from vislam2tag.estimation.landmark_survey.landmark_map import Doubts, LandmarkMap, initial_map, join, predicted, solved
from vislam2tag.estimation.landmark_survey.local_map import LocalMap
from vislam2tag.quality.evaluation.reliability import region_probability

ANGLE = st.floats(-np.pi, np.pi)
SEEN = [[0, 1, 2, 3, 4, 5], [4, 5, 6, 7, 8], [7, 8, 9, 10, 11, 0]]


def walks(seed: int, turns: list[float], noise_m: float = 0.0) -> tuple[ComplexArray, list[LocalMap]]:
    place, heading = building(12, seed)
    rng = np.random.default_rng(seed + 1)
    origins = rng.uniform(-200, 200, (len(turns), 2)) @ (1, 1j)
    maps = [seen_from(place, heading, SEEN[i % 3], turn, origins[i]) for i, turn in enumerate(turns)]
    noisy = [
        replace(one, position=one.position + noise_m * (rng.standard_normal((len(one.position), 2)) @ (1, 1j)))
        for one in maps
    ]
    return place, noisy


@settings(max_examples=25)
@given(st.integers(0, 1000), ANGLE, ANGLE, ANGLE)
def test_without_noise_all_is_recovered_whatever_the_frames(seed: int, a: float, b: float, c: float) -> None:
    place, maps = walks(seed, [a, b, c])
    joined = join(maps, surveyed(place, [0, 3, 10]))
    assert joined.position == pytest.approx(place, abs=1e-6)
    assert np.exp(1j * joined.heading_rad) == pytest.approx(np.exp(1j * building(12, seed)[1]), abs=1e-6)
    assert np.exp(1j * joined.turn_rad) == pytest.approx(np.exp(1j * np.array([a, b, c])), abs=1e-6)


def joined_with_usual_doubts(maps: list[LocalMap], priors: LandmarkPriors) -> LandmarkMap:
    joined, marks = initial_map(tuple(maps), priors), len(priors.position)
    even = Doubts(1e-9, tuple(np.ones(len(one.landmark)) for one in maps), np.ones(len(maps)), np.ones(marks))
    for _ in range(5):
        joined = solved(replace(joined, doubts=even))
    return joined


def test_a_map_twice_is_a_map_with_half_the_covariance() -> None:
    place, maps = walks(5, [0.3, 1.0, -2.0], noise_m=0.1)
    priors = surveyed(place, [0, 3, 10])
    twice = joined_with_usual_doubts([*maps, maps[1]], priors)
    half = replace(maps[1], covariance=maps[1].covariance / 2)
    once = joined_with_usual_doubts([maps[0], half, maps[2]], priors)
    assert twice.position == pytest.approx(once.position, abs=1e-8)
    assert twice.covariance == pytest.approx(once.covariance, rel=1e-6, abs=1e-10)


def test_the_order_of_the_maps_does_not_matter() -> None:
    place, maps = walks(6, [0.3, 1.0, -2.0, 2.5], noise_m=0.1)
    one = join(maps, surveyed(place, [0, 3, 10]))
    other = join(maps[::-1], surveyed(place, [0, 3, 10]))
    assert other.position == pytest.approx(one.position, abs=1e-6)
    assert other.covariance == pytest.approx(one.covariance, rel=1e-4, abs=1e-8)


def test_the_building_may_be_turned_and_moved() -> None:
    place, maps = walks(7, [0.3, 1.0, -2.0], noise_m=0.1)
    one = join(maps, surveyed(place, [0, 3, 10]))
    turned = join(maps, surveyed(place * np.exp(1.1j) + 40, [0, 3, 10]))
    assert turned.position == pytest.approx(one.position * np.exp(1.1j) + 40, abs=1e-6)


def as_stated(seed: int) -> tuple[ComplexArray, list[LocalMap], LandmarkPriors]:
    """A building, walks through it and a survey of it, all with the errors that they state."""
    place, maps = walks(seed, [0.3, 1.0, -2.0, 2.5, 0.1, 1.4], noise_m=0.1)
    rng, priors = np.random.default_rng(seed + 1000), surveyed(place, [0, 3, 10])
    priors.position[[0, 3, 10]] += 0.02 * (rng.standard_normal((3, 2)) @ (1, 1j))
    turned = [replace(one, heading_rad=one.heading_rad + 0.03 * rng.standard_normal(len(one.landmark))) for one in maps]
    return place, turned, priors


def shares_inside(join_maps: Callable[[list[LocalMap], LandmarkPriors], LandmarkMap], seeds: int) -> list[float]:
    """Shares of all landmarks that lie inside their regions of 68 % and of 95 %."""
    found = []
    for seed in range(seeds):
        place, maps, priors = as_stated(seed)
        joined = join_maps(maps, priors)
        found.append(region_probability(as_points(joined.position - place), joined.position_covariance))
    return [float(np.mean(np.concatenate(found) < share)) for share in (0.68, 0.95)]


def test_errors_are_as_great_as_stated_where_all_is_trusted_alike() -> None:
    assert shares_inside(joined_with_usual_doubts, 120) == [
        pytest.approx(0.68, abs=0.05),
        pytest.approx(0.95, abs=0.02),
    ]


@pytest.mark.campaign
def test_doubts_make_errors_no_greater_than_stated_and_hardly_smaller() -> None:
    of_68, of_95 = shares_inside(join, 40)
    assert 0.68 < of_68 < 0.86
    assert of_95 > 0.95


def test_a_moved_sheet_spoils_neither_its_place_nor_the_others() -> None:
    place, maps = walks(8, [0.3, 1.0, -2.0, 2.5, 0.1, 1.4], noise_m=0.03)
    moved = maps[0].position.copy()
    moved[2] += 4
    joined = join([replace(maps[0], position=moved), *maps[1:]], surveyed(place, [0, 3, 10]))
    assert np.abs(joined.position - place).max() < 0.3
    assert joined.doubts.shift[0][2] > 100 * np.median(joined.doubts.shift[0])


def test_a_walk_elsewhere_does_not_spoil_the_others() -> None:
    place, maps = walks(9, [0.3, 1.0, -2.0, 2.5, 0.1, 1.4], noise_m=0.03)
    elsewhere = seen_from(building(12, 77)[0], np.full(12, np.nan), SEEN[0], 0.0, 0j)
    joined = join([*maps, elsewhere], surveyed(place, [0, 3, 10]))
    assert np.abs(joined.position - place).max() < 0.3


def test_a_wrongly_surveyed_landmark_is_put_right_by_the_others() -> None:
    place, maps = walks(10, [0.3, 1.0, -2.0, 2.5, 0.1, 1.4], noise_m=0.03)
    priors = surveyed(place, [0, 3, 7, 10])
    priors.position[3] += 2
    joined = join(maps, priors)
    trial = predicted(joined, 3)
    assert abs(trial.position[3] - place[3]) < 0.4
    assert np.sqrt(np.trace(trial.position_covariance[3]) / 2) < 0.4
    without = join(maps, surveyed(place, [0, 7, 10]))
    assert trial.position == pytest.approx(without.position, abs=0.03)
    assert trial.position_covariance[3] == pytest.approx(without.position_covariance[3], rel=0.2, abs=1e-3)


def test_what_nothing_ties_stays_out_and_changes_nothing() -> None:
    place, maps = walks(11, [0.3, 1.0, -2.0], noise_m=0.1)
    place = np.concatenate((place, place[:3] + 100))
    alone = seen_from(place, np.full(15, np.nan), [12, 13, 14], 0.5, 3j)
    one, other = join(maps, surveyed(place, [0, 3, 10])), join([*maps, alone], surveyed(place, [0, 3, 10]))
    assert other.tied.tolist() == [True, True, True, False]
    assert other.position[:12] == pytest.approx(one.position[:12], abs=1e-9)
    assert (other.position_covariance[12:, 0, 0] > 1e6).all()
