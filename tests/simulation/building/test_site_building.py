from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.site.walkable.hand_made import CORRIDOR, HEIGHT_M, MARGIN_M, WIDTH_M, plan
from vislam2tag.common.errors import SurveyError
from vislam2tag.core.arrays import FloatArray
from vislam2tag.simulation.building.site_building import SiteFloor, SiteLandmarks, site_building
from vislam2tag.simulation.model import TrueWalk
from vislam2tag.simulation.settings import TrackerSettings, WalkSettings
from vislam2tag.simulation.tracking.tracker import track
from vislam2tag.simulation.walking.walk import make_walk
from vislam2tag.site.walkable.graph import corridor_graph
from vislam2tag.site.walkable.space import walkable_space

LOW, HIGH = CORRIDOR
PLACES = np.array([(2.0, LOW + 0.1), (8.5, HIGH - 0.1), (16.0, HIGH - 0.1), (22.0, LOW + 0.1), (12.0, 0.1)])
"""Four sheets in the corridor and one in the hall."""


def landmarks(places: FloatArray = PLACES, width_m: float = np.nan) -> SiteLandmarks:
    unknown = np.full(len(places), np.nan)
    ids = tuple(str(number) for number in range(1, len(places) + 1))
    return SiteLandmarks(ids, places, unknown, np.full(len(places), 0.02), unknown, np.full(len(places), width_m))


@cache
def floor() -> SiteFloor:
    drawn = plan()
    space = walkable_space(drawn)
    return SiteFloor(0, "Ground", drawn.extent_m, None, space, corridor_graph(space), landmarks())


def walk(seed: int = 0, minutes: float = 4) -> TrueWalk:
    return make_walk(site_building([floor()], 7).floors[0], minutes * 60, WalkSettings(), np.random.default_rng(seed))


def test_headings_that_nobody_knows_are_those_of_the_walls() -> None:
    (made,) = site_building([floor()], 7).floors
    heading = np.exp(1j * made.landmark_heading_rad)
    assert heading.real == pytest.approx([-1, 1, 1, -1, -1], abs=0.05)  # seen from the corridor, right is x or -x
    assert made.landmark_position[:, 2] == pytest.approx(1.4, abs=0.2)
    assert made.lower_left_m == (-MARGIN_M, -MARGIN_M)


def test_floors_are_drawn_by_their_own_numbers() -> None:
    alone = site_building([floor()], 7)
    both = site_building([floor(), replace(floor(), number=1)], 7)
    assert (both.floors[0].control_points == alone.floors[0].control_points).all()
    assert (both.ap_position[: len(alone.ap_position)] == alone.ap_position).all()
    assert both.floors[1].elevation_m == pytest.approx(3.6)
    assert len(alone.ap_bssid) == 6


def test_walks_keep_within_the_floor_and_pass_the_sheets() -> None:
    walked = walk()
    assert floor().space.inside(walked.position[:, :2]).mean() > 0.999
    assert len(np.unique(walked.landmarks_passed)) >= 4


def test_the_tracker_sees_sheets_but_not_through_walls() -> None:
    (made,) = site_building([floor()], 7).floors
    walked = walk()
    log = track(walked, made, TrackerSettings(severity=0), np.random.default_rng(1), 0.5)
    assert len(set(log.landmarks.ids)) >= 4
    # Behind the wall that each of the corridor's sheets hangs on, turned to the corridor and near enough.
    moved = made.landmark_position.copy()
    moved[:4, 1] += (-0.6, 0.6, 0.6, -0.6)
    behind = replace(made, landmark_position=moved)
    hidden = track(walked, behind, TrackerSettings(severity=0), np.random.default_rng(1), 0.5)
    assert set(hidden.landmarks.ids) <= {"5"}
    unwalled = track(walked, replace(behind, space=None), TrackerSettings(severity=0), np.random.default_rng(1), 0.5)
    assert len(set(unwalled.landmarks.ids)) > 2


def test_larger_sheets_are_seen_from_farther() -> None:
    (made,) = site_building([replace(floor(), landmarks=landmarks(width_m=0.4))], 7).floors
    assert made.sheet_reach == pytest.approx(0.4 / 0.19)


def test_thin_walls_are_one_wall_for_radio() -> None:
    (made,) = site_building([floor()], 7).floors
    middle = made.walls.mean(axis=1)
    inner = (np.abs(middle[:, 1] - LOW) < 0.3) & (np.abs(np.diff(made.walls, axis=1)[:, 0, 0]) > 3)
    assert inner.sum() == 2  # one face on each side of the gate


def test_too_few_landmarks_are_told() -> None:
    with pytest.raises(SurveyError, match="has 1 landmarks"):
        site_building([replace(floor(), landmarks=landmarks(PLACES[:1]))], 7)


def test_a_landmark_outside_is_named() -> None:
    places = np.vstack((PLACES, [(WIDTH_M + 5, HEIGHT_M)]))
    with pytest.raises(SurveyError, match=r"landmark 6 at \(29\.00, 20\.00\)"):
        site_building([replace(floor(), landmarks=landmarks(places))], 7)
