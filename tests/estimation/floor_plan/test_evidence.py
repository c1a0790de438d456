"""Facts besides a walk's shape: what each says of the poses, and how much it can say."""

from __future__ import annotations

import numpy as np
import pytest

from tests.estimation.floor_plan.plans import OFFICE_ROUTE, TWIN, along, in_own_frame, odometry_of, office, twins
from vislam2tag.core.wall_costs import Float32Array
from vislam2tag.estimation.floor_plan.evidence import (
    WRONG_NATS,
    Fact,
    KnownPlace,
    KnownTurn,
    PossiblePlaces,
    evidence_of,
    nearest_stretch,
)
from vislam2tag.estimation.floor_plan.pose_grid import YAW_RAD, YAWS, PoseGrid
from vislam2tag.estimation.floor_plan.posterior import best_pose, walk_posterior
from vislam2tag.estimation.floor_plan.stretches import Stretches, stretches_of
from vislam2tag.estimation.odometry import Odometry

TRUTH = along(OFFICE_ROUTE)
TURN_RAD = 20 * YAW_RAD


@pytest.fixture(scope="module")
def odometry() -> Odometry:
    """A walk through an office, in the frame of its tracker."""
    return odometry_of(in_own_frame(TRUTH, TURN_RAD))


@pytest.fixture(scope="module")
def walk(odometry: Odometry) -> Stretches:
    return stretches_of(odometry)


def said(grid: PoseGrid, walk: Stretches, odometry: Odometry, *facts: Fact) -> Float32Array:
    """What facts of one stretch say."""
    (found,) = evidence_of(grid, walk, odometry, facts).values()
    return found


def at_true_pose(grid: PoseGrid, values: Float32Array, stretch_middle: complex) -> float:
    """The value of the pose (yaws, rows, columns) that a stretch really had."""
    place = OFFICE_ROUTE[0] + stretch_middle * np.exp(1j * TURN_RAD)
    ((row, column),) = grid.costs.positions.cells_of(np.array([(place.real, place.imag)]))
    return float(values[20, row, column])


def test_a_known_place_is_likeliest_where_the_walk_would_have_been_there(walk: Stretches, odometry: Odometry) -> None:
    grid = PoseGrid(office())
    frame = 150
    known = KnownPlace(frame, complex(TRUTH[frame]), 0.5)
    (number,) = evidence_of(grid, walk, odometry, [known])
    assert number == 1
    found = said(grid, walk, odometry, known)
    assert found.shape == grid.shape
    assert at_true_pose(grid, found, walk.stretches[1].middle) > -0.4
    place, yaw_rad = grid.place(np.arange(found.size))
    offset = odometry.path[frame] - walk.stretches[1].middle
    away = np.abs(place + offset * np.exp(1j * yaw_rad) - TRUTH[frame])
    expected = np.maximum(-0.5 * (away / np.hypot(0.5, 0.2)) ** 2, -WRONG_NATS)
    np.testing.assert_allclose(found.ravel(), expected, atol=0.02)


def test_what_was_seen_beside_the_camera_counts_at_its_own_place(walk: Stretches, odometry: Odometry) -> None:
    grid = PoseGrid(office())
    beside = 1.5 - 0.5j
    seen = KnownPlace(150, complex(TRUTH[150]) + beside * np.exp(1j * TURN_RAD), 0.5, beside)
    plain = KnownPlace(150, complex(TRUTH[150]), 0.5)
    middle = walk.stretches[1].middle
    found = said(grid, walk, odometry, seen)
    assert at_true_pose(grid, found, middle) == pytest.approx(
        at_true_pose(grid, said(grid, walk, odometry, plain), middle), abs=0.01
    )
    turned = np.roll(found, 60, axis=0)  # were the walk the other way round, the landmark would be on the other side
    assert at_true_pose(grid, turned, middle) < -4


def test_no_fact_costs_more_than_a_wrong_one_may(walk: Stretches, odometry: Odometry) -> None:
    grid = PoseGrid(office())
    places = np.array([900 + 900j])
    facts: list[Fact] = [
        KnownPlace(150, 900 + 900j, 0.01),
        KnownTurn(150, 0.1, 0.001),
        PossiblePlaces(150, places, np.ones(1), 0.01),
    ]
    for fact in facts:
        assert said(grid, walk, odometry, fact).min() == pytest.approx(-WRONG_NATS, abs=1e-4)
    assert said(grid, walk, odometry, *facts).min() == pytest.approx(-3 * WRONG_NATS, abs=1e-3)


