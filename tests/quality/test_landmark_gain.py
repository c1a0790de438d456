"""What one more landmark brings, by all states at once, by really adding it, and added up over sessions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.drifting import loops
from tests.estimation.dense import as_matrix
from tests.quality.test_self_check import TYPICAL, smoothed
from tests.walks import landmarks_at
from vislam2tag.core.arrays import FloatArray
from vislam2tag.estimation.smoother import SolvedWalk, mapped_path
from vislam2tag.quality import landmark_gain
from vislam2tag.quality.landmark_gain import (
    APART_M,
    BESIDE_M,
    BEST,
    CELL_M,
    REACH,
    SIGHT_M,
    SURVEY_SIGMA_M,
    GainMap,
    gains,
    positions_each_metre,
    session_gains,
)
from vislam2tag.quality.self_check import expected_error_m


@pytest.fixture(scope="module")
def walk() -> SolvedWalk:
    return smoothed(loops(5, TYPICAL, marks=6, laps=1.4), [0, 1, 4])


def joint(walk: SolvedWalk) -> tuple[FloatArray, int]:
    """Precision of all states, a metre apart, and landmarks at once; the number of states."""
    fine = landmark_gain._with_silent_passes(walk)
    matrix, _ = as_matrix(fine.normal_equations())
    return matrix, len(fine.model.observations.nodes)


def position_covariances(precision: FloatArray, count: int) -> FloatArray:
    """Covariances (k, k, 2, 2) between all positions."""
    scale = np.sqrt(np.diag(precision))
    covariance = np.linalg.inv(precision / np.outer(scale, scale)) / np.outer(scale, scale)
    states = covariance[: 4 * count, : 4 * count].reshape(count, 4, count, 4)
    return np.asarray(states[:, :2, :, :2].transpose(0, 2, 1, 3))


def test_states_a_metre_apart_are_the_walk_as_it_was(walk: SolvedWalk) -> None:
    positions = positions_each_metre(walk)
    position, covariance, _ = mapped_path(walk)
    assert np.abs(np.diff(positions.position, axis=0)).max() < 1.3
    assert positions.frames.sum() == len(position)
    np.testing.assert_allclose(positions.position, position[positions.at], atol=1e-3)
    np.testing.assert_allclose(positions.covariance[:, 0], covariance[positions.at], atol=2e-4)


def test_covariances_between_positions_are_those_of_the_joint_solution(walk: SolvedWalk) -> None:
    positions = positions_each_metre(walk)
    expected = position_covariances(*joint(walk))
    for step in (0, 1, 7, 40):
        here = np.arange(len(positions.at) - step)
        np.testing.assert_allclose(positions.covariance[here, step], expected[here, here + step], atol=1e-6)
    assert positions.covariance.shape[1] == REACH + 1


def test_the_gain_is_that_of_the_joint_solution_with_the_sightings_added(walk: SolvedWalk) -> None:
    positions = positions_each_metre(walk)
    found = gains(walk, positions, np.zeros(len(positions.at), dtype=np.int64))
    precision, count = joint(walk)
    before = expected_error_m(positions.covariance[:, 0])
    variance = np.median(walk.variance_factors.sighting) * walk.noise.sighting_m**2 + SURVEY_SIGMA_M**2
    for place, (_, x, y) in enumerate(found):
        if place not in np.linspace(0, len(found) - 1, 7).astype(int):
            continue
        away = np.linalg.norm(np.array([x + 0.5, y + 0.5]) * CELL_M - positions.position, axis=1)
        near = np.split(np.arange(count), np.flatnonzero(np.diff(away <= SIGHT_M)) + 1)
        passes = [run[np.argmin(away[run])] for run in near if away[run[0]] <= SIGHT_M]
        sighted = precision.copy()
        for node in passes:
            sighted[4 * node, 4 * node] += 1 / variance
            sighted[4 * node + 1, 4 * node + 1] += 1 / variance
        after = expected_error_m(np.einsum("kkij->kij", position_covariances(sighted, count)))
        assert found[0, x, y] == pytest.approx(positions.frames @ (before - after), rel=1e-3)


def test_gains_lie_along_the_walk_and_are_greatest_far_from_landmarks(walk: SolvedWalk) -> None:
    positions = positions_each_metre(walk)
    found = gains(walk, positions, np.full(len(positions.at), 3))
    assert {floor for floor, *_ in found} == {3}
    assert min(found.values()) > 0
    centre = (np.array([cell for _, *cell in found]) + 0.5) * CELL_M
    apart = np.linalg.norm(centre[:, None] - positions.position, axis=2).min(axis=1)
    assert apart.max() <= SIGHT_M
    surveyed = walk.priors.position[walk.priors.surveyed]
    alone = np.abs((centre @ [1, 1j])[:, None] - surveyed).min(axis=1)
    assert alone[np.argmax(list(found.values()))] > np.median(alone)


def test_places_of_different_floors_are_different_places(walk: SolvedWalk) -> None:
    positions = positions_each_metre(walk)
    floor = (np.arange(len(positions.at)) > len(positions.at) // 2).astype(np.int64)
    apart = gains(walk, positions, floor)
    first, second = ({(x, y) for on, x, y in apart if on == number} for number in (0, 1))
    assert first & second


def test_a_long_walk_is_cut_to_the_reach_of_a_landmark() -> None:
    walk = smoothed(loops(6, TYPICAL, marks=4, laps=3.0, rate_hz=4.0), [0, 2])
    positions = positions_each_metre(walk)
    assert len(positions.at) > REACH
    found = gains(walk, positions, np.zeros(len(positions.at), dtype=np.int64))
    assert all(0 < gain < np.inf for gain in found.values())


NONE = landmarks_at({})


def session(cells: dict[tuple[int, int, int], float], factor: float = 1.0) -> GainMap:
    """Gains by floor and cell of a session with 10 frames on floor 1 and 30 on floor 2, expected errors 0.2 m."""
    return session_gains(cells, factor, np.repeat([1, 2], [10, 30]), np.full(40, 0.2))


def test_sessions_add_up_floor_by_floor_and_are_means_over_frames() -> None:
    total = GainMap()
    total.add(session({(1, 0, 0): 1.0, (2, 5, 5): 3.0}))
    total.add(session({(1, 0, 0): 0.5}, factor=2.0))
    first, second = total.floors(NONE)
    assert (first.number, first.frames, second.number, second.frames) == (1, 20, 2, 60)
    assert first.expected_m == second.expected_m == pytest.approx(0.3)
    assert total.mean_gain_m(1) == {(0, 0): pytest.approx(2.0 / 20)}
    assert [(place.x_m, place.y_m, place.gain_m) for place in second.places] == [(5.5, 5.5, 0.05)]


def test_the_best_places_come_first_and_lie_apart() -> None:
    total = GainMap()
    total.add(session({(1, x, 0): 30.0 - abs(x - 20) for x in range(9, 40)} | {(1, 0, 30): 0.1}))
    places = total.floors(NONE)[0].places
    assert len(places) == BEST
    assert (places[0].x_m, places[0].y_m) == (20.5, 0.5)
    assert [place.gain_m for place in places] == sorted((place.gain_m for place in places), reverse=True)
    for i, place in enumerate(places):
        assert all(np.hypot(place.x_m - other.x_m, place.y_m - other.y_m) >= APART_M for other in places[:i])


def test_a_floor_that_was_only_walked_through_has_no_places() -> None:
    total = GainMap()
    total.add(session({}))
    assert [floor.places for floor in total.floors(NONE)] == [[], []]


def test_no_place_is_beside_a_landmark_that_hangs_there_and_each_is_told_by_them() -> None:
    total = GainMap()
    total.add(session({(1, x, 0): 30.0 - abs(x - 20) for x in range(9, 40)}))
    hanging = replace(landmarks_at({"7": (20.5, 0.0), "3": (0.0, 0.5)}), floor=np.array([1, 1]))
    first = total.floors(hanging)[0].places[0]
    assert np.hypot(first.x_m - 20.5, first.y_m) >= BESIDE_M
    assert first.x_m == 17.5
    assert first.near == "3 m from landmark 7, 18 m from landmark 3"
