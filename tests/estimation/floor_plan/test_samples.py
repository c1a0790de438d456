"""Whole paths drawn from the posterior: as probable as they are, and where a tap tells most."""

from __future__ import annotations

import numpy as np
import pytest

from tests.estimation.floor_plan.plans import OFFICE_ROUTE, TWIN, along, in_own_frame, odometry_of, office, twins
from vislam2tag.estimation.floor_plan.pose_grid import PoseGrid
from vislam2tag.estimation.floor_plan.posterior import Filtered, PoseWeights, WalkPosterior, walk_posterior
from vislam2tag.estimation.floor_plan.samples import SAMPLES, PossiblePath, _drawn, possible_paths, telling_stretch
from vislam2tag.estimation.floor_plan.stretches import Stretches, stretches_of

TURN_RAD = 0.7
WALK = stretches_of(odometry_of(in_own_frame(along(OFFICE_ROUTE), TURN_RAD)))
MIDDLES = np.array([OFFICE_ROUTE[0] + one.middle * np.exp(1j * TURN_RAD) for one in WALK.stretches])


@pytest.fixture(scope="module")
def in_one() -> WalkPosterior:
    """The walk in the office."""
    return walk_posterior(PoseGrid(office()), WALK, {})


@pytest.fixture(scope="module")
def in_two() -> WalkPosterior:
    """The walk in one of two offices that look alike."""
    return walk_posterior(PoseGrid(twins()), WALK, {})


def test_two_places_that_look_alike_get_half_each(in_two: WalkPosterior) -> None:
    paths = possible_paths(WALK, in_two, 12)
    assert [path.weight for path in paths] == pytest.approx([0.5, 0.5], abs=0.12)
    assert sum(path.weight for path in paths) == pytest.approx(1)
    left, right = sorted(paths, key=lambda path: path.place[0].real)
    np.testing.assert_allclose(left.place, MIDDLES, atol=0.8)
    np.testing.assert_allclose(right.place, MIDDLES + TWIN, atol=0.8)
    for path in paths:
        assert np.abs(np.angle(np.exp(1j * (path.yaw_rad - TURN_RAD)))).max() < 0.15


def test_a_certain_walk_has_one_path(in_one: WalkPosterior) -> None:
    (path,) = possible_paths(WALK, in_one, 12)
    assert path.weight == 1
    assert possible_paths(WALK, in_one, 0) == ()


def test_the_most_probable_paths_come_first() -> None:
    path = in_own_frame(along((3 + 7j, 13 + 7j)), 0.0)  # up or down the corridor, or elsewhere
    walk = stretches_of(odometry_of(path))
    posterior = walk_posterior(PoseGrid(office()), walk, {})
    weights = [one.weight for one in possible_paths(walk, posterior, 12)]
    assert len(weights) > 2
    assert weights == sorted(weights, reverse=True)
    assert sum(weights) == pytest.approx(1)
    assert [one.weight for one in possible_paths(walk, posterior, 2)] == weights[:2]


def test_drawn_paths_take_the_steps_of_the_walk(in_two: WalkPosterior) -> None:
    place, yaw_rad = _drawn(WALK, in_two)
    assert place.shape == yaw_rad.shape == (SAMPLES, len(WALK.stretches))
    half = np.array([link.step for link in WALK.links]) / 2
    turn = np.exp(1j * yaw_rad)
    missed = np.abs(np.diff(place, axis=1) - half * turn[:, :-1] - half * turn[:, 1:])
    assert np.quantile(missed, 0.99) < 1.2
    assert np.abs(yaw_rad).max() <= np.pi


def test_last_poses_are_drawn_by_their_weights() -> None:
    grid = PoseGrid(office())
    cell = np.ravel_multi_index(([0, 0], [10, 10], [10, 50]), grid.shape)
    poses = PoseWeights(cell, np.array([0.9, 0.1]), np.zeros(2))
    alone = Stretches(WALK.stretches[:1], ())
    only = Filtered((poses,), np.zeros(1))
    paths = possible_paths(alone, WalkPosterior(grid, (poses,), only), 12)
    assert [path.weight for path in paths] == pytest.approx([0.9, 0.1], abs=0.06)
    assert paths[1].place[0] == pytest.approx(20.2 + 4.2j)


def test_the_same_walk_gives_the_same_paths(in_two: WalkPosterior) -> None:
    one, other = (possible_paths(WALK, in_two, 12) for _ in range(2))
    assert [path.weight for path in one] == [path.weight for path in other]
    assert all((first.place == second.place).all() for first, second in zip(one, other, strict=True))


def path_of(weight: float, *place: complex) -> PossiblePath:
    return PossiblePath(weight, np.array(place, dtype=np.complex128), np.zeros(len(place)), np.ones(len(place)))


def test_a_tap_helps_most_where_the_paths_are_apart() -> None:
    assert telling_stretch([path_of(0.5, 0, 5, 9), path_of(0.5, 1, 5.5, 20)]) == 2
    assert telling_stretch([path_of(0.5, 0, 40, 9), path_of(0.5, 1, 5.5, 10)]) == 1


def test_a_tap_helps_most_where_it_leaves_the_fewest_paths() -> None:
    three = [path_of(0.4, 0, 0, 0), path_of(0.3, 50, 0, 30), path_of(0.3, 50, 50, 60)]
    assert telling_stretch(three) == 2
    rare = [path_of(0.5, 0, 0), path_of(0.45, 0, 50), path_of(0.05, 50, 50)]  # the first tap leaves 95 %
    assert telling_stretch(rare) == 1


def test_a_tap_is_not_asked_where_a_path_has_several_places() -> None:
    loose, firm = path_of(0.5, 0, 0, 0), path_of(0.5, 0, 30, 25)
    loose.firm[1] = 0.5
    assert telling_stretch([loose, firm]) == 2