def test_a_compass_prefers_its_yaw_at_every_place(walk: Stretches, odometry: Odometry) -> None:
    grid = PoseGrid(office())
    found = said(grid, walk, odometry, KnownTurn(0, TURN_RAD - 2 * np.pi, np.radians(25)))
    assert (found == found[:, :1, :1]).all()
    by_yaw = found[:, 0, 0]
    assert by_yaw[20] == pytest.approx(0, abs=1e-6)
    assert by_yaw[20 + 25 // 3 + 1] == pytest.approx(-0.5 * (27 / 25) ** 2, abs=1e-3)
    assert by_yaw[20 + 5] == pytest.approx(by_yaw[20 - 5])
    assert by_yaw[(20 + 60) % YAWS] == -WRONG_NATS


def test_possible_places_leave_the_rest_open(walk: Stretches, odometry: Odometry) -> None:
    grid = PoseGrid(office())
    places = np.array([complex(TRUTH[150]), 4.2 + 2.2j])
    found = said(grid, walk, odometry, PossiblePlaces(150, places, np.array([0.5, 0.2]), 0.4))
    assert found.min() == pytest.approx(np.log(0.3), abs=1e-3)
    assert at_true_pose(grid, found, walk.stretches[1].middle) == pytest.approx(np.log(0.3 + 0.5), abs=0.15)
    assert found.max() <= 0.1


def test_facts_of_one_stretch_add_up_and_others_stay_apart(walk: Stretches, odometry: Odometry) -> None:
    grid = PoseGrid(office())
    one, other = KnownPlace(150, 5 + 5j, 2.0), KnownTurn(160, 1.0, 0.5)
    both = evidence_of(grid, walk, odometry, [one, other, KnownTurn(0, 1.0, 0.5)])
    assert set(both) == {0, 1}
    apart = said(grid, walk, odometry, one) + said(grid, walk, odometry, other)
    np.testing.assert_allclose(both[1], apart, atol=1e-5)
    assert evidence_of(grid, walk, odometry, []) == {}


def test_a_frame_between_stretches_counts_for_the_nearest(walk: Stretches) -> None:
    apart = Stretches((walk.stretches[0], walk.stretches[2]), ())
    first, last = walk.stretches[0].last, walk.stretches[2].first
    assert nearest_stretch(apart, first + 5) == 0
    assert nearest_stretch(apart, last - 5) == 1
    assert nearest_stretch(apart, 10**6) == 1


@pytest.mark.parametrize("twin", [0.0, TWIN])
def test_a_tap_moves_the_posterior_to_its_place(walk: Stretches, odometry: Odometry, twin: float) -> None:
    grid = PoseGrid(twins())
    place = complex(TRUTH[300]) + twin
    evidence = evidence_of(grid, walk, odometry, [KnownPlace(300, place, 0.7)])
    posterior = walk_posterior(grid, walk, evidence)
    for poses, stretch in zip(posterior.poses, walk.stretches, strict=True):
        best = best_pose(grid, poses)
        assert best.mass > 0.99
        expected = OFFICE_ROUTE[0] + twin + stretch.middle * np.exp(1j * TURN_RAD)
        assert best.place == pytest.approx(expected, abs=0.4)


def test_a_tap_on_a_wrong_place_costs_what_a_wrong_fact_may(walk: Stretches, odometry: Odometry) -> None:
    grid = PoseGrid(office())
    evidence = evidence_of(grid, walk, odometry, [KnownPlace(300, 900j, 0.7)])
    wrong, without = walk_posterior(grid, walk, evidence), walk_posterior(grid, walk, {})
    assert without.log_evidence - wrong.log_evidence == pytest.approx(WRONG_NATS, abs=0.01)
    for one, other in zip(wrong.poses, without.poses, strict=True):
        assert best_pose(grid, one).place == pytest.approx(best_pose(grid, other).place, abs=1e-3)
