"""A walk on the plans of a building: placed, refused with a reason, or settled by a tap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from tests.estimation.floor_plan.plans import (
    OFFICE,
    OFFICE_ROUTE,
    OFFICE_SIZE,
    TWIN,
    along,
    area_of,
    in_own_frame,
    odometry_of,
    office,
    plans_with,
    twins,
    with_gap,
)
from vislam2tag.core.arrays import IntArray
from vislam2tag.core.cell_grid import WalkableArea
from vislam2tag.core.context import PlanOfFloor
from vislam2tag.core.status import Status
from vislam2tag.core.transforms import as_complex
from vislam2tag.core.wall_costs import FINE_M, WallCosts
from vislam2tag.estimation.floor_plan import placing as placing_module
from vislam2tag.estimation.floor_plan.acceptance import WalkFit
from vislam2tag.estimation.floor_plan.evidence import Fact, KnownPlace, KnownTurn, PossiblePlaces
from vislam2tag.estimation.floor_plan.placing import Mirror, PlacedWalk, _scale, asked_stretch, place_walk
from vislam2tag.estimation.floor_plan.pose_grid import PoseGrid
from vislam2tag.estimation.floor_plan.posterior import BestPose, walk_posterior
from vislam2tag.estimation.floor_plan.samples import PossiblePath
from vislam2tag.estimation.floor_plan.stretches import BETWEEN_FLOORS, stretches_of
from vislam2tag.estimation.odometry import Odometry

TURN_RAD = 0.7
TRUTH = along(OFFICE_ROUTE)
WALK = odometry_of(in_own_frame(TRUTH, TURN_RAD))
MIRRORED = WallCosts.of(WalkableArea(area_of(OFFICE, OFFICE_SIZE).mask[:, ::-1], (0.0, 0.0), FINE_M))


def placed(costs: WallCosts, *facts: Fact) -> PlacedWalk:
    """The walk on one plan."""
    found = place_walk(WALK, plans_with(costs), 0, facts)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def in_office() -> PlacedWalk:
    return placed(office())


@pytest.fixture(scope="module")
def in_twins() -> PlacedWalk:
    return placed(twins())


def errors_m(found: PlacedWalk, shift: complex = 0j) -> np.ndarray:
    """Distance (k,) of the finer poses from the truth."""
    true = [OFFICE_ROUTE[0] + shift + one.middle * np.exp(1j * TURN_RAD) for one in found.local.stretches]
    return np.asarray(np.abs(found.local.place - np.array(true)))


def test_a_walk_that_fits_one_place_is_placed_there(in_office: PlacedWalk) -> None:
    placing = in_office.placing
    assert set(in_office.status) == {Status.OK}
    assert errors_m(in_office).max() < 0.2
    assert (placing.reason, placing.labelled_share) == (Status.OK, 1.0)
    assert placing.way_m == pytest.approx(64, abs=1)
    assert placing.misfit < 0.2
    assert placing.mirror > 10
    assert placing.exchanged > 10
    assert (placing.floors, placing.best_tap) == ((), None)
    (path,) = placing.candidates
    assert path.weight == 1
    assert path.turn_rad == pytest.approx(TURN_RAD, abs=0.05)
    assert np.abs(as_complex(path.position_bcs) - TRUTH[list(placing.frame)]).max() < 0.5


def test_a_walk_that_fits_two_places_has_two_candidates_and_a_best_tap(in_twins: PlacedWalk) -> None:
    placing = in_twins.placing
    assert set(in_twins.status) == {Status.AMBIGUOUS}
    assert (placing.reason, placing.labelled_share) == (Status.AMBIGUOUS, 0.0)
    assert len(in_twins.local.place) == 0
    weights = [one.weight for one in placing.candidates]
    assert weights == pytest.approx([0.5, 0.5], abs=0.12)
    for one in placing.candidates:
        found = as_complex(one.position_bcs)
        shift = TWIN if found[0].real > TWIN else 0.0
        assert np.abs(found - TRUTH[list(placing.frame)] - shift).max() < 3
        assert np.median(np.abs(np.diff(found))) < 1.6, "no corner is cut"
    assert placing.best_tap in placing.frame


@pytest.mark.parametrize("shift", [0.0, TWIN])
def test_one_tap_settles_which_place_it_was(in_twins: PlacedWalk, shift: float) -> None:
    frame = in_twins.placing.best_tap
    assert frame is not None
    found = placed(twins(), KnownPlace(frame, TRUTH[frame] + shift, 0.7))
    assert set(found.status) == {Status.OK}
    assert errors_m(found, shift).max() < 0.25


def test_a_stretch_whose_path_is_elsewhere_is_no_longer_certain(in_office: PlacedWalk) -> None:
    second = in_office.walk.stretches[1]
    moved = TRUTH.copy()
    moved[second.first : second.last + 1] += 0.6
    agreed = in_office.without_contradictions(TRUTH, WALK.path)
    assert set(agreed.status) == {Status.OK}
    found = in_office.without_contradictions(moved, WALK.path)
    expected = [Status.OK] * len(found.status)
    expected[1] = Status.FITS_NOWHERE
    assert found.status.tolist() == expected
    assert found.placing.labelled_share == pytest.approx(1 - 1 / len(expected))
    assert found.placing.reason is Status.OK
    nowhere = in_office.without_contradictions(TRUTH + 0.6, WALK.path)
    assert (nowhere.placing.labelled_share, nowhere.placing.reason) == (0, Status.FITS_NOWHERE)


UPSTAIRS = 8
"""From this corner of the route on the walk is on the floor above, which has other rooms."""
LOWER = WallCosts.of(area_of(OFFICE[:6], OFFICE_SIZE))
UPPER = WallCosts.of(area_of((*OFFICE[:2], *OFFICE[6:], (0, 0, 0, 0)), OFFICE_SIZE))


def over_two_floors(floor: IntArray | None, plans: dict[int, WallCosts | None]) -> PlacedWalk | None:
    return place_walk(WALK, tuple(PlanOfFloor(number, partial(plans.get, number)) for number in plans), 1, (), floor)


def floors_of_the_walk() -> IntArray:
    """The stairs, of which a plan shows little, are the last two metres before."""
    change = int(np.argmin(np.abs(TRUTH - OFFICE_ROUTE[UPSTAIRS])))
    floor = np.where(np.arange(len(TRUTH)) < change, 1, 2)
    floor[change - 20 : change] = BETWEEN_FLOORS
    return floor


def test_each_floor_that_a_walk_leads_to_has_its_own_plan() -> None:
    found = over_two_floors(floors_of_the_walk(), {1: LOWER, 2: UPPER})
    assert found is not None
    assert {one.floor for one in found.walk.stretches} == {1, 2}
    assert set(found.status) == {Status.OK}
    assert errors_m(found).max() < 0.25
    assert found.placing.floors == ()
    alone = over_two_floors(None, {1: LOWER, 2: UPPER})
    assert alone is not None
    assert Status.OK not in alone.status


def test_a_walk_over_floors_competes_with_the_same_walk_from_another_floor() -> None:
    found = over_two_floors(floors_of_the_walk(), {0: UPPER, 1: LOWER, 2: UPPER, 3: LOWER})
    assert found is not None
    assert set(found.status) == {Status.OK}
    assert [number for number, _ in found.placing.floors] == [0, 2]
    assert min(nats for _, nats in found.placing.floors) > 5


def test_a_floor_without_plan_leaves_a_walk_to_it_unplaced() -> None:
    assert over_two_floors(floors_of_the_walk(), {1: LOWER}) is None
    assert over_two_floors(floors_of_the_walk(), {1: LOWER, 2: None}) is None


def test_a_mirrored_plan_is_refused_and_the_mirror_image_fits_better() -> None:
    found = placed(MIRRORED)
    assert set(found.status) == {Status.FITS_MIRROR}
    assert found.placing.reason is Status.FITS_MIRROR
    assert found.placing.mirror < -10
    assert found.placing.best_tap is None, "the plan is wrong"


def test_a_plan_with_rooms_missing_fits_nowhere() -> None:
    found = placed(WallCosts.of(area_of([(1, 1, 22, 3), (1, 1, 3, 12)], (24, 14))))
    assert set(found.status) == {Status.FITS_NOWHERE}
    assert found.placing.misfit > 1


def test_a_walk_larger_than_the_plan_fits_nowhere() -> None:
    found = placed(WallCosts.of(area_of([(0.5, 0.5, 5.5, 4.5)], (6, 5))))
    assert set(found.status) == {Status.FITS_NOWHERE}


def test_a_plan_of_an_open_hall_is_too_open() -> None:
    found = placed(WallCosts.of(area_of([(1, 1, 24, 17)], (25, 18))))
    assert set(found.status) == {Status.PLAN_TOO_OPEN}
    assert len(found.placing.candidates) == 12


def test_a_plan_with_too_many_possible_poses_is_refused_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(placing_module, "MOST_POSES", 1000)
    found = placed(office())
    assert set(found.status) == {Status.PLAN_TOO_OPEN}
    assert found.best == ()
    assert len(found.local.place) == 0
    assert set(found.frame_status(len(WALK.path))) == {Status.PLAN_TOO_OPEN}


def test_a_loss_of_the_tracker_is_bridged_by_the_plan() -> None:
    path = WALK.path.copy()
    path[331:] = path[330] + (path[331:] - path[330]) * np.exp(0.3j) + 1.0  # turned and moved by the loss
    found = place_walk(with_gap(replace(WALK, path=path), 330, 1.5, 0.4), plans_with(office()), 0)
    assert found is not None
    assert set(found.status) == {Status.OK}
    middles = [(one.first + one.last) // 2 for one in found.local.stretches]
    near = np.abs(found.local.place - TRUTH[middles])
    assert np.median(near) < 0.5
    assert near.max() < 3


TWO_FLOORS = (PlanOfFloor(0, office), PlanOfFloor(1, lambda: MIRRORED), PlanOfFloor(2, lambda: None))


def test_the_right_floor_is_preferred_to_others() -> None:
    found = place_walk(WALK, TWO_FLOORS, 0)
    assert found is not None
    ((number, nats),) = found.placing.floors
    assert number == 1
    assert nats > 10
    assert set(found.status) == {Status.OK}


def test_a_plan_of_two_floors_alike_is_refused() -> None:
    alike = (PlanOfFloor(4, office), PlanOfFloor(5, office))
    found = place_walk(WALK, alike, 4)
    assert found is not None
    ((number, nats),) = found.placing.floors
    assert (number, nats) == pytest.approx((5, 0), abs=0.05)
    assert set(found.status) == {Status.FITS_OTHER_FLOOR}
    assert len(found.placing.candidates) == 1
    tap = found.placing.best_tap
    assert tap is not None
    settled = place_walk(WALK, alike, 4, [KnownPlace(tap, complex(TRUTH[tap]), 0.7)])
    assert settled is not None
    assert set(settled.status) == {Status.OK}
    assert settled.placing.best_tap is None


GOOD = WalkFit(misfit=0.1, mirror=12.0, exchanged=8.0, floors={}, open_share=0.01, way_m=150.0)
PATH = PossiblePath(1.0, np.arange(6, dtype=np.complex128) * 10, np.zeros(6), np.ones(6))
OTHER = replace(PATH, place=PATH.place + 20 * (np.arange(6) == 5))
OK, VAGUE, WALLS = Status.OK, Status.AMBIGUOUS, Status.FITS_NOWHERE


def asked(fit: WalkFit, paths: Sequence[PossiblePath], *status: Status, mass: float = 1.0) -> int | None:
    """The stretch at which a walk is asked for its place; the second one has a wider posterior than others."""
    best = [BestPose(0j, 0.0, 1.0, np.eye(2) * (0.1 + 0.3 * (number == 1)), 0.0) for number in range(len(status))]
    best[4] = replace(best[4], mass=mass)
    return asked_stretch(fit, np.array(status, dtype=np.int8), best, paths)


def test_a_tap_is_asked_for_in_the_longest_part_without_a_place() -> None:
    assert asked(GOOD, [PATH], VAGUE, OK, VAGUE, VAGUE, VAGUE, OK) == 3
    assert asked(GOOD, [PATH], VAGUE, OK, OK, OK, VAGUE, VAGUE) == 5
    assert asked(GOOD, [PATH], VAGUE, OK, WALLS, WALLS, WALLS, OK) == 0
    assert asked(GOOD, [PATH, OTHER], VAGUE, OK, OK, OK, OK, OK) == 5, "where its paths are apart"


def test_a_tap_is_asked_for_where_a_refused_walk_is_least_certain() -> None:
    for changes, reason in (({"mirror": 2.0}, Status.FITS_MIRROR), ({"exchanged": 0.5}, WALLS)):
        refused = replace(GOOD, **changes)  # type: ignore[arg-type]
        assert asked(refused, [PATH], *[reason] * 6) == 1
        assert asked(refused, [PATH], *[reason] * 6, mass=0.6) == 4


def test_no_tap_is_asked_for_where_none_helps() -> None:
    for paths in ([PATH], [PATH, OTHER]):
        assert asked(GOOD, paths, *[OK] * 6) is None
        assert asked(GOOD, paths, OK, WALLS, OK, OK, OK, OK) is None
        assert asked(replace(GOOD, misfit=0.3), paths, *[WALLS] * 6) is None
        assert asked(replace(GOOD, mirror=-6.0), paths, *[Status.FITS_MIRROR] * 6) is None


def test_a_known_place_says_which_floor_it_is() -> None:
    alike = (PlanOfFloor(4, office), PlanOfFloor(5, office))
    found = place_walk(WALK, alike, 4, [KnownPlace(300, complex(TRUTH[300]), 0.7)])
    assert found is not None
    assert found.placing.floors == ()
    assert set(found.status) == {Status.OK}


def test_without_a_plan_or_a_way_nothing_is_placed() -> None:
    assert place_walk(WALK, TWO_FLOORS, 2) is None
    assert place_walk(WALK, TWO_FLOORS, 7) is None
    assert place_walk(WALK, (), 0) is None
    assert place_walk(odometry_of(np.zeros(100, dtype=np.complex128)), TWO_FLOORS, 0) is None


def test_frames_have_the_status_of_their_stretch_and_between_two_the_worse(in_office: PlacedWalk) -> None:
    walk = stretches_of(with_gap(with_gap(WALK, 200, 1.0), 215, 1.0))
    assert walk.stretches[1].last < 205
    assert walk.stretches[2].first > 210
    ok, vague, short = Status.OK, Status.AMBIGUOUS, Status.TOO_SHORT
    count = len(walk.stretches)

    def statuses(*given: Status) -> np.ndarray:
        filled = np.array([*given, *[ok] * (count - len(given))], dtype=np.int8)
        return replace(in_office, walk=walk, status=filled).frame_status(len(WALK.path))

    second, third = walk.stretches[1], walk.stretches[2]
    found = statuses(ok, vague, short)
    assert set(found[: second.first]) == {ok}
    assert set(found[second.first + 1 : second.last + 1]) == {vague}
    assert set(found[second.last + 1 : third.first]) == {vague}
    assert set(found[third.first : third.last]) == {short}
    assert set(statuses(ok, ok, short)[second.last + 1 : third.first]) == {short}
    assert set(statuses(ok, ok, ok)) == {ok}


def test_frames_before_and_after_all_stretches_have_the_nearest_status(in_office: PlacedWalk) -> None:
    stood = np.concatenate((np.zeros(50, dtype=np.complex128), WALK.path, np.repeat(WALK.path[-1], 50)))
    found = place_walk(odometry_of(stood), plans_with(office()), 0)
    assert found is not None
    first, last = found.walk.stretches[0].first, found.walk.stretches[-1].last
    assert first > 40
    status = np.full(len(found.status), Status.OK, dtype=np.int8)
    status[0], status[-1] = Status.AMBIGUOUS, Status.TOO_SHORT
    frames = replace(found, status=status).frame_status(len(stood))
    assert set(frames[:first]) == {Status.AMBIGUOUS}
    assert set(frames[last + 1 :]) <= {Status.TOO_SHORT}


@pytest.mark.parametrize("first", [0, 2])
def test_a_mirrored_walk_turns_to_the_other_side(first: int) -> None:
    walk = stretches_of(WALK)
    mirror = Mirror.at(walk, first)
    start = walk.stretches[first].first if first else 0
    path = mirror.path(WALK.path)
    np.testing.assert_array_equal(path[:start], WALK.path[:start])
    before, after = np.diff(WALK.path[start:]), np.diff(path[start:])
    np.testing.assert_allclose(np.abs(before), np.abs(after), atol=1e-9)
    turned, mirrored = (np.angle(steps[1:] / steps[:-1]) for steps in (before, after))
    clear = np.abs(np.abs(turned) - np.pi) > 0.1
    np.testing.assert_allclose(turned[clear], -mirrored[clear], atol=1e-6)
    ahead = walk.stretches[first].points[10] - walk.stretches[first].points[0]
    assert mirror.turn * ahead.conj() == pytest.approx(ahead)  # it goes on as it did


def test_the_mirror_image_of_a_whole_walk_begins_at_its_first_frame() -> None:
    stood = odometry_of(np.concatenate((np.repeat(WALK.path[:1], 50), WALK.path)))
    walk = stretches_of(stood)
    assert walk.stretches[0].first > 40
    assert Mirror.at(walk, 0).frame == 0
    assert Mirror.at(walk, 1).frame == walk.stretches[1].first


def test_what_a_mirrored_walk_saw_is_on_its_other_side() -> None:
    mirror = Mirror(100, 3 + 4j, np.exp(2j * 0.4))
    aside = np.exp(0.4j) * 1j
    before, after = KnownPlace(99, 1j, 0.5, aside), KnownPlace(100, 1j, 0.5, aside)
    possible = PossiblePlaces(150, np.array([1j]), np.ones(1), 1.0)
    same, other, kept = mirror.facts([before, KnownTurn(0, 1.0, 0.1), after, possible])
    assert same is before
    assert kept is possible
    assert isinstance(other, KnownPlace)
    assert other.offset == pytest.approx(-aside)
    assert replace(other, offset=aside) == after


def test_a_landmark_that_the_mirror_image_also_saw_is_no_evidence_against_it() -> None:
    """Two corridors that their diagonal exchanges, and a landmark on it."""
    costs = WallCosts.of(area_of([(1, 1, 22, 3), (1, 1, 3, 22)], (23, 23)))
    path = along((20 + 2j, 2 + 2j, 2 + 20j))
    aside = -0.8 - 0.8j
    seen = KnownPlace(180, complex(path[180]) + aside, 0.3, aside)
    found = place_walk(odometry_of(path), plans_with(costs), 0, [seen])
    assert found is not None
    assert found.placing.mirror == pytest.approx(0, abs=0.5)


NARROW = area_of(
    [(1, 1, 41, 1.9), (40.1, 1, 41, 16), (26, 15.1, 41, 16), (26, 1, 26.9, 16), (1, 1, 1.9, 9), (1, 8.1, 13, 9)],
    (42, 17),
)
"""Narrow corridors, in which a walk fits only at its own size."""
LONG_WALK = odometry_of(
    in_own_frame(
        along((12 + 8.55j, 1.45 + 8.55j, 1.45 + 1.45j, 40.55 + 1.45j, 40.55 + 15.55j, 26.45 + 15.55j, 26.45 + 1.45j)),
        TURN_RAD,
    )
)


def scale_on(costs: WallCosts, odometry: Odometry) -> float:
    """Size of a plan by a walk."""
    return _scale(walk_posterior(PoseGrid(costs), stretches_of(odometry), {}), odometry, [], stretches_of)


@pytest.mark.parametrize("scale", [0.98, 1.0, 1.02])
def test_a_long_walk_shows_the_size_of_its_plan(scale: float) -> None:
    plan = WallCosts.of(WalkableArea(NARROW.mask, (0.0, 0.0), scale * FINE_M))
    assert scale_on(plan, LONG_WALK) == pytest.approx(scale, abs=0.006)


def test_a_walk_that_fits_at_several_sizes_does_not_show_it() -> None:
    plan = WallCosts.of(WalkableArea(area_of(OFFICE, OFFICE_SIZE).mask, (0.0, 0.0), 1.02 * FINE_M))
    assert scale_on(plan, WALK) == 1
